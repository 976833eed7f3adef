"""Interfaces and packages."""

from __future__ import annotations

import re
import sys
from argparse import Namespace
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from rosz.cli.console import print_lines
from rosz.cli.ros2.graph import CommandFailed
from rosz.environment import Environment, package_index
from rosz.errors import PackageNotFound, RoszError

if TYPE_CHECKING:
    from rosz.packages import Package, PackageIndex
    from rosz.typestore import Kind, TypeStore

_KINDS: dict[Kind, tuple[str, str]] = {
    "msg": ("Messages", "only_msgs"),
    "srv": ("Services", "only_srvs"),
    "action": ("Actions", "only_actions"),
}
_FIELD = re.compile(
    r"\s*([A-Za-z]\w*(?:/\w+)*)(?:<=\d+)?(?:\[[^]]*\])?\s+[A-Za-z]\w*\s*(?:[^=\s]|$)"
)
_COMMENT = re.compile(r"""^((?:[^#"']|"[^"]*"|'[^']*')*)#.*$""")
_PARTS = 3
_PACKAGE_NOT_FOUND = "Package not found"


@cache
def _packages() -> PackageIndex:
    return package_index(Environment.read())


@cache
def _types() -> TypeStore:
    from rosz.typestore import TypeStore

    return TypeStore(_packages(), Environment.read().home / "rosz")


def _chosen(given: Namespace) -> list[Kind]:
    """Return the kinds that options name, or all."""
    return [kind for kind, (_, option) in _KINDS.items() if getattr(given, option)] or [*_KINDS]


def _full(name: str, kind: Kind) -> str:
    return name.replace("/", f"/{kind}/")


def list_interfaces(given: Namespace) -> None:
    """List the types of all packages."""
    for kind in _chosen(given):
        print_lines([f"{_KINDS[kind][0]}:"])
        print_lines(f"    {_full(name, kind)}" for name in _types().names(kind))


def interfaces_of(given: Namespace) -> str | None:
    """List the types of a package."""
    if given.package not in {*_packages().names(), *_types().packages()}:
        return f"Unknown package '{given.package}'"
    for kind in _chosen(given):
        if _types().has(given.package, kind):
            print_lines(_full(name, kind) for name in _types().names(kind, given.package))
    return None


def interface_packages(given: Namespace) -> None:
    """List the packages that have types."""
    names = {name for kind in _chosen(given)[:3] for name in _types().packages(kind)}
    print_lines(sorted(names))


def prototype(given: Namespace) -> str | None:
    """Print the default values of a type."""
    from rosz.ros2.rosidl_runtime_py import to_yaml

    package, *middle, base = given.type.split("/")
    kind = middle[0] if middle else "msg"
    try:
        if kind == "srv":
            message = _types().service(given.type).Request()
        elif kind == "action":
            message = _types().action(given.type).Goal()
        else:
            message = _types().message(f"{package}/{kind}/{base}")()
    except RoszError as error:
        return str(error)
    text = to_yaml(message)
    print_lines([text if given.no_quotes else f'"{text}"'])
    return None


def show(given: Namespace) -> str | None:
    """Print a definition, with those of the types in it."""
    name = given.type
    if name == "-":
        name = "" if sys.stdin.isatty() else sys.stdin.readline().strip()
    if not name:
        return "the passed value is empty"
    print_lines(_definition(name, not given.no_comments, given.all_comments, ""))
    return None


def _definition(name: str, comments: bool, inner_comments: bool, indent: str) -> Iterator[str]:
    parts = name.split("/")
    if len(parts) != _PARTS:
        raise CommandFailed(f"Invalid name '{name}'. Expected three parts separated by '/'")
    if parts[0] not in {*_packages().names(), *_types().packages()}:
        raise CommandFailed(f"Unknown package '{parts[0]}'")
    try:
        text = _types().definition(name).text
    except RoszError as error:
        raise CommandFailed(f"Could not find the interface '{name}': {error}") from error
    for line in text.splitlines():
        written = line.rstrip()
        bare = _COMMENT.sub(r"\1", written)
        shown = written if comments else bare.strip()
        if shown or comments:
            yield indent + shown if shown else ""
        field = _FIELD.match(bare)
        nested = _nested(field[1], parts[0]) if field is not None else None
        if nested is not None:
            yield from _definition(nested, inner_comments, inner_comments, f"{indent}\t")


def _nested(kind: str, package: str) -> str | None:
    """Return the full name of the type of a field; None for a primitive one."""
    from rosz.message import SCALAR_CODES

    if kind in {*SCALAR_CODES, "string", "wstring", "time", "duration"}:
        return None
    if kind == "Header":
        return "std_msgs/msg/Header"
    place, _, base = kind.rpartition("/")
    return f"{place.partition('/')[0] or package}/msg/{base}"


def list_packages(_: Namespace) -> None:
    """List packages."""
    print_lines(_packages().names())


def find_package(name: str) -> Package | None:
    """Return a package; None if there is none of that name."""
    try:
        return _packages().find(name)
    except PackageNotFound:
        return None


def executables(given: Namespace) -> None:
    """List the programs of a package, or of all."""
    for name in [given.package] if given.package else _packages().names():
        package = find_package(name)
        if package is None:
            raise CommandFailed(f"Package '{name}' not found")
        for program in package.executables():
            print_lines(
                [str(package.executable(program)) if given.full_path else f"{name} {program}"]
            )


def prefix(given: Namespace) -> str | None:
    """Print where a package is."""
    package = find_package(given.package)
    if package is None:
        return _PACKAGE_NOT_FOUND
    installed = package.path.parent.name == "share" and not given.share
    print_lines([str(package.path.parent.parent if installed else package.path)])
    return None


def manifest(given: Namespace) -> str | None:
    """Print the manifest of a package, or the text of a tag in it."""
    import xml.etree.ElementTree as ET  # its usual name

    package = find_package(given.package)
    if package is None:
        return _PACKAGE_NOT_FOUND
    file = package.path / "package.xml"
    if not file.is_file():
        return "Package XML manifest not found"
    tree = ET.parse(file)  # noqa: S314  # the user's own packages
    if given.tag is None:
        ET.dump(tree)
        return None
    tags = tree.getroot().findall(given.tag)
    print_lines(str(tag.text) for tag in tags)
    return None if tags else "XML tag not found"


def create(given: Namespace) -> str | None:
    """Create a package."""
    import getpass

    from rosz.workspace import LICENSES, AmentPackage

    if given.license == "?":
        print_lines(["Supported licenses:", *LICENSES])
        return None
    package = AmentPackage(
        name=given.package,
        parent=Path(given.destination_directory),
        build_type=given.build_type,
        dependencies=tuple(given.dependencies),
        description=given.description or "TODO: Package description",
        license=given.license or "TODO: License declaration",
        maintainer=given.maintainer_name or getpass.getuser(),
        email=given.maintainer_email or "",
        manifest_format=int(given.package_format),
        node=given.node_name or "",
        library=given.library_name or "",
    )
    if package.folder.exists():
        return (
            f"\nAborted!\nThe directory already exists: {package.folder}\nEither remove the"
            " directory or choose a different destination directory or package name"
        )
    print_lines([*package.announcement(), *package.create()])
    if given.license not in LICENSES:
        print_lines(
            [
                f"\n[WARNING]: Unknown license '{package.license}'.  This has been set in the"
                " package.xml, but no LICENSE file has been created.\nIt is recommended to use one"
                " of the ament license identifiers:",
                *LICENSES,
            ]
        )
    return None
