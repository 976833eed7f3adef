"""Markers, as rviz shows them: added, changed and deleted by namespace and number."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from rosz.errors import RoszError
from rosz.lifecycle import Closable
from rosz.msgs.visualization_msgs.msg import Marker
from rosz.transforms import Pose, compose
from rosz.web.scene.display import ReceivingDisplay, SceneSources
from rosz.web.scene.drawing import Array, Drawing, Shape, css_of, moved, placed
from rosz.web.scene.meshes import Meshes
from rosz.web.scene.poses import pose_from
from rosz.web.scene.setup import Look
from rosz.web.scene.shapes import along_directions, draw_arrows, draw_bars

MARKER_TYPES = frozenset({"visualization_msgs/Marker", "visualization_msgs/MarkerArray"})
_QUEUE = 100
_MOST = 20_000
_MOST_POINTS = 200_000
_NEVER = float("inf")
_HEAD = 0.23
"""Length of the head of an arrow, as a part of the whole."""


class _Placed:
    """A marker, and where it is in the fixed frame."""

    def __init__(self, marker: Any, ends: float) -> None:
        self.marker = marker
        self.ends = ends
        self.fixed = ""
        self.pose: Pose | None = None


class MarkerDisplay(ReceivingDisplay):
    """The markers of a topic of Marker or MarkerArray messages, with the meshes that they name."""

    def __init__(self, sources: SceneSources, look: Look) -> None:
        super().__init__(sources, look)
        self._placed: dict[tuple[str, int], _Placed] = {}
        self._refused = ""

    # Receiving messages.

    def _receive(self, message: Any) -> None:
        now = self._node.now()
        with self._lock:
            for marker in getattr(message, "markers", (message,)):
                self._take(marker, now)
            self._version += 1

    def _take(self, marker: Any, now: int) -> None:
        key = marker.ns, marker.id
        if marker.action == Marker.ADD:
            if len(self._placed) >= _MOST and key not in self._placed:
                self._refused = f"only the first {_MOST} markers are drawn"
                return
            life = marker.lifetime.to_nsec()
            self._placed[key] = _Placed(marker, now + life if life > 0 else _NEVER)
        elif marker.action == Marker.DELETE:
            self._placed.pop(key, None)
        elif marker.action == Marker.DELETEALL:
            self._placed.clear()
            self._refused = ""
        else:
            self._refused = f"marker {marker.ns}/{marker.id} has the unknown action {marker.action}"

    # Drawing.

    def refresh(self, fixed: str) -> bool:
        """Find where the markers are; return whether there is something new to draw."""
        self._switch()
        now = self._node.now()
        faults: Counter[str] = Counter()
        with self._lock:
            over = [key for key, entry in self._placed.items() if entry.ends <= now]
            for key in over:
                del self._placed[key]
            changed = bool(over)
            for entry in self._placed.values():
                changed = self._place(entry, fixed, faults) or changed
            self._version += changed
            self._report(faults, self._refused)
            return self._shown != (self._version, self.look)

    def _place(self, entry: _Placed, fixed: str, faults: Counter[str]) -> bool:
        """Return whether a marker came to another place."""
        locked = entry.marker.frame_locked
        if entry.fixed == fixed and entry.pose is not None and not locked:
            return False
        pose = self._find(fixed, entry.marker.header, faults, latest=locked)
        if pose is None:
            previous, entry.pose = entry.pose, entry.pose if entry.fixed == fixed else None
            return previous is not entry.pose
        previous, entry.pose, entry.fixed = entry.pose, pose, fixed
        return previous != pose

    def _subscribe(self) -> Sequence[Closable]:
        name, subscribe = self.look.name, self._node.subscription
        return (subscribe(name, self._cls, self._receive, queue_size=_QUEUE),)

    def _forget(self) -> None:
        self._placed.clear()

    def _draw_all(self, drawing: Drawing) -> None:
        with self._lock:
            self._shown = self._version, self.look
            shown = [entry for entry in self._placed.values() if entry.pose is not None]
            namespaces = len({ns for ns, _ in self._placed})
        faults: list[str] = []
        for marker in shown if self.look.visible else ():
            if marker.pose is None:
                continue
            try:
                faults_of_marker = draw_marker(marker.marker, marker.pose, self._meshes, drawing)
            except (RoszError, ValueError) as error:
                faults_of_marker = (str(error),)
            faults += [
                f"marker {marker.marker.ns}/{marker.marker.id}: {text}" for text in faults_of_marker
            ]
        self.status = f"{len(shown)} markers, {namespaces} namespaces"
        if faults:
            more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
            self._refused = faults[0] + more


def draw_marker(marker: Any, frame: Pose, meshes: Meshes, drawing: Drawing) -> tuple[str, ...]:
    """Draw a marker at its frame, and return why files are not shown that its mesh refers to.

    Raises:
        RoszError: Its mesh cannot be shown.
        ValueError: Its type is unknown, or it has too many points.
    """
    draw = _DRAW.get(marker.type)
    if draw is None and marker.type != Marker.MESH_RESOURCE:
        raise ValueError(f"its type is {marker.type}; expected 0 to {max(_DRAW)}")
    if len(marker.points) > _MOST_POINTS:
        raise ValueError(f"it has {len(marker.points)} points; expected {_MOST_POINTS} at most")
    pose = compose(frame, pose_from(marker.pose))
    if draw is None:
        return _draw_mesh(marker, pose, meshes, drawing)
    draw(marker, pose, drawing)
    return ()


def _color(color: Any) -> Array:
    values = np.array([color.r, color.g, color.b, color.a], dtype=np.float64)
    return (np.clip(np.nan_to_num(values), 0, 1) * 255).round().astype(np.uint8)


def _colors(marker: Any) -> Array:
    """Return the color of each point, or the one of all."""
    if marker.colors and len(marker.colors) == len(marker.points):
        return np.array([_color(color) for color in marker.colors])
    return _color(marker.color)


def _points(marker: Any, pose: Pose) -> Array:
    rows = np.array([(p.x, p.y, p.z) for p in marker.points], dtype=np.float64)
    return moved(rows.reshape(-1, 3), pose)


def _sized(pose: Pose, scale: Any) -> Array:
    return placed(pose, scale.x, scale.y, scale.z)


def _draw_arrow(marker: Any, pose: Pose, drawing: Drawing) -> None:
    scale, color = marker.scale, _color(marker.color)
    if not marker.points:
        # Width and height may differ, so that the arrow is scaled as a whole.
        draw_arrows(
            drawing, [_sized(pose, scale)], color, length=1.0, width=2.0, head=_HEAD, shaft=1.0
        )
        return
    if len(marker.points) < 2:  # noqa: PLR2004  # the ends of an arrow
        raise ValueError("an arrow has no points, or two")
    begin, end = _points(marker, pose)[:2]
    _draw_between(marker, begin, end, drawing, color)


def _draw_arrows(marker: Any, pose: Pose, drawing: Drawing) -> None:
    rows, paint = _points(marker, pose), _colors(marker)
    for number, (begin, end) in enumerate(pairwise(rows)):
        color = paint if paint.ndim == 1 else paint[number]
        _draw_between(marker, begin, end, drawing, color)


def _draw_between(marker: Any, begin: Array, end: Array, drawing: Drawing, color: Array) -> None:
    scale, length = marker.scale, float(np.linalg.norm(end - begin))
    if length:
        draw_arrows(
            drawing,
            [_towards((end - begin) / length, begin)],
            color,
            length=length,
            width=scale.y or 2 * scale.x,
            head=min(scale.z / length, 1.0) if scale.z else _HEAD,
            shaft=scale.x,
        )


def _towards(along: Array, origin: Array) -> Array:
    """Return a matrix whose x axis has a direction."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = along_directions(along[None])[0], origin
    return matrix


def _draw_shape(shape: Shape, marker: Any, pose: Pose, drawing: Drawing) -> None:
    drawing.shapes(shape, _sized(pose, marker.scale), _color(marker.color))


def _draw_strip(marker: Any, pose: Pose, drawing: Drawing) -> None:
    rows = _points(marker, pose)
    _draw_lines(marker, drawing, np.repeat(rows, 2, axis=0)[1:-1], doubled=True)


def _draw_list(marker: Any, pose: Pose, drawing: Drawing) -> None:
    rows = _points(marker, pose)
    _draw_lines(marker, drawing, rows[: len(rows) // 2 * 2])


def _draw_lines(marker: Any, drawing: Drawing, ends: Array, *, doubled: bool = False) -> None:
    paint = _colors(marker)
    if not len(ends):
        return
    if paint.ndim > 1:
        paint = np.repeat(paint, 2, axis=0)[1:-1] if doubled else paint[: len(ends)]
    if marker.scale.x > 0:
        draw_bars(drawing, ends, paint if paint.ndim == 1 else paint[::2], marker.scale.x)
    else:
        drawing.lines(ends, paint)


def _draw_shapes(shape: Shape, marker: Any, pose: Pose, drawing: Drawing) -> None:
    rows = _points(marker, pose)
    matrices = np.repeat(_sized(pose, marker.scale)[None], len(rows), axis=0)
    matrices[:, :3, 3] = rows
    drawing.shapes(shape, matrices, _colors(marker))


def _draw_points(marker: Any, pose: Pose, drawing: Drawing) -> None:
    drawing.points(_points(marker, pose), _colors(marker), marker.scale.x or 0.01)


def _draw_text(marker: Any, pose: Pose, drawing: Drawing) -> None:
    color = marker.color
    css = css_of(color.r, color.g, color.b, color.a)
    drawing.text(marker.text, pose.translation, css, marker.scale.z or 0.1)


def _draw_mesh(marker: Any, pose: Pose, meshes: Meshes, drawing: Drawing) -> tuple[str, ...]:
    """Draw a mesh, and return why files are not shown that it refers to."""
    mesh = meshes.find(marker.mesh_resource)
    color = None if marker.mesh_use_embedded_materials and mesh.colored else _color(marker.color)
    drawing.mesh(mesh.address, mesh.form, _sized(pose, marker.scale), color)
    return () if color is not None else mesh.missing


def _draw_triangles(marker: Any, pose: Pose, drawing: Drawing) -> None:
    if len(marker.points) % 3:
        raise ValueError(f"it has {len(marker.points)} points; expected three for each triangle")
    scale = marker.scale
    rows = np.array([(p.x * scale.x, p.y * scale.y, p.z * scale.z) for p in marker.points])
    paint = _colors(marker)
    if len(marker.colors) * 3 == len(marker.points) and len(marker.colors):
        paint = np.repeat([_color(color) for color in marker.colors], 3, axis=0)
    drawing.triangles(moved(rows.reshape(-1, 3), pose), paint)


_DRAW: dict[int, Callable[[Any, Pose, Drawing], None]] = {
    Marker.ARROW: _draw_arrow,
    Marker.CUBE: partial(_draw_shape, "cube"),
    Marker.SPHERE: partial(_draw_shape, "sphere"),
    Marker.CYLINDER: partial(_draw_shape, "cylinder"),
    Marker.LINE_STRIP: _draw_strip,
    Marker.LINE_LIST: _draw_list,
    Marker.CUBE_LIST: partial(_draw_shapes, "cube"),
    Marker.SPHERE_LIST: partial(_draw_shapes, "sphere"),
    Marker.POINTS: _draw_points,
    Marker.TEXT_VIEW_FACING: _draw_text,
    Marker.TRIANGLE_LIST: _draw_triangles,
    Marker.ARROW_STRIP: _draw_arrows,
}
