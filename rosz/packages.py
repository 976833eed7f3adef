"""ROS packages on disk: folders with a package.xml (REP 127, REP 149), or rosbuild's manifest.xml.

Programs of a package are its executable files, and the scripts that ``catkin_install_python`` lists
in CMakeLists.txt, of which a build would make executable ones. A package in Python of ROS 2
(ament_python) has them as entry points in setup.py, from which colcon would make files; they are
found there.

A build of catkin or colcon puts programs into a devel or install space, which is searched after
the package itself.

The index searches its folders in order, and the first package of a name wins, as in ``rospack``.
Nothing is read before it is needed.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from pathlib import Path

import msgspec

from rosz.errors import ExecutableNotFound, NotFoundError, PackageError, PackageNotFound, near_miss

MANIFEST = "package.xml"
ROSBUILD_MANIFEST = "manifest.xml"
"""The file of rosbuild's packages, which have the names of their folders."""
_IGNORE_MARKERS = frozenset({"CATKIN_IGNORE", "COLCON_IGNORE", "AMENT_IGNORE", "rospack_nosubdirs"})
_NO_CODE = frozenset({"__pycache__", "node_modules"})
_SOURCES = "src"
_SPACES = ("devel", "devel_isolated", "install", "install_isolated")
"""Folders beside a workspace's sources that builds write to."""
SYSTEM = Path("/usr/share")
"""Where Debian has its packages, side by side with those that are none of ROS."""
# Linux looks for the interpreter in as many bytes of a script (BINPRM_BUF_SIZE).
_SHEBANG_BYTES = 256
_MAX_TEXT = 10_000
"""Length in characters of the text of a variable in a setup.py; expressions may repeat it."""
_COMMENT = re.compile(r"#.*")
_INSTALLED = re.compile(
    r"\bcatkin_install_python\s*\(\s*PROGRAMS\b(.*?)\bDESTINATION\b", re.DOTALL | re.IGNORECASE
)


class Package(msgspec.Struct, frozen=True):
    """A package.

    Attributes:
        name: Name in its package.xml.
        path: Folder of the package.
        prefixes: Devel and install spaces that may have its programs, besides those of its own
            workspace.
    """

    name: str
    path: Path
    prefixes: tuple[Path, ...] = ()

    def _folders(self) -> Iterator[Path]:
        """Yield the folders of files: its own, and those of programs that builds put elsewhere."""
        if self.path.parent.name == "share":
            yield from self._programs_in(self.path.parent.parent)
        yield self.path
        for prefix in (*self.prefixes, *self._spaces()):
            yield from self._programs_in(prefix)

    def _spaces(self) -> Iterator[Path]:
        """Yield the spaces of its workspace, and its own in those where each package has one."""
        for folder in self.path.parents:
            if folder.name == _SOURCES:
                for space in _SPACES:
                    yield folder.parent / space
                    yield folder.parent / space / self.name

    def _programs_in(self, prefix: Path) -> list[Path]:
        folders = [prefix / kind / self.name for kind in ("lib", "libexec")]
        return [folder for folder in folders if folder.is_dir()]

    def _files(self) -> Iterator[Path]:
        for top in self._folders():
            for folder, names, files in os.walk(top):
                names[:] = sorted(n for n in names if not n.startswith(".") and n not in _NO_CODE)
                for file in sorted(files):
                    yield Path(folder, file)

    def executables(self) -> list[str]:
        """Return the names of all executable files and entry points of the package, sorted."""
        files = {file.name for file in self._files() if _is_executable(file)}
        files |= {file.name for file in self.installed_scripts()}
        return sorted(files | self._entry_points().keys())

    def installed_scripts(self) -> list[Path]:
        """Return the scripts of ``catkin_install_python``, which need not be executable."""
        try:
            text = (self.path / "CMakeLists.txt").read_text("utf-8", "replace")
        except OSError:
            return []
        listed = " ".join(_INSTALLED.findall(_COMMENT.sub("", text))).replace('"', " ").split()
        here = [word.replace("${PROJECT_SOURCE_DIR}/", "") for word in listed]
        files = [self.path / word.replace("${CMAKE_CURRENT_SOURCE_DIR}/", "") for word in here]
        return [file for file in files if file.is_file()]

    def files(self, name: str) -> list[Path]:
        """Return all files of a name in the package."""
        return [file for file in self._files() if file.name == name]

    def executable(self, name: str) -> Path:
        """Return an executable file by its name, from anywhere in the package, as rosrun does.

        An entry point is the path of its module and the name of its function, with a colon between.

        Raises:
            ExecutableNotFound: There is none, or the file is not executable.
        """
        files = self.files(name)
        scripts = self.installed_scripts() if files else []
        for file in files:
            if _is_executable(file) or file in scripts:
                return file
        entry = self._entry_points().get(name)
        if entry is not None:
            return self._module_of(name, entry)
        if files:
            raise ExecutableNotFound(
                f"'{files[0]}' of package '{self.name}' is not executable; run: chmod +x {files[0]}"
            )
        executables = self.executables()
        listing = f"; it has {', '.join(executables[:8]) or 'no executables'}"
        sources = [file.name for file in self._files() if file.suffix == ".py"]
        hint = near_miss(name, executables) or near_miss(name, sources) or listing
        raise ExecutableNotFound(
            f"package '{self.name}' ({self.path}) has no executable '{name}'{hint}"
        )

    def _entry_points(self) -> dict[str, str]:
        """Return the entry points in setup.py, such as ``talker`` for ``demo.talker:main``."""
        try:
            source = (self.path / "setup.py").read_bytes()
        except OSError:
            return {}
        try:
            return _console_scripts(source)
        except (SyntaxError, ValueError, RecursionError):  # 'rosz pkg check' reports it
            return {}

    def _module_of(self, name: str, entry: str) -> Path:
        """Return the path of an entry point, with its function."""
        module, _, function = entry.partition(":")
        relative = module.strip().replace(".", "/")
        for folder in (self.path, self.path / "src"):
            for file in (f"{relative}.py", f"{relative}/__init__.py"):
                if (folder / file).is_file():
                    return folder / f"{file}:{function.strip() or 'main'}"
        raise ExecutableNotFound(
            f"setup.py of package '{self.name}' says that '{name}' is '{entry}', but there is no"
            f" {self.path / relative}.py"
        )

    def within(self, name: str) -> Path:
        """Return a path in the package, given relative to the package's folder.

        Raises:
            NotFoundError: The path leads out of the package.
        """
        path = Path(os.path.normpath(self.path / name))
        if not path.is_relative_to(os.path.normpath(self.path)):
            raise NotFoundError(
                f"'{name}' leads out of package '{self.name}' ({self.path}); expected a file in it"
            )
        return path

    def file(self, name: str) -> Path:
        """Return a file by its name, from anywhere in the package, as ``roslaunch`` does.

        A program of that name counts only where no other file has it.

        Raises:
            NotFoundError: There is none or several, or the path leads out of the package.
        """
        direct = self.within(name)
        files = dict.fromkeys([*([direct] if direct.is_file() else []), *self.files(name)])
        plain = [file for file in files if not _is_executable(file)] or list(files)
        if len(plain) > 1:
            listing = ", ".join(map(str, plain))
            raise NotFoundError(
                f"package '{self.name}' has {len(plain)} files named '{name}': {listing}; give the"
                " path of one"
            )
        if plain:
            return plain[0]
        kin = [file.name for file in self._files() if file.suffix == Path(name).suffix]
        raise NotFoundError(
            f"package '{self.name}' ({self.path}) has no file '{name}'{near_miss(name, kin)}"
        )


def _console_scripts(source: bytes) -> dict[str, str]:
    """Return the console scripts in the text of a setup.py.

    Raises:
        SyntaxError: It is not Python.
        ValueError: It has a null byte.
        RecursionError: An expression is nested too deep.
    """
    import ast  # slow to load, and rarely needed

    names: dict[str, str] = {}

    def text_of(node: ast.AST) -> str:
        """Return the text of an expression with ``+`` and f-strings; lists have lines."""
        if isinstance(node, ast.Constant | ast.Name):
            return names.get(node.id, "") if isinstance(node, ast.Name) else str(node.value)
        glue = "\n" if isinstance(node, ast.List | ast.Tuple) else ""
        return glue.join(map(text_of, ast.iter_child_nodes(node)))

    tree = ast.parse(source)
    for node in tree.body:
        if isinstance(node, ast.Assign):
            names[ast.unparse(node.targets[0])] = text_of(node.value)[:_MAX_TEXT]
    listed = [
        text
        for node in ast.walk(tree)
        if isinstance(node, ast.Dict)
        for key, value in zip(node.keys, node.values, strict=True)
        if isinstance(key, ast.Constant) and key.value == "console_scripts"
        for text in text_of(value).split("\n")
        if "=" in text
    ]
    pairs = (text.partition("=") for text in listed)
    return {name.strip(): entry.strip() for name, _, entry in pairs}


class PackageIndex:
    """The packages in a list of folders.

    Args:
        roots: Folders that are packages or hold some at any depth, earlier ones first; or a
            function that returns them when they are needed.
        prefixes: Devel and install spaces that may have programs of the packages.
        later: Folders whose packages are found by the names of their own folders, if no other one
            has the name, as those of Debian.
    """

    def __init__(
        self,
        roots: Sequence[Path] | Callable[[], Sequence[Path]],
        *,
        prefixes: Sequence[Path] = (),
        later: Sequence[Path] = (),
    ) -> None:
        self._given = roots
        self._prefixes = tuple(prefixes)
        self._later = tuple(later)

    @cached_property
    def roots(self) -> tuple[Path, ...]:
        """The folders that are searched."""
        return tuple(self._given() if callable(self._given) else self._given)

    @property
    def _known(self) -> dict[str, Package]:
        return self._crawled[0]

    @property
    def broken(self) -> list[PackageError]:
        """The error of each package.xml that cannot be read."""
        return self._crawled[1]

    @cached_property
    def _crawled(self) -> tuple[dict[str, Package], list[PackageError]]:
        packages: dict[str, Package] = {}
        broken: list[PackageError] = []
        for root in self.roots:
            # Of two packages of one name, the one nearer to the root wins.
            for folder in sorted(crawl(root), key=lambda folder: len(folder.parts)):
                try:
                    package = Package(_name_of(folder), folder, self._prefixes)
                except PackageError as error:
                    # A package that cannot be read does not hide the others, as in rospack.
                    broken.append(error)
                else:
                    packages.setdefault(package.name, package)
        return packages, broken

    def find(self, name: str) -> Package:
        """Return the package of a name.

        Raises:
            PackageNotFound: No folder has such a package.
            PackageError: The package.xml in a folder of that name cannot be read.
        """
        if "_crawled" not in self.__dict__ and self.roots:
            # This saves searching all folders.
            quick = self._in(self.roots[0], name)
            if quick is not None:
                return quick
        if name in self._known:
            return self._known[name]
        for error in self.broken:
            if Path(error.path).parent.name == name:
                raise error
        for root in self._later:
            installed = self._in(root, name)
            if installed is not None:
                return installed
        raise PackageNotFound(name, self._known, [str(root) for root in self.roots])

    def _in(self, root: Path, name: str) -> Package | None:
        """Return a package directly in a folder, if its own folder has its name."""
        if not name or "/" in name:
            return None
        folder = root / name
        if manifest_of(folder) is not None and _name_of(folder) == name:
            return Package(name, folder, self._prefixes)
        return None

    def names(self) -> list[str]:
        """Return the names of all packages but the later ones, sorted."""
        return sorted(self._known)

    def packages(self) -> list[Package]:
        """Return all packages but the later ones, sorted by name."""
        return [self._known[name] for name in self.names()]


def _is_executable(file: Path) -> bool:
    return file.is_file() and os.access(file, os.X_OK)


def is_python(program: Path) -> bool:
    """Return whether a program is a Python script, by its suffix or its first line."""
    if program.suffix == ".py" or ".py:" in program.name:  # an entry point has its function there
        return True
    try:
        with program.open("rb") as file:
            first = file.readline(_SHEBANG_BYTES)
    except OSError:  # executable but not readable, so not a script
        return False
    return first.startswith(b"#!") and b"python" in first


def start_words(program: Path) -> tuple[str, ...]:
    """Return the words that start a program: rosz's interpreter first if it is a Python script.

    Such a script can import ROS 1's modules.
    """
    # -P keeps modules in the working folder from hiding Python's own.
    own = (sys.executable, "-P", "-m", "rosz.script") if is_python(program) else ()
    return (*own, str(program))


def manifest_of(folder: Path) -> Path | None:
    """Return the file that makes a folder a package, or None if it is none."""
    for name in (MANIFEST, ROSBUILD_MANIFEST):
        if (folder / name).is_file():
            return folder / name
    return None


def crawl(root: Path) -> Iterator[Path]:
    """Yield the folders that are packages; packages are not searched for further ones."""
    for folder, names, files in os.walk(root, followlinks=True):
        if MANIFEST in files or ROSBUILD_MANIFEST in files:
            names.clear()
            if not _IGNORE_MARKERS & set(files):
                yield Path(folder)
        elif _IGNORE_MARKERS & set(files) or Path(folder).parent == SYSTEM:
            names.clear()
        names[:] = sorted(n for n in names if not n.startswith(".") and n not in _NO_CODE)


def _name_of(folder: Path) -> str:
    if manifest_of(folder) == folder / ROSBUILD_MANIFEST:
        return folder.name
    top = parse_manifest(folder / MANIFEST)
    name = "".join(tag.text for tag in top.all("name")).strip()
    if top.name != "package" or not name:
        reason = "expected <package> with a <name> in it"
        raise PackageError(reason, str(folder / MANIFEST))
    return name


class ManifestTag(msgspec.Struct):
    """A tag of a manifest.

    Attributes:
        name: Name of the tag.
        attributes: Its attributes.
        line: 1-based line.
        column: 1-based column.
        text: Text in it and in the tags in it.
        tags: The tags in it.
    """

    name: str
    attributes: dict[str, str]
    line: int
    column: int
    text: str = ""
    tags: list[ManifestTag] = []

    def all(self, name: str) -> list[ManifestTag]:
        """Return the tags of a name in it."""
        return [tag for tag in self.tags if tag.name == name]


def parse_manifest(file: Path) -> ManifestTag:
    """Return the outermost tag of a package.xml or manifest.xml.

    Raises:
        PackageError: The file cannot be read, or is not well-formed.
    """
    # Expat itself, since an import hook looks for packages here: libraries that are built on expat
    # import modules that may be loading just now.
    from xml.parsers import expat

    parser = expat.ParserCreate()
    parser.buffer_text = True
    opened = [ManifestTag("", {}, 0, 0)]

    def start(name: str, attributes: dict[str, str]) -> None:
        place = parser.CurrentLineNumber, parser.CurrentColumnNumber + 1
        tag = ManifestTag(name, attributes, *place)
        opened[-1].tags.append(tag)
        opened.append(tag)

    def read(text: str) -> None:
        for tag in opened:
            tag.text += text

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: opened.pop()
    parser.CharacterDataHandler = read
    try:
        parser.Parse(file.read_bytes(), True)
    except expat.ExpatError as error:
        reason = f"not well-formed XML: {expat.ErrorString(error.code)}"
        raise PackageError(reason, str(file), error.lineno, error.offset + 1) from error
    except OSError as error:
        raise PackageError(f"cannot be read: {error.strerror}", str(file)) from error
    return opened[0].tags[0]
