"""Check packages: find them, run all checks, and check package.xml and interface definitions."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import msgspec

from rosz.environment import Environment, package_index
from rosz.errors import DefinitionError, NotFoundError, PackageError, RoszError
from rosz.idl import Catalog, Definition, read_definition
from rosz.packages import (
    MANIFEST,
    ManifestTag,
    Package,
    PackageIndex,
    crawl,
    manifest_of,
    parse_manifest,
)
from rosz.typestore import TypeStore
from rosz.workspace.problem import REMEDY, Problem, error, from_error, warning
from rosz.workspace.programs import (
    check_cmake,
    check_configs,
    check_entry_points,
    check_launches,
    check_scripts,
)

_KINDS = ("msg", "srv", "action")
_NAME = re.compile(r"[a-z][a-z0-9_-]*", re.ASCII)
_VERSION = re.compile(r"\d+\.\d+\.\d+", re.ASCII)
_REQUIRED = ("name", "version", "description", "maintainer", "license")
_ONCE = ("name", "version", "description")
_FORMATS = ("1", "2", "3")
_SINCE_2 = frozenset({"depend", "build_export_depend", "exec_depend", "doc_depend"})
_ONLY_1 = frozenset({"run_depend"})


class Checked(msgspec.Struct, frozen=True):
    """The result of the check of one package.

    Attributes:
        name: Name of the package, or of its folder if package.xml cannot be read.
        path: Folder of the package.
        problems: Problems sorted by place.
    """

    name: str
    path: str
    problems: list[Problem]


def check(
    folders: Sequence[Path], environment: Environment, environ: Mapping[str, str]
) -> Iterator[Checked]:
    """Check packages, and yield each result as soon as it is known.

    Args:
        folders: Folders of the packages.
        environment: Settings, with the path of other packages.
        environ: Environment variables for launch files and .cfg files.
    """
    # The value is None if the package.xml cannot be read.
    packages = {folder: next(iter(PackageIndex([folder]).packages()), None) for folder in folders}
    readable = [package for package in packages.values() if package is not None]
    roots = [package.path for package in readable]
    index = PackageIndex([*roots, *package_index(environment).roots])
    catalog = Catalog(TypeStore(index, environment.home / "rosz").definition)
    variables = {**environ, "ROSZ_PACKAGE_PATH": ":".join(str(root) for root in index.roots)}
    name_problems = _same_names(readable)
    for folder, package in packages.items():
        problems = [*_check_manifest(folder), *name_problems.get(folder, ())]
        problems += check_scripts(folder)
        problems += check_cmake(package or Package(folder.name, folder))
        if package is not None:
            problems += check_entry_points(package)
            problems += _check_definitions(folder, package.name, catalog)
            problems += check_launches(folder, index, variables)
            erroneous = {problem.path for problem in problems if problem.level == "error"}
            problems += check_configs(folder, variables, erroneous)
        name = folder.name if package is None else package.name
        yield Checked(name, str(folder), sorted(set(_each_remedy_once(problems))))


def _each_remedy_once(problems: Iterable[Problem]) -> Iterator[Problem]:
    """Yield problems; of those that the same command fixes, yield only the first."""
    shown: set[str] = set()
    for problem in problems:
        _, _, command = problem.text.partition(REMEDY)
        if not command or command not in shown:
            yield problem
        shown.add(command)


def _same_names(packages: Sequence[Package]) -> dict[Path, list[Problem]]:
    """Return, for each folder, an error for every other package of the same name."""
    by_name: defaultdict[str, list[Path]] = defaultdict(list)
    for package in packages:
        by_name[package.name].append(package.path)
    return {
        path: [
            error(path / MANIFEST, f"another package is also called '{name}': {other}")
            for other in paths
            if other != path
        ]
        for name, paths in by_name.items()
        for path in paths
    }


def _check_manifest(folder: Path) -> Iterator[Problem]:
    """Yield the problems of the package.xml of a package (REP 127, REP 140, REP 149)."""
    path = folder / MANIFEST
    try:
        root = parse_manifest(path)
    except PackageError as fault:
        yield from_error(fault, path)
        return
    if root.name != "package":
        yield error(path, f"expected <package>, got <{root.name}>", root.line, root.column)
        return
    yield from _check_tags(path, root)
    for tag in root.tags:
        yield from _check_value(path, folder, tag)


def _check_tags(path: Path, root: ManifestTag) -> Iterator[Problem]:
    """Yield the problems of tags: missing, repeated, or not part of the format."""
    counts = Counter(tag.name for tag in root.tags)
    for name in _REQUIRED:
        if not counts[name]:
            # rospack and rosz need only the name of a package; catkin requires all of them.
            make = error if name == "name" else warning
            yield make(path, f"<{name}> is missing", root.line, root.column)
    for name in _ONCE:
        if counts[name] > 1:
            second = root.all(name)[1]
            text = f"<{name}> is there {counts[name]} times"
            yield error(path, text, second.line, second.column)
    form = root.attributes.get("format", "1")
    if form not in _FORMATS:
        text = f"format is '{form}'; expected one of {', '.join(_FORMATS)}"
        yield error(path, text, root.line, root.column)
    for tag in root.tags:
        if tag.name in (_SINCE_2 if form == "1" else _ONLY_1):
            hint = (
                'write <package format="2">' if form == "1" else "write <exec_depend>, or <depend>"
            )
            text = f"<{tag.name}> does not exist in format {form}: {hint}"
            yield warning(path, text, tag.line, tag.column)


def _check_value(path: Path, folder: Path, tag: ManifestTag) -> Iterator[Problem]:
    text = tag.text.strip()
    if tag.name in {*_REQUIRED, *_SINCE_2, *_ONLY_1} and not text:
        yield error(path, f"<{tag.name}> is empty", tag.line, tag.column)
    elif tag.name == "name":
        if not _NAME.fullmatch(text):
            reason = f"'{text}' is not a good name: use lower-case letters, digits and '_'"
            yield warning(path, reason, tag.line, tag.column)
        if text != folder.name:
            reason = f"the package is called '{text}', its folder '{folder.name}'"
            yield warning(path, reason, tag.line, tag.column)
    elif tag.name == "version" and not _VERSION.fullmatch(text):
        reason = f"version is '{text}'; expected three numbers such as 0.1.0"
        yield warning(path, reason, tag.line, tag.column)
    elif tag.name == "maintainer" and "@" not in tag.attributes.get("email", ""):
        yield warning(path, "<maintainer> has no email address", tag.line, tag.column)


def _check_definitions(folder: Path, package: str, catalog: Catalog) -> Iterator[Problem]:
    for kind in _KINDS:
        for file in sorted((folder / kind).glob(f"*.{kind}")):
            name = f"{package}/{kind}/{file.stem}"
            try:
                definition = read_definition(file)
            except RoszError as fault:
                yield from_error(fault, file)
            else:
                yield from _check_definition(name, definition, catalog)


def _check_definition(name: str, definition: Definition, catalog: Catalog) -> Iterator[Problem]:
    """Yield the problems of a definition; each wrong line is removed to find the next problem."""
    kind = name.split("/")[1]
    lines = definition.text.split("\n")
    while True:
        readers = {"msg": catalog.message, "srv": catalog.service, "action": catalog.action}
        try:
            readers[kind](name)
        except RoszError as fault:
            yield from_error(fault, Path(definition.path))
            if not isinstance(fault, DefinitionError) or fault.path != definition.path:
                return
            if not fault.line or not lines[fault.line - 1]:
                return
            lines[fault.line - 1] = ""
            definition = Definition("\n".join(lines), definition.path)
            catalog = catalog.with_definition(name, definition)
        else:
            return


def find_packages(words: Sequence[str], cwd: Path, index: PackageIndex) -> list[Path]:
    """Return the folders of packages, sorted and without duplicates.

    Args:
        words: Folders that are or contain packages, or names of packages; empty for all packages
            of the workspace around the current folder.
        cwd: Current folder.
        index: All known packages.

    Raises:
        NotFoundError: A package does not exist, a word is a file, or no package is found.
    """
    folders = sorted({folder.resolve() for folder in _folders(words, cwd, index)})
    if not folders:
        where = ", ".join(words) or f"the workspace around {cwd}"
        raise NotFoundError(
            f"no package in {where}: expected folders with a {MANIFEST} below src; make one with"
            " 'rosz pkg create NAME'"
        )
    return folders


def _folders(words: Sequence[str], cwd: Path, index: PackageIndex) -> Iterator[Path]:
    if not words:
        for root in Environment.read({}, cwd).package_roots:
            yield from crawl(root)
    for word in words:
        path = cwd / word
        if path.is_file():
            raise NotFoundError(f"'{word}' is a file; expected a package or a folder")
        if path.is_dir():
            sources = path / "src" if (path / "src").is_dir() else path
            yield from crawl(path if manifest_of(path) is not None else sources)
        else:
            yield index.find(word).path
