"""Writes stubs by which editors and type checkers know ROS 1's names.

A folder in the user's cache has each name that scripts can import: stubs that name rosz's own
modules, generated modules of the messages of the workspace, and links to the Python modules that
packages offer. Nothing is written into packages.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path

import msgspec

from rosz.environment import Environment, package_index
from rosz.errors import RoszError
from rosz.packages import PackageIndex
from rosz.ros1.modules import MODULES, home_of
from rosz.ros1.python_setup import Offers, is_module
from rosz.typestore import Kind, TypeStore, shipped_packages, shipped_types

_SOURCE = Path(__file__).parents[1]
_KINDS: tuple[Kind, ...] = ("msg", "srv", "action")
_HEAD = "# Written by rosz env --editor; do not edit.\n"


class Stubs(msgspec.Struct, frozen=True):
    """The stubs that were written.

    Attributes:
        folder: The folder, for the path of editors and type checkers.
        modules: Number of modules that can be imported from there, without those inside others.
        faults: Packages whose types have a mistake, with the reason; they have no stubs.
    """

    folder: str
    modules: int
    faults: dict[str, str]


def editor_folder(environment: Environment) -> Path:
    """Return the folder that `write_stubs` writes."""
    return environment.home / "rosz" / "editor"


def write_stubs(environment: Environment) -> Stubs:
    """Write the names of ROS 1 and of all packages on the path, and remove those that are gone."""
    folder = editor_folder(environment)
    index = package_index(environment)
    faults: dict[str, str] = {}
    files: dict[str, str] = {}
    # Packages such as tf have both messages and modules: the texts of a file are joined.
    for path, text in (*_of_shipped(), *_of_packages(index, faults), *_of_rosz()):
        files[path] = files.get(path, "") + text
    links = dict(_of_offers(index, environment))
    for path in links:
        top = path.split("/")[0]
        files.pop(f"{top}/__init__.py", None)
    _write(folder, files, links)
    names = {path.partition("/")[0].removesuffix(".py") for path in (*files, *links)}
    return Stubs(str(folder), len(names), faults)


def _of_rosz() -> Iterator[tuple[str, str]]:
    """Yield a stub for each ROS 1 and rclpy module that rosz has."""
    built = {
        name: "".join(_imports(home, names) for home, names in module.names.items())
        for name, module in MODULES.items()
        if not module.home
    }
    real = {
        name: text
        for root, module in MODULES.items()
        if module.home
        for name, text in _modules_of(root, module.home)
    }
    whole = {**real, **{name: text + real.get(name, "") for name, text in built.items()}}
    parents = {name.rpartition(".")[0] for name in whole if "." in name}
    for name in sorted({*whole, *parents}):
        parts = [each.rpartition(".") for each in sorted(whole)]
        inside = [last for parent, _, last in parts if parent == name]
        text = whole.get(name, "") + "".join(f"from . import {last} as {last}\n" for last in inside)
        path = name.replace(".", "/")
        yield (f"{path}/__init__.py" if inside else f"{path}.py"), text


def _imports(home: str, names: str) -> str:
    """Return the statements that import names of the importer's table from a module."""
    imported = (
        "*" if public == "*" else f"{own or public} as {public}"
        for public, _, own in (each.partition("=") for each in names.split())
    )
    return "".join(f"from {home_of(home)} import {each}\n" for each in imported)


def _modules_of(root: str, own: str) -> Iterator[tuple[str, str]]:
    """Yield the modules of rosz that have a name of ROS 1, with their stubs."""
    place = _SOURCE / own.replace(".", "/")
    files = sorted(place.rglob("*.py")) if place.is_dir() else [place.with_suffix(".py")]
    for file in files:
        parts = file.relative_to(_SOURCE).with_suffix("").parts
        if parts[-1] == "__init__":
            parts = parts[:-1]
        elif parts[-1].startswith("_"):
            continue
        home = ".".join(parts)
        yield root + home[len(own) :], f"from rosz.{home} import *\n"


def _of_shipped() -> Iterator[tuple[str, str]]:
    for package in shipped_packages():
        kinds = [kind for kind in _KINDS if shipped_types(package, kind)]
        yield f"{package}/__init__.py", _importing(kinds)
        for kind in kinds:
            yield f"{package}/{kind}.py", f"from rosz.msgs.{package}.{kind} import *\n"


def _of_packages(index: PackageIndex, faults: dict[str, str]) -> Iterator[tuple[str, str]]:
    """Yield the generated modules of packages that rosz does not ship."""
    store = TypeStore(index)
    shipped = {*shipped_packages()}
    for package in index.packages():
        if package.name in shipped or not any(store.has(package.name, kind) for kind in _KINDS):
            continue
        try:
            sources = store.sources([package.name])[package.name]
        except RoszError as fault:
            faults[package.name] = str(fault)
            continue
        kinds = [kind for kind in _KINDS if f"{kind}.py" in sources]
        yield f"{package.name}/__init__.py", _importing(kinds)
        for kind in kinds:
            yield f"{package.name}/{kind}.py", sources[f"{kind}.py"]


def _importing(kinds: list[Kind]) -> str:
    return "".join(f"from . import {kind} as {kind}\n" for kind in kinds)


def _of_offers(index: PackageIndex, environment: Environment) -> Iterator[tuple[str, Path]]:
    provided = {*MODULES, *shipped_packages()}
    offers = Offers(index, environment.home / "rosz" / "modules.json")
    for name in sorted({*offers.names()} - provided):
        path = offers.find(name)
        if path is None:
            continue
        if path.suffix == ".py":
            yield f"{name}.py", path
            continue
        for inner in sorted(path.iterdir()):
            if inner.suffix in {".py", ".pyi"} or (inner.is_dir() and is_module(inner)):
                yield f"{name}/{inner.name}", inner


def _clean(folder: Path, written: set[Path], linked: set[Path]) -> None:
    """Remove the files and links of a folder that are not wanted, and empty folders."""
    for parent, inside, names in os.walk(folder, topdown=False):
        # A link to a folder is removed; the folder itself belongs to the user.
        for name in (*names, *inside):
            path = Path(parent, name)
            if path.is_symlink():
                if path not in linked:
                    path.unlink()
            elif path.is_dir():
                with suppress(OSError):  # it has something in it
                    path.rmdir()
            elif path not in written:
                path.unlink()


def _write(folder: Path, files: Mapping[str, str], links: Mapping[str, Path]) -> None:
    """Write the files and links of a folder, and remove all others."""
    folder.mkdir(parents=True, exist_ok=True)
    _clean(folder, {folder / path for path in files}, {folder / path for path in links})
    for name, text in files.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        if not file.is_file() or file.read_text("utf-8") != _HEAD + text:
            file.write_text(_HEAD + text, encoding="utf-8")
    for name, target in links.items():
        link = folder / name
        link.parent.mkdir(parents=True, exist_ok=True)
        if not link.is_symlink() or link.readlink() != target:
            link.unlink(missing_ok=True)
            link.symlink_to(target)
