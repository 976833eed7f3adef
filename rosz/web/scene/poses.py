"""Poses, paths, polygons and points; vectors at a frame, and recognised objects."""

from __future__ import annotations

import math
from collections import deque
from typing import Any

import numpy as np

from rosz.transforms import Pose, compose
from rosz.web.scene.drawing import Drawing, color_bytes, matrix_of, moved, placed
from rosz.web.scene.setup import Look
from rosz.web.scene.shapes import draw_arrows, draw_axes, draw_line

_LENGTH = 1.0
_THIN = 0.005
_SHORT = 0.3
_TURNING = "#c9a227"
_KEPT = 100
"""Number of poses of an odometry that stay drawn, as in rviz."""
_STEP, _TURN = 0.1, 0.1
"""Metres and radians that a pose differs from the last one that stays, as in rviz."""
_CLEAR = 180
_COLORS = (
    "#2f6fed",
    "#e0a21a",
    "#1f9d61",
    "#e0483e",
    "#8a4fd0",
    "#0f9bb0",
    "#c13c8b",
    "#8c6d3f",
)
_EDGES = np.array(
    [
        (0, 1), (0, 2), (0, 4), (1, 3), (1, 5), (2, 3),
        (2, 6), (3, 7), (4, 5), (4, 6), (5, 7), (6, 7),
    ]
)  # fmt: skip
_CORNERS = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])


def rotation_from(q: Any) -> tuple[float, float, float, float]:
    """Return a geometry_msgs/Quaternion scaled to length 1; one of length 0 means no rotation."""
    length = math.sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w)
    if not length or not math.isfinite(length):
        return 0.0, 0.0, 0.0, 1.0
    return q.x / length, q.y / length, q.z / length, q.w / length


def pose_from(message: Any) -> Pose:
    """Return the pose of a geometry_msgs/Pose; one without a rotation is not rotated."""
    p = message.position
    return Pose((p.x, p.y, p.z), rotation_from(message.orientation))


def draw_pose(message: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw a Pose as an arrow."""
    length = look.size or _LENGTH
    place = compose(pose, pose_from(message))
    draw_arrows(
        drawing, [matrix_of(place)], color_bytes(look.color), length=length, width=length / 5
    )
    return ", ".join(f"{name} {value:.2f}" for name, value in zip("xyz", place[0], strict=True))


def draw_stamped_pose(message: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw a PoseStamped, PoseWithCovarianceStamped or Odometry as an arrow."""
    inner = message.pose
    if hasattr(inner, "covariance"):
        place = compose(pose, pose_from(inner.pose))
        _draw_covariance(inner.covariance, pose, place, look, drawing)
        inner = inner.pose
    return draw_pose(inner, pose, look, drawing)


class Trail:
    """The poses of an odometry that stay drawn, in the frame of its messages."""

    def __init__(self) -> None:
        self._poses: deque[Pose] = deque(maxlen=_KEPT)
        self._frame = ""

    def add(self, message: Any, keep: int) -> None:
        """Keep the pose of an Odometry if it is another one, and that many; 0 for the default."""
        pose = pose_from(message.pose.pose)
        if self._poses.maxlen != (keep or _KEPT):
            self._poses = deque(self._poses, keep or _KEPT)
        if self._frame != message.header.frame_id:
            self._frame = message.header.frame_id
            self._poses.clear()
        if not all(map(math.isfinite, (*pose.translation, *pose.rotation))):
            return
        if not self._poses or _differ(self._poses[-1], pose):
            self._poses.append(pose)

    def clear(self) -> None:
        """Forget all."""
        self._poses.clear()

    def draw(self, pose: Pose, look: Look, drawing: Drawing) -> int:
        """Draw an arrow for each, and return their number."""
        matrices = [matrix_of(compose(pose, earlier)) for earlier in list(self._poses)]
        length = look.size or _LENGTH
        draw_arrows(drawing, matrices, color_bytes(look.color), length=length, width=length / 5)
        return len(matrices)


def _differ(first: Pose, other: Pose) -> bool:
    along = math.dist(first.translation, other.translation)
    cosine = abs(sum(a * b for a, b in zip(first.rotation, other.rotation, strict=True)))
    return along > _STEP or 2 * math.acos(min(cosine, 1.0)) > _TURN


def draw_cells(message: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw a GridCells as flat rectangles."""
    places = np.array([(p.x, p.y, p.z) for p in message.cells]).reshape(-1, 3)
    local = np.zeros((len(places), 4, 4))
    local[:] = np.diag((message.cell_width, message.cell_height, _THIN, 1.0))
    local[:, :3, 3] = places
    drawing.shapes("cube", matrix_of(pose) @ local, color_bytes(look.color, "#19ff00"))
    return f"{len(places)} cells of {message.cell_width:g} x {message.cell_height:g} m"


def _draw_covariance(
    covariance: Any, pose: Pose, place: Pose, look: Look, drawing: Drawing
) -> None:
    """Draw the positions within one standard deviation, as a flat ellipse."""
    square = np.array([[covariance[0], covariance[1]], [covariance[6], covariance[7]]])
    if not np.isfinite(square).all() or not square.any():
        return
    values, axes = np.linalg.eigh((square + square.T) / 2)
    reach = 2 * np.sqrt(np.clip(values, 0.0, None))
    local = np.eye(4)
    local[:2, 0], local[:2, 1] = axes[:, 0] * reach[0], axes[:, 1] * reach[1]
    local[2, 2] = _THIN
    turned = matrix_of(Pose((0.0, 0.0, 0.0), pose.rotation)) @ local
    turned[:3, 3] = place.translation
    color = color_bytes(look.color)
    color[3] = 70
    drawing.shapes("cylinder", turned, color)


def draw_poses(message: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw a PoseArray as arrows."""
    matrices = [matrix_of(compose(pose, pose_from(member))) for member in message.poses]
    length = look.size or _SHORT
    draw_arrows(drawing, matrices, color_bytes(look.color), length=length, width=length / 4)
    return f"{len(matrices)} poses"


def draw_path(message: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw a Path as a line."""
    positions = [stamped.pose.position for stamped in message.poses]
    points = moved(np.array([(p.x, p.y, p.z) for p in positions]).reshape(-1, 3), pose)
    draw_line(drawing, points, color_bytes(look.color), look.size)
    return f"{len(points)} poses"


def draw_polygon(message: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw a Polygon or PolygonStamped as a closed line."""
    points = getattr(message, "polygon", message).points
    rows = [(p.x, p.y, p.z) for p in (*points, *points[:1])]
    corners = moved(np.array(rows).reshape(-1, 3), pose)
    draw_line(drawing, corners, color_bytes(look.color), look.size)
    return f"{len(points)} points"


def draw_point(message: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw a Point or PointStamped as a sphere."""
    p = getattr(message, "point", message)
    place = compose(pose, Pose((p.x, p.y, p.z), (0.0, 0.0, 0.0, 1.0)))
    size = look.size or 0.2
    drawing.shapes("sphere", placed(place, size, size, size), color_bytes(look.color, "#cc29cc"))
    return ", ".join(f"{name} {value:.2f}" for name, value in zip("xyz", place[0], strict=True))


def draw_pair(
    names: tuple[str, str, str], message: Any, pose: Pose, look: Look, drawing: Drawing
) -> str:
    """Draw two vectors in a field of a message, such as force and torque, in two colors."""
    field, first, second = names
    vectors = getattr(message, field)
    return ", ".join(
        _draw_vector(name, getattr(vectors, name), pose, look, drawing, color)
        for name, color in ((first, look.color or "#cc3333"), (second, _TURNING))
    )


def draw_imu(message: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw an Imu: the axes of its orientation, if it knows one, and its acceleration."""
    if message.orientation_covariance[0] >= 0:
        turned = Pose((0.0, 0.0, 0.0), rotation_from(message.orientation))
        draw_axes(drawing, [compose(pose, turned)], look.size or _LENGTH)
    return _draw_vector("acceleration", message.linear_acceleration, pose, look, drawing, "#cc3333")


def _draw_vector(
    name: str, vector: Any, pose: Pose, look: Look, drawing: Drawing, color: str
) -> str:
    size = look.size or _LENGTH
    ends = moved(np.array([(0.0, 0.0, 0.0), (vector.x, vector.y, vector.z)]) * size, pose)
    draw_line(drawing, ends, color_bytes(color), size / 20)
    return f"{name} {math.hypot(vector.x, vector.y, vector.z):.2f}"


def draw_boxes(message: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw a BoundingBox, or those of a BoundingBoxArray, in the colors of their labels."""
    boxes = getattr(message, "boxes", [message])
    for box in boxes:
        size = box.dimensions
        color = color_bytes(look.color or _COLORS[box.label % len(_COLORS)])
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
