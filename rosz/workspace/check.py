"""Check packages: find them, run all checks, and check their interface definitions."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import msgspec

from rosz.environment import Environment, package_index
from rosz.errors import DefinitionError, NotFoundError, RoszError
from rosz.idl import Catalog, Definition, read_definition
from rosz.packages import MANIFEST, Package, PackageIndex, crawl, manifest_of
from rosz.typestore import TypeStore
from rosz.workspace.manifest import check_manifest
from rosz.workspace.problem import REMEDY, Problem, error, from_error
from rosz.workspace.programs import (
    check_cmake,
    check_configs,
    check_entry_points,
    check_launches,
    check_scripts,
)

__all__ = ("Checked", "check", "find_packages")


_KINDS = ("msg", "srv", "action")


class Checked(msgspec.Struct, frozen=True):
    """A package that was checked.

    Attributes:
        name: Name of the package, or of its folder if package.xml has none.
        path: Folder of the package.
        problems: Problems sorted by place.
    """

    name: str
    path: str
    problems: list[Problem]


def check(
    folders: Sequence[Path], environment: Environment, environ: Mapping[str, str]
) -> Iterator[Checked]:
    """Check packages, and yield the result of each as soon as it is known.

    Args:
        folders: Folders of the packages.
        environment: Settings, with the path of other packages.
        environ: Environment variables for launch files and .cfg files.
    """
    packages = {folder: _package(folder) for folder in folders}
    good = [package.path for package in packages.values() if package is not None]
    index = PackageIndex([*good, *package_index(environment).roots])
    catalog = Catalog(TypeStore(index, environment.home / "rosz").definition)
    variables = {**environ, "ROSZ_PACKAGE_PATH": ":".join(str(root) for root in index.roots)}
    twice = _same_names([package for package in packages.values() if package is not None])
    for folder, package in packages.items():
        problems = [*check_manifest(folder), *twice.get(folder, ())]
        problems += check_scripts(folder)
        problems += check_cmake(folder)
        if package is not None:
            problems += check_entry_points(package)
            problems += _check_definitions(folder, package.name, catalog)
            problems += check_launches(folder, index, variables)
            wrong = {one.path for one in problems if one.level == "error"}
            problems += check_configs(folder, variables, wrong)
        name = folder.name if package is None else package.name
        yield Checked(name, str(folder), sorted(set(_each_remedy_once(problems))))


def _each_remedy_once(problems: Iterable[Problem]) -> Iterator[Problem]:
    """Yield problems, but each command that fixes one only once, as for a script of many nodes."""
    shown: set[str] = set()
    for problem in problems:
        _, _, command = problem.text.partition(REMEDY)
        if not command or command not in shown:
            yield problem
        shown.add(command)


def _package(folder: Path) -> Package | None:
    """Return the package in a folder, or None if its package.xml cannot be read."""
    found = PackageIndex([folder]).packages()
    return found[0] if found else None


def _same_names(packages: Sequence[Package]) -> dict[Path, list[Problem]]:
    """Return the problems of packages that have the same name, by folder."""
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


def _check_definitions(folder: Path, package: str, catalog: Catalog) -> Iterator[Problem]:
    """Yield the problems of the interface definitions of a package."""
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
    """Yield the problems of a definition: after each one, it is read without the wrong line."""
    lines = definition.text.split("\n")
    while True:
        try:
            _read_definition(name, catalog)
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


def _read_definition(name: str, catalog: Catalog) -> None:
    kind = name.split("/")[1]
    read = {"msg": catalog.message, "srv": catalog.service, "action": catalog.action}
    read[kind](name)


def find_packages(words: Sequence[str], cwd: Path, index: PackageIndex) -> list[Path]:
    """Return the folders of packages, sorted, each once.

    Args:
        words: Folders that are or contain packages, or names of packages. Without any, all packages
            of the workspace around the current folder.
        cwd: Current folder.
        index: All known packages.

    Raises:
        NotFoundError: If there is no such package, or no package at all.
    """
    found = sorted({folder.resolve() for folder in _folders(words, cwd, index)})
    if not found:
        where = ", ".join(words) or f"the workspace around {cwd}"
        raise NotFoundError(
            f"no package in {where}: expected folders with a {MANIFEST} below src; make one with"
            " 'rosz pkg create NAME'"
        )
    return found


def _folders(words: Sequence[str], cwd: Path, index: PackageIndex) -> Iterator[Path]:
    if not words:
        for root in Environment.read({}, cwd).package_roots:
            yield from crawl(root)
    for word in words:
        path = cwd / word
        if path.is_file():
            raise NotFoundError(f"'{word}' is a file; expected a package or a folder")
        if path.is_dir():
            inside = path / "src" if (path / "src").is_dir() else path
            yield from crawl(path if manifest_of(path) is not None else inside)
        else:
            yield index.find(word).path
