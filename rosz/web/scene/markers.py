"""Markers, as rviz shows them: added, changed and deleted by namespace and number."""

from __future__ import annotations

import threading
from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from rosz.errors import RoszError, TransformError
from rosz.introspect.subscribe import find_class, find_token, topic_types
from rosz.msgs.visualization_msgs.msg import Marker
from rosz.names import short_type
from rosz.transforms import Pose, compose
from rosz.web.model import Frames
from rosz.web.scene.colors import css_of
from rosz.web.scene.drawing import MEDIA, Array, Drawing, matrix_of, moved
from rosz.web.scene.meshes import Meshes
from rosz.web.scene.poses import pose_from
from rosz.web.scene.setup import Look
from rosz.web.scene.shapes import draw_arrows, draw_bars

if TYPE_CHECKING:
    from rosz.introspect.survey import Survey
    from rosz.node import Node

__all__ = ("MARKER_TYPES", "MarkerDisplay", "draw_marker")

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


class MarkerDisplay:
    """The markers of a topic of Marker or MarkerArray messages.

    Args:
        node: The node that subscribes to it.
        survey: The running nodes.
        look: Its settings.
        frames: The frames.
        meshes: The meshes that markers name.

    Raises:
        NotFoundError: The topic does not exist.
        TypeNotFound: Its type is not known here.
        DefinitionError: Its definition differs from the one here.
    """

    def __init__(
        self, node: Node, survey: Survey, look: Look, frames: Frames, meshes: Meshes
    ) -> None:
        token = find_token(survey.view, look.name, topic_types(survey.view)[look.name][0])
        self.look = look
        self.kind: str = short_type(token.type_name)
        self.status: str = ""
        self.fault: str = ""
        self._node = node
        self._cls = find_class(node.context, token)
        self._frames = frames
        self._meshes = meshes
        self._lock = threading.Lock()
        self._placed: dict[tuple[str, int], _Placed] = {}
        self._version = 0
        self._refused = ""
        self._fixed = ""
        self._shown: tuple[Any, ...] = ()
        self._subscription: Any = None

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
        if self.look.visible != (self._subscription is not None):
            self._switch()
        now = self._node.now()
        faults: dict[str, int] = {}
        with self._lock:
            over = [key for key, one in self._placed.items() if one.ends <= now]
            for key in over:
                del self._placed[key]
            changed = bool(over)
            for one in self._placed.values():
                changed = self._place(one, fixed, faults) or changed
            self._version += changed
            self._fixed = fixed
            texts = [f"{count} not drawn: {why}" for why, count in faults.items()]
            self.fault = "; ".join([*texts[:2], *([self._refused] if self._refused else [])])
            return self._shown != (self._version, self.look)

    def _place(self, one: _Placed, fixed: str, faults: dict[str, int]) -> bool:
        """Return whether a marker came to another place."""
        locked = one.marker.frame_locked
        if one.fixed == fixed and one.pose is not None and not locked:
            return False
        header = one.marker.header
        frame = header.frame_id.removeprefix("/")
        stamp = 0 if locked else header.stamp.to_nsec()
        try:
            pose = self._frames.find(fixed, frame, stamp)
        except TransformError:
            why = self._frames.why_not(fixed, frame, stamp)
            faults[why] = faults.get(why, 0) + 1
            known, one.pose = one.pose, one.pose if one.fixed == fixed else None
            return known is not one.pose
        known, one.pose, one.fixed = one.pose, pose, fixed
        return known != pose

    def _switch(self) -> None:
        """Subscribe when it is shown, and unsubscribe when it is hidden."""
        if self.look.visible:
            self._subscription = self._node.subscription(
                self.look.name, self._cls, self._receive, queue_size=_QUEUE
            )
            return
        self.close()
        with self._lock:
            self._placed.clear()
            self._version += 1

    def encoded(self) -> tuple[bytes, str]:
        """Return the drawing of all markers."""
        with self._lock:
            self._shown = self._version, self.look
            placed = [one for one in self._placed.values() if one.pose is not None]
            namespaces = len({ns for ns, _ in self._placed})
        drawing = Drawing()
        faults: list[str] = []
        for one in placed if self.look.visible else ():
            if one.pose is None:
                continue
            try:
                found = draw_marker(one.marker, one.pose, self._meshes, drawing)
            except (RoszError, ValueError) as error:
                found = (str(error),)
            faults += [f"marker {one.marker.ns}/{one.marker.id}: {text}" for text in found]
        self.status = f"{len(placed)} markers, {namespaces} namespaces"
        if faults:
            more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
            self._refused = faults[0] + more
        return drawing.encode(), MEDIA

    def close(self) -> None:
        """Unsubscribe."""
        subscription, self._subscription = self._subscription, None
        if subscription is not None:
            subscription.close()


def draw_marker(marker: Any, frame: Pose, meshes: Meshes, drawing: Drawing) -> tuple[str, ...]:
    """Draw a marker, and return why files are not shown that its mesh refers to.

    Args:
        marker: The marker.
        frame: Pose of its frame in the fixed frame.
        meshes: The meshes that markers name.
        drawing: The drawing.

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
        return np.array([_color(one) for one in marker.colors])
    return _color(marker.color)


def _points(marker: Any, pose: Pose) -> Array:
    rows = np.array([(p.x, p.y, p.z) for p in marker.points], dtype=np.float64)
    return moved(rows.reshape(-1, 3), pose)


def _sized(pose: Pose, scale: Any) -> Array:
    found: Array = matrix_of(pose) @ np.diag((scale.x, scale.y, scale.z, 1.0))
    return found


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
    aside = np.array((0.0, 0.0, 1.0) if abs(along[2]) < 0.9 else (1.0, 0.0, 0.0))  # noqa: PLR2004
    second = np.cross(aside, along)
    second /= np.linalg.norm(second)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1] = along, second
    matrix[:3, 2], matrix[:3, 3] = np.cross(along, second), origin
    return matrix


def _draw_cube(marker: Any, pose: Pose, drawing: Drawing) -> None:
    drawing.shapes("cube", _sized(pose, marker.scale), _color(marker.color))


def _draw_sphere(marker: Any, pose: Pose, drawing: Drawing) -> None:
    drawing.shapes("sphere", _sized(pose, marker.scale), _color(marker.color))


def _draw_cylinder(marker: Any, pose: Pose, drawing: Drawing) -> None:
    drawing.shapes("cylinder", _sized(pose, marker.scale), _color(marker.color))


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


def _draw_cubes(marker: Any, pose: Pose, drawing: Drawing) -> None:
    drawing.shapes("cube", _each(marker, pose), _colors(marker))


def _draw_spheres(marker: Any, pose: Pose, drawing: Drawing) -> None:
    drawing.shapes("sphere", _each(marker, pose), _colors(marker))


def _each(marker: Any, pose: Pose) -> Array:
    """Return the matrix of each element of a list."""
    rows = _points(marker, pose)
    scale = marker.scale
    turned = matrix_of(pose) @ np.diag((scale.x, scale.y, scale.z, 1.0))
    matrices = np.repeat(turned[None], len(rows), axis=0)
    matrices[:, :3, 3] = rows
    return matrices


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
        paint = np.repeat([_color(one) for one in marker.colors], 3, axis=0)
    drawing.triangles(moved(rows.reshape(-1, 3), pose), paint)


_DRAW: dict[int, Callable[[Any, Pose, Drawing], None]] = {
    Marker.ARROW: _draw_arrow,
    Marker.CUBE: _draw_cube,
    Marker.SPHERE: _draw_sphere,
    Marker.CYLINDER: _draw_cylinder,
    Marker.LINE_STRIP: _draw_strip,
    Marker.LINE_LIST: _draw_list,
    Marker.CUBE_LIST: _draw_cubes,
    Marker.SPHERE_LIST: _draw_spheres,
    Marker.POINTS: _draw_points,
    Marker.TEXT_VIEW_FACING: _draw_text,
    Marker.TRIANGLE_LIST: _draw_triangles,
    Marker.ARROW_STRIP: _draw_arrows,
}
