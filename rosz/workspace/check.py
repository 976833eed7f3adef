"""All checks over some packages."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import msgspec

from rosz.environment import Environment, package_index
from rosz.idl import Catalog
from rosz.packages import MANIFEST, Package, PackageIndex
from rosz.typestore import TypeStore
from rosz.workspace.configs import check_configs
from rosz.workspace.definitions import check_definitions
from rosz.workspace.launches import check_launches
from rosz.workspace.manifest import check_manifest
from rosz.workspace.problem import REMEDY, Problem, error
from rosz.workspace.scripts import check_cmake, check_scripts

__all__ = ("Checked", "check")


class Checked(msgspec.Struct, frozen=True):
    """A package that was checked.

    Attributes:
        name: Its name, or that of its folder where it tells none.
        path: Its folder.
        problems: What is wrong, sorted by place.
    """

    name: str
    path: str
    problems: list[Problem]


def check(
    folders: Sequence[Path], environment: Environment, environ: Mapping[str, str]
) -> Iterator[Checked]:
    """Check packages, and yield each as it is done.

    Args:
        folders: The packages.
        environment: Settings; says where other packages are.
        environ: Variables, for launch files and .cfg files.
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
            problems += check_definitions(folder, package.name, catalog)
            problems += check_launches(folder, index, variables)
            if not problems or all(one.level == "warning" for one in problems):
                problems += check_configs(folder, variables)
        name = folder.name if package is None else package.name
        yield Checked(name, str(folder), sorted(set(_each_remedy_once(problems))))


def _each_remedy_once(problems: Iterable[Problem]) -> Iterator[Problem]:
    """Leave out what is mended by a command that has been told: a script that many nodes start."""
    told: set[str] = set()
    for problem in problems:
        _, _, command = problem.text.partition(REMEDY)
        if not command or command not in told:
            yield problem
        told.add(command)


def _package(folder: Path) -> Package | None:
    """Return the package in a folder; none if its package.xml cannot be read, which is told."""
    found = PackageIndex([folder]).packages()
    return found[0] if found else None


def _same_names(packages: Sequence[Package]) -> dict[Path, list[Problem]]:
    """Return, for each package that has the name of another one, that it does."""
    by_name: defaultdict[str, list[Path]] = defaultdict(list)
    for package in packages:
        by_name[package.name].append(package.path)
    return {
        path: [
            error(path / MANIFEST, f"another package is called '{name}', too: {other}")
            for other in paths
            if other != path
        ]
        for name, paths in by_name.items()
        for path in paths
    }
