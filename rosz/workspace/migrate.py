"""Tells what of a workspace runs on rosz: each Python program by what it imports, and C++.

Nothing is run. A program runs here if it and the modules that it imports from the workspace are
Python 3, and if each import of theirs is known: Python's, rosz's, of a package on the path, or
installed. Imports within ``try`` may be missing.
"""

from __future__ import annotations

import ast
import re
import sys
import warnings
from collections.abc import Iterator, Sequence
from importlib.machinery import PathFinder
from pathlib import Path

import msgspec

from rosz.environment import Environment, package_index
from rosz.errors import RoszError
from rosz.packages import Package, PackageIndex, is_python
from rosz.replacements import instead_of
from rosz.ros1.modules import ELSEWHERE, EXTRAS, MODULES
from rosz.ros1.python2 import explain, hint
from rosz.ros1.python_setup import Offers
from rosz.typestore import TypeStore
from rosz.workspace.programs import compiled_programs

__all__ = ("Migration", "Program", "migrate")

_OWN_EXTRAS = {"cv2": "vision", "numpy": "numpy", "serial": "serial"}
"""Modules from PyPI that an extra of rosz brings."""
_SAME_NAMES = (
    "casadi cherrypy control cvxopt dash docker flask gym h5py imutils jinja2 keras "
    "lxml matplotlib mediapipe mock netifaces networkx nose numba open3d "
    "osrf_pycommon pandas parameterized pexpect plotly psutil pyaudio pycurl pygame "
    "pymodbus pymongo pynput pyproj pyqtgraph pytest pyttsx3 requests scipy seaborn "
    "shapely simplejson six sympy tabulate tensorflow termcolor tornado torch "
    "torchvision tqdm transforms3d trimesh twisted ultralytics utm vosk websockets"
)
_DISTRIBUTIONS = {
    "Crypto": "pycryptodome",
    "OpenGL": "PyOpenGL",
    "PIL": "pillow",
    "PyQt5": "PyQt5",
    "bluetooth": "PyBluez",
    "bs4": "beautifulsoup4",
    "dateutil": "python-dateutil",
    "git": "GitPython",
    "google": "protobuf",
    "jwt": "PyJWT",
    "magic": "python-magic",
    "paho": "paho-mqtt",
    "pkg_resources": "setuptools",
    "setuptools": "setuptools",
    "skimage": "scikit-image",
    "sklearn": "scikit-learn",
    "smbus": "smbus2",
    "speech_recognition": "SpeechRecognition",
    "usb": "pyusb",
    "websocket": "websocket-client",
    "wx": "wxPython",
    "xmltodict": "xmltodict",
    "zmq": "pyzmq",
    **{name: name for name in _SAME_NAMES.split()},
}
"""Modules from PyPI that programs of ROS often import, and what pip installs for them."""
_IMPORT_ERRORS = frozenset({"ImportError", "ModuleNotFoundError", "Exception"})
_MOST_LINES = 200
_BLOCK = re.compile(
    r"\s*(?:if|elif|else|for|while|try|except|finally|with|def|class)\b.*:\s*(#.*)?"
)


class Program(msgspec.Struct, frozen=True):
    """A Python program of a package, and what it needs.

    Attributes:
        package: Name of the package.
        path: Path of the program.
        python2: Places that are Python 2, as ``file:line``, with the reason.
        install: What ``pip install`` brings for modules that are not installed.
        missing: Modules that are nowhere, with what to use instead, if that is known.
    """

    package: str
    path: str
    python2: list[str]
    install: list[str]
    missing: list[str]

    @property
    def runs(self) -> bool:
        """Whether it runs as it is."""
        return not (self.python2 or self.install or self.missing)


class Migration(msgspec.Struct, frozen=True):
    """The parts of a workspace that run on rosz, and those that do not.

    Attributes:
        packages: Number of packages.
        programs: The Python programs.
        compiled: Programs in C++ by package, which neither rosz nor this machine builds.
        errors: Number of errors of ``rosz pkg check``, by package, without those of Python 2.
    """

    packages: int
    programs: list[Program]
    compiled: dict[str, list[str]]
    errors: dict[str, int]

    @property
    def runs(self) -> bool:
        """Whether everything runs here as it is."""
        return not self.compiled and not self.errors and all(one.runs for one in self.programs)


def migrate(folders: Sequence[Path], environment: Environment, errors: dict[str, int]) -> Migration:
    """Look at what the programs of packages need.

    Args:
        folders: Folders of the packages.
        environment: Settings, with the path of other packages.
        errors: Number of errors that `check` found, by package.
    """
    packages = PackageIndex(list(folders)).packages()
    imports = _Imports(PackageIndex([*folders, *package_index(environment).roots]), environment)
    programs = [
        _program(package, file, imports)
        for package in packages
        for file in sorted({*_python_programs(package)})
    ]
    found = {package.name: list(compiled_programs(package.path)) for package in packages}
    compiled = {name: names for name, names in found.items() if names}
    return Migration(len(packages), programs, compiled, errors)


def _python_programs(package: Package) -> Iterator[Path]:
    for name in package.executables():
        try:
            file = package.executable(name)
        except RoszError:  # 'check' reports it
            continue
        if is_python(file) and file.name != "setup.py" and file.suffix != ".cfg":
            yield file.with_name(file.name.partition(":")[0])


def _program(package: Package, file: Path, imports: _Imports) -> Program:
    """Follow the imports of a program through the workspace."""
    python2: dict[str, None] = {}
    install: set[str] = set()
    missing: dict[str, None] = {}
    done: set[Path] = set()
    rest = [file]
    while rest:
        here = rest.pop()
        if here in done:
            continue
        done.add(here)
        source = imports.read(here)
        python2 |= dict.fromkeys(source.python2)
        for name in source.imports:
            followed, extra, absent = imports.find(name, [file.parent, *_above(here)])
            rest += followed
            install |= {extra} - {""}
            if absent:
                missing[absent] = None
    return Program(package.name, str(file), list(python2), sorted(install), list(missing))


def _above(file: Path) -> list[Path]:
    """Return the folder that the outermost module of a file lies in."""
    folder = file.parent
    while (folder / "__init__.py").is_file():
        folder = folder.parent
    return [folder]


class _Source(msgspec.Struct, frozen=True):
    """The names that a file imports, and its places that are Python 2."""

    imports: list[str]
    python2: list[str]


class _Imports:
    """The modules that can be imported.

    Args:
        index: All known packages.
        environment: Settings.
    """

    def __init__(self, index: PackageIndex, environment: Environment) -> None:
        cache = environment.home / "rosz"
        self._store = TypeStore(index, cache)
        self._names = {package.name: package.path for package in index.packages()}
        self._offers = Offers(index, cache / "modules.json")
        self._sources: dict[Path, _Source] = {}
        self._found: dict[str, tuple[list[Path], str, str]] = {}

    def read(self, file: Path) -> _Source:
        """Return what a file imports."""
        if file not in self._sources:
            self._sources[file] = _read(file)
        return self._sources[file]

    def find(self, name: str, beside: Sequence[Path]) -> tuple[list[Path], str, str]:
        """Find a module.

        Args:
            name: Its whole name.
            beside: Folders that are searched first.

        Returns:
            Files of the workspace to follow, what pip has to install, and why it is missing.
        """
        for folder in beside:
            files = _files_of(folder, name)
            if files:
                return files, "", ""
        if name not in self._found:
            self._found[name] = self._elsewhere(name)
        return self._found[name]

    def _elsewhere(self, name: str) -> tuple[list[Path], str, str]:
        root = name.partition(".")[0]
        needs = EXTRAS.get(root) or ({root: _OWN_EXTRAS[root]} if root in _OWN_EXTRAS else {})
        for needed, extra in needs.items():
            if not _is_installed(needed):
                return [], f"'rosz[{extra}]'", ""
        if root in sys.stdlib_module_names or root in {*MODULES, *ELSEWHERE, "rosz"}:
            return [], "", ""
        code = self._offers.find(root)
        if code is not None:
            return _files_of(code.parent, name), "", ""
        if self._has_types(root) or _is_installed(root):
            return [], "", ""
        if root in _DISTRIBUTIONS:
            return [], _DISTRIBUTIONS[root], ""
        instead = instead_of(name) or instead_of(root)
        return [], "", f"{root} ({instead})" if instead else root

    def _has_types(self, package: str) -> bool:
        """Return whether a package has messages, services or dynamic_reconfigure files."""
        if self._store.has(package, "msg") or self._store.has(package, "srv"):
            return True
        return package in self._names and any((self._names[package] / "cfg").glob("*.cfg"))


def _files_of(folder: Path, name: str) -> list[Path]:
    """Return the files that the import of a module loads from a folder."""
    found: list[Path] = []
    for part in name.split("."):
        folder = folder / part
        if (folder / "__init__.py").is_file():
            found.append(folder / "__init__.py")
        elif folder.with_name(f"{part}.py").is_file():
            return [*found, folder.with_name(f"{part}.py")]
        else:
            break
    return found


def _is_installed(*names: str) -> bool:
    return all(PathFinder.find_spec(name) is not None for name in names)


def _read(file: Path) -> _Source:
    """Read a file; lines that only Python 2 understands are left out one after another."""
    try:
        lines = file.read_text("utf-8", "replace").split("\n")
    except OSError:
        return _Source([], [])
    python2: list[str] = []
    for _ in range(_MOST_LINES):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                tree = ast.parse("\n".join(lines))
        except SyntaxError as fault:
            line = fault.lineno or 0
            plain = explain(fault, str(file))
            if plain is not None:
                what = plain.reason.partition(";")[0].removeprefix("this is Python 2 ")
                python2.append(f"{file}:{line}: {what.strip('()')}")
            elif not python2:
                python2.append(f"{file}:{line}: not valid Python: {fault.msg}")
            if not 0 < line <= len(lines) or lines[line - 1].strip() == "pass":
                return _Source([], python2)
            lines[line - 1] = _without(lines[line - 1])
        except ValueError as fault:  # null bytes
            return _Source([], [f"{file}:1: not valid Python: {fault}"])
        else:
            names = dict(_imported(tree, file, python2))
            return _Source(list(names), python2)
    return _Source([], python2)


def _without(line: str) -> str:
    """Return what takes the place of a line that cannot be read."""
    indent = line[: len(line) - len(line.lstrip())].expandtabs(8)
    if line.lstrip().startswith("except"):
        return f"{indent}except Exception:"
    return f"{indent}if 1:" if _BLOCK.fullmatch(line) else f"{indent}pass"


def _imported(tree: ast.Module, file: Path, python2: list[str]) -> Iterator[tuple[str, None]]:
    """Yield the names that a file imports, and add the names that only Python 2 has."""
    optional = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.Try) and any(map(_is_for_imports, node.handlers))
        for inner in ast.walk(node)
    }
    for node in ast.walk(tree):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.level:
            names = [".".join(_package_of(file, node))] if _package_of(file, node) else []
        elif isinstance(node, ast.ImportFrom):
            names = [node.module or ""]
            names += [f"{node.module}.{alias.name}" for alias in node.names if alias.name != "*"]
        if id(node) in optional:
            continue
        for name in names:
            old = hint(ModuleNotFoundError("", name=name.partition(".")[0]))
            if old:
                python2.append(f"{file}:{getattr(node, 'lineno', 0)}: {old.partition(';')[0]}")
            elif name:
                yield name, None


def _package_of(file: Path, node: ast.ImportFrom) -> list[str]:
    """Return the whole name of a module that is imported relative to another one."""
    folders = [file, *file.parents][node.level : node.level + 1]
    parts: list[str] = []
    for folder in folders:
        here = folder
        while (here / "__init__.py").is_file():
            parts.insert(0, here.name)
            here = here.parent
    return [*parts, *([node.module] if node.module else [])] if parts else []


def _is_for_imports(handler: ast.ExceptHandler) -> bool:
    """Return whether a handler expects that an import fails."""
    if handler.type is None:
        return True
    names = {node.id for node in ast.walk(handler.type) if isinstance(node, ast.Name)}
    return bool(names & _IMPORT_ERRORS)
