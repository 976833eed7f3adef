"""A robot by its description (URDF): what its links look like, where their frames are."""

from __future__ import annotations

import math
from typing import Any, NamedTuple
from xml.etree import ElementTree as ET

import numpy as np

from rosz.errors import RoszError, TransformError, UsageError
from rosz.node import Node
from rosz.transforms import Pose, compose, from_rpy
from rosz.web.model import Frames
from rosz.web.scene.display import Display
from rosz.web.scene.drawing import Array, Drawing, color_bytes, placed
from rosz.web.scene.meshes import Meshes
from rosz.web.scene.setup import DESCRIPTION, ROBOT, Look

_GRAY, _WHITE = color_bytes("#c4c9d4"), color_bytes("#ffffff")
_SOME = 3


class Visual(NamedTuple):
    """A part of the appearance of a link.

    Attributes:
        link: Name of the link.
        origin: Its pose in the link.
        shape: ``cube``, ``sphere``, ``cylinder``, or a URI of a mesh.
        size: Its size in metres, or the scale of the mesh.
        color: Its color; None for that of the mesh.
        texture: URI of the texture that its material has; empty for none.
    """

    link: str
    origin: Pose
    shape: str
    size: tuple[float, float, float]
    color: Array | None
    texture: str


def read_visuals(description: str) -> list[Visual]:
    """Return the appearance of the links of a URDF.

    Raises:
        UsageError: It is not XML or not a URDF, or a number in it is not one.
    """
    try:
        robot = ET.fromstring(description)  # noqa: S314  # a parameter of this system
    except ET.ParseError as error:
        raise UsageError(f"the description of the robot is not XML: {error}") from error
    if robot.tag != "robot":
        raise UsageError(f"the description of the robot has <{robot.tag}>; expected <robot> (URDF)")
    materials = {
        material.get("name", ""): material for material in robot.iter("material") if len(material)
    }
    visuals: list[Visual] = []
    for link in robot.findall("link"):
        name = link.get("name", "")
        for visual in link.findall("visual"):
            try:
                shape = _read_visual(name, visual, materials)
            except ValueError as error:
                raise UsageError(f"link '{name}': {error}; expected numbers") from error
            if shape is not None:
                visuals.append(shape)
    return visuals


def _read_visual(link: str, visual: ET.Element, materials: dict[str, ET.Element]) -> Visual | None:
    geometry = visual.find("geometry")
    if geometry is None or not len(geometry):
        return None
    origin = visual.find("origin")
    pose = Pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    if origin is not None:
        x, y, z = _numbers(origin.get("xyz", "0 0 0"))
        pose = Pose((x, y, z), from_rpy(*_numbers(origin.get("rpy", "0 0 0"))))
    shape = geometry[0]
    material = visual.find("material")
    color, texture = _color_of(material, materials), _texture_of(material, materials)
    return Visual(link, pose, *_read_shape(shape), color, texture)


def _read_shape(shape: ET.Element) -> tuple[str, tuple[float, float, float]]:
    """Return the shape of a visual, and its size."""
    if shape.tag == "box":
        return "cube", _numbers(shape.get("size", ""))
    if shape.tag == "sphere":
        width = 2 * float(shape.get("radius", ""))
        return "sphere", (width, width, width)
    if shape.tag == "cylinder":
        width, length = 2 * float(shape.get("radius", "")), float(shape.get("length", ""))
        return "cylinder", (width, width, length)
    if shape.tag == "mesh":
        return shape.get("filename", ""), _numbers(shape.get("scale", "1 1 1"))
    return f"<{shape.tag}>", (1.0, 1.0, 1.0)


def _numbers(text: str) -> tuple[float, float, float]:
    x, y, z = map(float, text.split())
    if not all(map(math.isfinite, (x, y, z))):
        raise ValueError(f"'{text}' is not finite")
    return x, y, z


def _texture_of(material: ET.Element | None, materials: dict[str, ET.Element]) -> str:
    texture = _find_in(material, materials, "texture")
    return "" if texture is None else texture.get("filename", "")


def _find_in(
    material: ET.Element | None, materials: dict[str, ET.Element], tag: str
) -> ET.Element | None:
    """Return a part of a material, or of the one of the robot that it names."""
    if material is None:
        return None
    element = material.find(tag)
    if element is None and not len(material):
        element = materials.get(material.get("name", ""), material).find(tag)
    return element


def _color_of(material: ET.Element | None, materials: dict[str, ET.Element]) -> Array | None:
    color = _find_in(material, materials, "color")
    if color is None:
        return None
    values = np.array([float(value) for value in color.get("rgba", "").split()])
    if len(values) != 4:  # noqa: PLR2004  # red, green, blue, opacity
        raise ValueError(f"the color '{color.get('rgba')}' has {len(values)} numbers")
    rgba: Array = (np.clip(values, 0, 1) * 255).round().astype(np.uint8)
    return rgba


def draw_visual(visual: Visual, link: Pose, meshes: Meshes, drawing: Drawing) -> list[str]:
    """Draw a part of a link at a pose, and return why files are not shown that it refers to.

    Raises:
        UsageError: The mesh cannot be shown.
    """
    matrix = placed(compose(link, visual.origin), *visual.size)
    color, texture, faults = visual.color, None, []
    if visual.texture:
        try:
            texture = meshes.texture(visual.texture)
        except UsageError as error:
            faults.append(f"without its texture: {error}")
        else:
            color = _WHITE
    address = "" if texture is None else texture.address
    if visual.shape in {"cube", "sphere", "cylinder"}:
        paint = _GRAY if color is None else color
        drawing.shapes(visual.shape, matrix, paint, address)  # type: ignore[arg-type]
        return faults
    mesh = meshes.find(visual.shape)
    if mesh.colored:
        color, address = None, ""
    elif texture is not None and not mesh.mapped:
        color, address = texture.color, ""
    drawing.mesh(mesh.address, mesh.form, matrix, color, address)
    return [*faults, *mesh.missing]


class RobotDisplay(Display):
    """A robot whose description is a parameter.

    Args:
        node: The node that reads it.
        look: Its settings; the name is ``robot``, or ``robot:`` and the name of the parameter.
        frames: The frames.
        meshes: The meshes.
    """

    def __init__(self, node: Node, look: Look, frames: Frames, meshes: Meshes) -> None:
        super().__init__(look, "Robot")
        self._name = look.name.removeprefix(ROBOT).removeprefix(":") or DESCRIPTION
        self._node = node
        self._frames = frames
        self._meshes = meshes
        self._text: Any = None
        self._visuals: list[Visual] = []
        self._unusable = ""
        self._fixed = ""
        self._subscriptions = (node.params.watch(self._name, lambda _: self._read()),)
        self._read()

    def _read(self) -> None:
        text = self._node.params.get(self._name, None)
        with self._lock:
            if text == self._text and self._version:
                return
            self._text = text
            self._version += 1
            self._visuals, self._unusable = [], ""
            if not isinstance(text, str):
                self._unusable = f"no parameter '{self._name}' holds the URDF of a robot"
                return
            try:
                self._visuals = read_visuals(text)
            except UsageError as error:
                self._unusable = str(error)

    def refresh(self, fixed: str) -> bool:
        """Return whether a frame moved, or the description changed."""
        self._fixed = fixed
        return self._shown != (self.look, fixed, self._version, self._frames.version)

    def _draw_all(self, drawing: Drawing) -> None:
        with self._lock:
            look, fixed, visuals = self.look, self._fixed, self._visuals
            self._shown = look, fixed, self._version, self._frames.version
            unusable = self._unusable
        if look.visible:
            faults = self._draw(visuals, fixed, drawing)
            self.status = "" if unusable else f"{len({visual.link for visual in visuals})} links"
            self.fault = unusable or "; ".join(faults)

    def _draw(self, visuals: list[Visual], fixed: str, drawing: Drawing) -> list[str]:
        """Draw all links, and return the reasons for those that cannot be drawn."""
        lost: dict[str, str] = {}
        faults: dict[str, None] = {}
        before = f"{self.look.prefix}/" if self.look.prefix else ""
        for visual in visuals:
            try:
                pose = self._frames.find(fixed, f"{before}{visual.link}")
            except TransformError as error:
                lost.setdefault(visual.link, str(error).strip())
                continue
            try:
                problems = draw_visual(visual, pose, self._meshes, drawing)
            except RoszError as error:
                problems = [str(error)]
            faults |= dict.fromkeys(f"link '{visual.link}': {problem}" for problem in problems)
        listed = list(faults)
        if lost:
            links = ", ".join(list(lost)[:_SOME]) + " …" * (len(lost) > _SOME)
            why = next(iter(lost.values()))
            listed.insert(0, f"no transform to '{fixed}' of {len(lost)} links ({links}): {why}")
        return listed
