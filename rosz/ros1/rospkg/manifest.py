"""What a package.xml says, in rospkg's words (REP 127, REP 140, REP 149)."""

from __future__ import annotations

from collections.abc import Container, Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

__all__ = (
    "MANIFEST_FILE",
    "PACKAGE_FILE",
    "Depend",
    "Export",
    "InvalidManifest",
    "Manifest",
    "ResourceNotFound",
    "RosDep",
    "read_manifest",
)

MANIFEST_FILE = "manifest.xml"
PACKAGE_FILE = "package.xml"

_DEPENDS = (
    "depend",
    "buildtool_depend",
    "build_depend",
    "build_export_depend",
    "buildtool_export_depend",
    "exec_depend",
    "run_depend",
    "test_depend",
)


class ResourceNotFound(Exception):
    """A package that is nowhere on the path.

    Attributes:
        ros_paths: Where it was looked for.
    """

    def __init__(self, msg: str, ros_paths: Sequence[str] | None = None) -> None:
        super().__init__(msg)
        self.ros_paths = ros_paths

    def __str__(self) -> str:
        lines = [str(self.args[0])]
        lines += [f"ROS path [{i}]={path}" for i, path in enumerate(self.ros_paths or ())]
        return "\n".join(lines)


class InvalidManifest(Exception):
    """A package.xml that cannot be read."""


class Depend:
    """A package that another one needs."""

    def __init__(self, name: str, type_: str = "package") -> None:
        self.name = name
        self.type = type_

    def __str__(self) -> str:
        return self.name

    def __repr__(self) -> str:
        return self.name

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Depend) and (self.name, self.type) == (other.name, other.type)

    def __hash__(self) -> int:
        return hash((self.name, self.type))


class RosDep:
    """Something of the system that a package needs."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __repr__(self) -> str:
        return self.name


class Export:
    """A tag that a package offers to others."""

    def __init__(self, tag: str, attrs: dict[str, str], text: str) -> None:
        self.tag = tag
        self.attrs = attrs
        self.str = text

    def get(self, attr: str) -> str | None:
        """Return an attribute; None where the tag has none of that name."""
        return self.attrs.get(attr)


class Manifest:
    """What a package says about itself; empty texts where it says nothing."""

    def __init__(
        self, type_: str = "package", filename: str | None = None, is_catkin: bool = False
    ) -> None:
        self.type = type_
        self.filename = filename
        self.is_catkin = is_catkin
        self.name = self.description = self.brief = self.author = self.version = ""
        self.license = self.license_url = self.url = self.status = self.notes = ""
        self.licenses: list[str] = []
        self.depends: list[Depend] = []
        self.rosdeps: list[RosDep] = []
        self.exports: list[Export] = []

    def get_export(self, tag: str, attr: str, convert: bool = True) -> list[str]:
        """Return what all exported tags of a name say in an attribute.

        Args:
            tag: Name of the tag.
            attr: Name of the attribute.
            convert: Whether ``${prefix}`` becomes the package's folder.
        """
        found = [one.attrs[attr] for one in self.exports if one.tag == tag and attr in one.attrs]
        prefix = str(Path(self.filename or "").parent)
        return [text.replace("${prefix}", prefix) for text in found] if convert else found


def read_manifest(folder: Path, packages: Container[str]) -> Manifest:
    """Read the package.xml of a folder.

    Args:
        folder: The package.
        packages: Names of known packages; other names that it depends on are of the system.

    Raises:
        InvalidManifest: It cannot be read.
    """
    path = folder / PACKAGE_FILE
    try:
        top = ET.parse(path).getroot()  # noqa: S314  # the user's own package
    except (OSError, ET.ParseError) as error:
        raise InvalidManifest(f"[{path}] cannot be read: {error}") from error
    manifest = Manifest(filename=str(folder / MANIFEST_FILE), is_catkin=True)
    manifest.name = _text(top, "name")
    manifest.version = _text(top, "version")
    manifest.description = _text(top, "description")
    manifest.licenses = [_content(one) for one in top.findall("license")]
    manifest.license = ", ".join(manifest.licenses)
    manifest.url = _text(top, "url")
    manifest.author = ", ".join(
        [f"Maintainer: {_person(one)}" for one in top.findall("maintainer")]
        + [_person(one) for one in top.findall("author")]
    )
    names = {_content(one): None for tag in _DEPENDS for one in top.findall(tag)}
    manifest.depends = [Depend(name) for name in names if name in packages]
    manifest.rosdeps = [RosDep(name) for name in names if name not in packages]
    exported = top.find("export")
    manifest.exports = [
        Export(one.tag, dict(one.attrib), _content(one))
        for one in (() if exported is None else exported)
    ]
    return manifest


def _content(element: ET.Element) -> str:
    return "".join(element.itertext()).strip()


def _text(top: ET.Element, tag: str) -> str:
    element = top.find(tag)
    return "" if element is None else " ".join(_content(element).split())


def _person(element: ET.Element) -> str:
    address = element.get("email")
    return f"{_content(element)} <{address}>" if address else _content(element)
