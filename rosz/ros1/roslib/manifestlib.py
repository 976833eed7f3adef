"""roslib.manifestlib: ``manifest.xml`` and ``stack.xml``, the manifests of rosbuild."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, Self
from xml.etree import ElementTree as ET

__all__ = (
    "Depend",
    "Export",
    "ManifestException",
    "Platform",
    "ROSDep",
    "StackDepend",
    "VersionControl",
    "parse",
    "parse_file",
)

_TEXTS = ("description", "license", "author", "url", "version", "logo")


class ManifestException(Exception):
    """A manifest is not valid."""


class _Entry:
    """An element of a manifest, which is its attributes.

    Two elements are equal if they are of one class and have equal attributes.
    """

    tag = ""
    required: tuple[str, ...] = ()

    def __init__(self, **attributes: str | None) -> None:
        for name in self.required:
            if not attributes[name]:
                raise ValueError(f"bad '{name}' attribute")
        vars(self).update(attributes)

    def attributes(self) -> dict[str, str]:
        """Return the attributes that are set."""
        return {name: value for name, value in vars(self).items() if value is not None}

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and vars(other) == vars(self)

    def __hash__(self) -> int:
        return hash(tuple(vars(self).values()))

    def __repr__(self) -> str:
        return " ".join(str(getattr(self, name)) for name in self.required)

    def xml(self) -> str:
        """Return the element as XML."""
        shown = "".join(f' {name}="{value}"' for name, value in self.attributes().items())
        return f"<{self.tag}{shown} />"


class Depend(_Entry):
    """A package that a package depends on."""

    tag = "depend"
    required = ("package",)
    package: str

    def __init__(self, package: str) -> None:
        super().__init__(package=package)


class StackDepend(_Entry):
    """A stack that a stack depends on."""

    tag = "depend"
    required = ("stack",)
    stack: str

    def __init__(self, stack: str) -> None:
        super().__init__(stack=stack)


class ROSDep(_Entry):
    """A package of the system that a package depends on."""

    tag = "rosdep"
    required = ("name",)
    name: str

    def __init__(self, name: str) -> None:
        super().__init__(name=name)


class VersionControl(_Entry):
    """A place of the sources."""

    tag = "versioncontrol"
    required = ("type",)
    type: str
    url: str | None

    def __init__(self, type_: str, url: str | None) -> None:
        super().__init__(type=type_, url=url)


class Platform(_Entry):
    """A system that a package runs on."""

    tag = "platform"
    required = ("os", "version")
    os: str
    version: str
    notes: str | None

    def __init__(self, os: str, version: str, notes: str | None = None) -> None:
        super().__init__(os=os, version=version, notes=notes)

    def xml(self) -> str:
        """Return the element as XML."""
        return super().xml().replace(" />", "/>")


class Export:
    """An element of the ``<export>`` section of a manifest."""

    def __init__(self, tag: str, attrs: dict[str, str], str: str) -> None:  # noqa: A002  # ROS 1's
        self.tag = tag
        self.attrs = attrs
        self.str = str

    def get(self, attr: str) -> str | None:
        """Return an attribute, or None if the element does not have it."""
        return self.attrs.get(attr)

    def xml(self) -> str:
        """Return the element as XML."""
        return ET.tostring(self.element(), encoding="unicode")

    def element(self) -> ET.Element:
        """Return the element."""
        element = ET.Element(self.tag, self.attrs)
        element.text = self.str or None
        return element


class _Manifest:
    """A manifest; texts that it does not give are empty.

    Args:
        _type: Name of its element: ``package`` or ``stack``.
    """

    def __init__(self, _type: str = "package") -> None:
        self._type = _type
        self.description = self.brief = self.author = self.license = self.license_url = ""
        self.url = self.logo = self.version = self.status = self.notes = ""
        self.depends: list[Any] = []
        self.rosdeps: list[ROSDep] = []
        self.platforms: list[Platform] = []
        self.exports: list[Export] = []
        self.versioncontrol: VersionControl | None = None
        self.unknown_tags: list[str] = []

    def __str__(self) -> str:
        return self.xml()

    def get_export(self, tag: str, attr: str) -> list[str]:
        """Return an attribute of all exported elements of a name.

        Args:
            tag: Name of the elements.
            attr: Name of the attribute.
        """
        return [one.attrs[attr] for one in self.exports if one.tag == tag and attr in one.attrs]

    def xml(self) -> str:
        """Return the manifest as XML."""
        top = ET.Element(self._type)
        for name in _TEXTS:
            text = getattr(self, name)
            if text or name in {"description", "license", "author"}:
                ET.SubElement(top, name).text = text
        if self.brief:
            top[0].set("brief", self.brief)
        if self.license_url:
            top[1].set("url", self.license_url)
        if self.status or self.notes:
            ET.SubElement(top, "review", status=self.status, notes=self.notes)
        entries: Iterable[_Entry] = (*self.depends, *self.rosdeps, *self.platforms)
        for one in (*entries, *([self.versioncontrol] if self.versioncontrol else ())):
            ET.SubElement(top, one.tag, one.attributes())
        if self.exports:
            ET.SubElement(top, "export").extend(one.element() for one in self.exports)
        ET.indent(top)
        return ET.tostring(top, encoding="unicode")

    def _read(self, top: ET.Element) -> Self:
        for name in _TEXTS:
            setattr(self, name, _text(top, name, many=name == "author"))
        first = {name: top.find(name) for name in ("description", "license", "review")}
        self.brief = _attribute(first["description"], "brief")
        self.license_url = _attribute(first["license"], "url")
        self.status = _attribute(first["review"], "status")
        self.notes = _attribute(first["review"], "notes")
        if first["review"] is None:
            self.status = "unreviewed"
        self.depends = self._depends(top)
        self.rosdeps = [ROSDep(_required(one, "name")) for one in top.findall("rosdep")]
        self.platforms = [
            Platform(_required(one, "os"), _required(one, "version"), one.get("notes", ""))
            for one in top.findall("platform")
        ]
        self.exports = [
            Export(one.tag, dict(one.attrib), one.text or "") for one in top.findall("export/*")
        ]
        place = top.find("versioncontrol")
        if place is not None:
            self.versioncontrol = VersionControl(_required(place, "type"), place.get("url"))
        known = {*_TEXTS, "review", "depend", "rosdep", "platform", "export", "versioncontrol"}
        self.unknown_tags = [one.tag for one in top if one.tag not in known]
        if self._type == "stack" and (self.exports or self.rosdeps):
            what = "exports" if self.exports else "rosdeps"
            raise ManifestException(f"stack manifests are not allowed to have {what}")
        if self._type == "package" and self.version:
            raise ManifestException("<version> tag is not valid in a package manifest.xml file")
        return self

    def _depends(self, top: ET.Element) -> list[Any]:
        found = top.findall("depend")
        if self._type == "stack":
            return [StackDepend(_required(one, "stack")) for one in found]
        own = [one for one in found if "thirdparty" not in one.attrib]
        return [Depend(_required(one, "package")) for one in own]


def _required(element: ET.Element, name: str) -> str:
    value = element.get(name)
    if not value:
        raise ManifestException(f"<{element.tag}> is missing the attribute '{name}'")
    return value


def _attribute(element: ET.Element | None, name: str) -> str:
    return "" if element is None else element.get(name, "")


def _text(top: ET.Element, name: str, *, many: bool) -> str:
    found = top.findall(name)
    if len(found) > 1 and not many:
        raise ManifestException(f"Invalid manifest file: must have a single '{name}' element")
    return ", ".join("".join(one.itertext()).strip() for one in found)


def parse_file(m: _Manifest, file: str) -> _Manifest:
    """Read a manifest.

    Args:
        m: Manifest to fill.
        file: Path of the file.

    Returns:
        The manifest.

    Raises:
        ManifestException: The file is not a manifest.
        ValueError: The file does not exist.
    """
    path = Path(file)
    if not path.is_file():
        raise ValueError(f"Invalid/non-existent manifest file: {file}")
    try:
        return parse(m, path.read_text("utf-8"), file)
    except ManifestException as error:
        raise ManifestException(f"Invalid manifest file [{path.absolute()}]: {error}") from error


def parse(m: _Manifest, string: str, filename: str = "string") -> _Manifest:  # noqa: ARG001  # ROS 1's
    """Read the text of a manifest; see `parse_file`.

    Args:
        m: Manifest to fill.
        string: The text.
        filename: Ignored.

    Raises:
        ManifestException: The text is not a manifest.
    """
    try:
        top = ET.fromstring(string)  # noqa: S314  # the user's own package
    except ET.ParseError as error:
        raise ManifestException(f"invalid XML: {error}") from error
    if top.tag != m._type:  # of this module
        raise ManifestException(f"manifest must have a single '{m._type}' element")
    return m._read(top)  # noqa: SLF001
