"""Bounding boxes and polygons of jsk_recognition_msgs, which report recognised objects."""

from __future__ import annotations

from typing import Any

import numpy as np

from rosz.transforms import Pose, compose
from rosz.web.scene.colors import color_bytes
from rosz.web.scene.drawing import Drawing, moved, placed
from rosz.web.scene.poses import draw_polygon, pose_from
from rosz.web.scene.setup import Look

__all__ = ("draw_box", "draw_boxes", "draw_polygons")

_CLEAR = 180
_COLORS = ("#2f6fed", "#e0a21a", "#1f9d61", "#e0483e", "#8a4fd0", "#0f9bb0", "#c13c8b", "#8c6d3f")
_EDGES = np.array(
    [
        (0, 1), (0, 2), (0, 4), (1, 3), (1, 5), (2, 3),
        (2, 6), (3, 7), (4, 5), (4, 6), (5, 7), (6, 7),
    ]
)  # fmt: skip
_CORNERS = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])


def draw_box(message: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw a BoundingBox."""
    return draw_boxes([message], pose, look, drawing)


def draw_boxes(message: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw the boxes of a BoundingBoxArray, in the colors of their labels."""
    boxes = getattr(message, "boxes", message)
    for box in boxes:
        size, color = box.dimensions, _color(box.label, look)
        place = compose(pose, pose_from(box.pose))
        edges = _CORNERS[_EDGES].reshape(-1, 3) * (size.x, size.y, size.z)
        drawing.lines(moved(edges, place), color)
        color[3] = _CLEAR
        drawing.shapes("cube", placed(place, size.x, size.y, size.z), color)
    return f"{len(boxes)} boxes"


def draw_polygons(message: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw the outlines of a PolygonArray; those without labels in colors of their own."""
    labels = list(message.labels) or list(range(len(message.polygons)))
    for polygon, label in zip(message.polygons, labels, strict=False):
        color = look.color or _COLORS[label % len(_COLORS)]
        draw_polygon(polygon, pose, Look(look.name, color, look.size), drawing)
    return f"{len(message.polygons)} polygons"


def _color(label: int, look: Look) -> Any:
    return color_bytes(look.color or _COLORS[label % len(_COLORS)])
