"""Finding the programs of a workspace that run on rosz, and what the others need.

No program is run. A Python program is expected to run if it and the modules that it imports from
the workspace are Python 3, and if each module that they import is part of Python, of rosz or of a
package on the path, or is installed. Imports that an ``except`` clause guards may be missing.
Programs in C++ are listed.
"""

from __future__ import annotations

import ast
import re
import sys
import warnings
from collections.abc import Iterator, Sequence
from functools import cache
from importlib.machinery import PathFinder
from pathlib import Path

import msgspec

from rosz.environment import Environment, package_index
from rosz.errors import RoszError
from rosz.packages import Package, PackageIndex, is_python
from rosz.replacements import instead_of
from rosz.ros1.modules import MODULES, Module
from rosz.ros1.python2 import explain, hint
from rosz.ros1.python_setup import Offers
from rosz.typestore import TypeStore
from rosz.workspace.programs import compiled_programs

_OWN_EXTRAS = {"cv2": "vision", "numpy": "numpy", "serial": "serial"}
"""Modules from PyPI, and the extra of rosz that installs each."""
_DISTRIBUTIONS_FILE = Path(__file__).with_name("distributions.txt")
_IMPORT_ERRORS = frozenset({"ImportError", "ModuleNotFoundError", "Exception"})
# The limit is needed because the whole file is parsed again after each line of Python 2.
_MOST_LINES = 200
_BLOCK = re.compile(
    r"\s*(?:if|elif|else|for|while|try|except|finally|with|def|class)\b.*:\s*(#.*)?"
)


class ProgramNeeds(msgspec.Struct, frozen=True):
    """A Python program of a package, and its needs.

    Attributes:
        package: Name of the package.
        path: Path of the program.
        python2: Places that are not Python 3, as ``file:line``, each with a reason.
        install: Arguments for ``pip install``, for modules that are not installed.
        missing: Modules that were not found, each with a replacement if one is known.
    """

    package: str
    path: str
    python2: list[str]
    install: list[str]
    missing: list[str]

    @property
    def runs(self) -> bool:
        """Whether the program runs without changes."""
        return not (self.python2 or self.install or self.missing)


class Migration(msgspec.Struct, frozen=True):
    """The parts of a workspace that run on rosz, and those that do not.

    Attributes:
        packages: Number of packages.
        programs: The Python programs.
        compiled: Programs in C++ by package; neither rosz nor this machine builds them.
        errors: Number of errors of ``rosz pkg check``, by package, except errors of Python 2.
    """

    packages: int
    programs: list[ProgramNeeds]
    compiled: dict[str, list[str]]
    errors: dict[str, int]

    @property
    def runs(self) -> bool:
        """Whether the whole workspace runs without changes."""
        return (
            not self.compiled and not self.errors and all(program.runs for program in self.programs)
        )


def migrate(folders: Sequence[Path], environment: Environment, errors: dict[str, int]) -> Migration:
    """Find the needs of the programs of packages.

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
    sources = {package.name: list(compiled_programs(package.path)) for package in packages}
    compiled = {name: names for name, names in sources.items() if names}
    return Migration(len(packages), programs, compiled, errors)


def _python_programs(package: Package) -> Iterator[Path]:
    for name in package.executables():
        try:
            file = package.executable(name)
        except RoszError:  # 'check' reports it
            continue
        if is_python(file) and file.name != "setup.py" and file.suffix != ".cfg":
            # The path of an entry point ends in a colon and the name of a function.
            yield file.with_name(file.name.partition(":")[0])


def _program(package: Package, file: Path, imports: _Imports) -> ProgramNeeds:
    """Return the needs of a program; its imports are followed through the workspace."""
    python2: dict[str, None] = {}
    install: set[str] = set()
    missing: dict[str, None] = {}
    done: set[Path] = set()
    waiting = [file]
    while waiting:
        current = waiting.pop()
        if current in done:
            continue
        done.add(current)
        source = imports.read(current)
        python2 |= dict.fromkeys(source.python2)
        for name in source.imports:
            followed, distribution, absent = imports.find(name, [file.parent, _above(current)])
            waiting += followed
            install |= {distribution} - {""}
            if absent:
                missing[absent] = None
    return ProgramNeeds(package.name, str(file), list(python2), sorted(install), list(missing))


def _above(file: Path) -> Path:
    """Return the folder that contains the top-level package or module of a file."""
    folder = file.parent
    while (folder / "__init__.py").is_file():
        folder = folder.parent
    return folder


class _FileImports(msgspec.Struct, frozen=True):
    """The names that a file imports, and its places that are not Python 3."""

    imports: list[str]
    python2: list[str]


class _Imports:
    """Finds modules in packages, in Python and in rosz, and among installed modules."""

    def __init__(self, index: PackageIndex, environment: Environment) -> None:
        cache = environment.home / "rosz"
        self._store = TypeStore(index, cache)
        self._names = {package.name: package.path for package in index.packages()}
        self._offers = Offers(index, cache / "modules.json")
        self._sources: dict[Path, _FileImports] = {}
        self._found: dict[str, tuple[list[Path], str, str]] = {}

    def read(self, file: Path) -> _FileImports:
        if file not in self._sources:
            self._sources[file] = _read(file)
        return self._sources[file]

    def find(self, name: str, beside: Sequence[Path]) -> tuple[list[Path], str, str]:
        """Find a module.

        Args:
            name: Full name of the module.
            beside: Folders that are searched first.

        Returns:
            Files whose imports are to be followed; a distribution to install, or an empty text; the
            missing module with its replacement, or an empty text.
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
        needs = MODULES.get(root, Module()).extras or (
            {root: _OWN_EXTRAS[root]} if root in _OWN_EXTRAS else {}
        )
        for needed, extra in needs.items():
            if not _is_installed(needed):
                return [], f"'rosz[{extra}]'", ""
        if root in sys.stdlib_module_names or root in {*MODULES, "rosz"}:
            return [], "", ""
        code = self._offers.find(root)
        if code is not None:
            return _files_of(code.parent, name), "", ""
        if self._has_types(root) or _is_installed(root):
            return [], "", ""
        if root in _distributions():
            return [], _distributions()[root], ""
        instead = instead_of(name) or instead_of(root)
        return [], "", f"{root} ({instead})" if instead else root

    def _has_types(self, package: str) -> bool:
        """Return whether a package has messages, services or dynamic_reconfigure files."""
        if self._store.has(package, "msg") or self._store.has(package, "srv"):
            return True
        return package in self._names and any((self._names[package] / "cfg").glob("*.cfg"))


@cache
def _distributions() -> dict[str, str]:
    """Return the distributions of modules from PyPI that programs of ROS often import."""
    lines = _DISTRIBUTIONS_FILE.read_text("utf-8").splitlines()
    rows = (line.split() for line in lines if not line.startswith("#"))
    return {row[0]: row[-1] for row in rows}


def _files_of(folder: Path, name: str) -> list[Path]:
    """Return the files in a folder that the import of a module executes."""
    files: list[Path] = []
    for part in name.split("."):
        folder = folder / part
        if (folder / "__init__.py").is_file():
            files.append(folder / "__init__.py")
        elif folder.with_name(f"{part}.py").is_file():
            return [*files, folder.with_name(f"{part}.py")]
        else:
            break
    return files


def _is_installed(name: str) -> bool:
    return PathFinder.find_spec(name) is not None


def _read(file: Path) -> _FileImports:
    """Return the imports of a file; lines that are not Python 3 are replaced one by one."""
    try:
        lines = file.read_text("utf-8", "replace").split("\n")
    except OSError:
        return _FileImports([], [])
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
                return _FileImports([], python2)
            lines[line - 1] = _without(lines[line - 1])
        except ValueError as fault:  # null bytes
            return _FileImports([], [f"{file}:1: not valid Python: {fault}"])
        else:
            names = dict(_imported(tree, file, python2))
            return _FileImports(list(names), python2)
    return _FileImports([], python2)


def _without(line: str) -> str:
    """Return the replacement for a line that cannot be parsed."""
    indent = line[: len(line) - len(line.lstrip())].expandtabs(8)
    if line.lstrip().startswith("except"):
        return f"{indent}except Exception:"
    return f"{indent}if 1:" if _BLOCK.fullmatch(line) else f"{indent}pass"


def _imported(tree: ast.Module, file: Path, python2: list[str]) -> Iterator[tuple[str, None]]:
    """Yield the names that a file imports; add modules of Python 2 to the given list."""
    optional = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.Try) and any(map(_is_for_imports, node.handlers))
        for inner in ast.walk(node)
    }
    for node in ast.walk(tree):
        for name in _names_in(node, file) if id(node) not in optional else ():
            old = hint(ModuleNotFoundError("", name=name.partition(".")[0]))
            if old:
                python2.append(f"{file}:{getattr(node, 'lineno', 0)}: {old.partition(';')[0]}")
            elif name:
                yield name, None


def _names_in(node: ast.AST, file: Path) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if not isinstance(node, ast.ImportFrom):
        return []
    if node.level:
        parts = _package_of(file, node)
        return [".".join(parts)] if parts else []
    inner = [f"{node.module}.{alias.name}" for alias in node.names if alias.name != "*"]
    return [node.module or "", *inner]


def _package_of(file: Path, node: ast.ImportFrom) -> list[str]:
    """Return the parts of the full name of the module in a relative import."""
    if node.level > len(file.parents):
        return []
    folder = file.parents[node.level - 1]
    parts = folder.relative_to(_above(folder / "__init__.py")).parts
    return [*parts, *([node.module] if node.module else [])] if parts else []


def _is_for_imports(handler: ast.ExceptHandler) -> bool:
    """Return whether an ``except`` clause handles a failed import."""
    if handler.type is None:
        return True
    names = {node.id for node in ast.walk(handler.type) if isinstance(node, ast.Name)}
    return bool(names & _IMPORT_ERRORS)
