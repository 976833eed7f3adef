"""tf2_geometry_msgs: transformed points, poses, vectors and wrenches (ROS wiki)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rosz.msgs.geometry_msgs.msg import (
    Point,
    PointStamped,
    Pose,
    PoseStamped,
    Quaternion,
    Vector3,
    Vector3Stamped,
    Wrench,
    WrenchStamped,
)
from rosz.ros1.PyKDL import Frame, Rotation, Vector
from rosz.transforms import Pose as Plain
from rosz.transforms import compose, pose_of, rotate

__all__ = (
    "TRANSFORMATIONS",
    "do_transform_point",
    "do_transform_pose",
    "do_transform_vector3",
    "do_transform_wrench",
    "from_msg_msg",
    "to_msg_msg",
    "transform_to_kdl",
)


def to_msg_msg(msg: Any) -> Any:
    """Return a message, which needs no conversion."""
    return msg


def from_msg_msg(msg: Any) -> Any:
    """Return a message, which needs no conversion."""
    return msg


def transform_to_kdl(t: Any) -> Frame:
    """Return a TransformStamped as a frame of PyKDL."""
    p, q = t.transform.translation, t.transform.rotation
    return Frame(Rotation.Quaternion(q.x, q.y, q.z, q.w), Vector(p.x, p.y, p.z))


def do_transform_point(point: PointStamped, transform: Any) -> PointStamped:
    """Transform a point by a TransformStamped."""
    p = point.point
    moved = compose(pose_of(transform.transform), Plain((p.x, p.y, p.z), (0.0, 0.0, 0.0, 1.0)))
    return PointStamped(transform.header, Point(*moved.translation))


def do_transform_pose(pose: PoseStamped, transform: Any) -> PoseStamped:
    """Transform a pose by a TransformStamped."""
    p, q = pose.pose.position, pose.pose.orientation
    moved = compose(pose_of(transform.transform), Plain((p.x, p.y, p.z), (q.x, q.y, q.z, q.w)))
    return PoseStamped(
        transform.header, Pose(Point(*moved.translation), Quaternion(*moved.rotation))
    )


def do_transform_vector3(vector3: Vector3Stamped, transform: Any) -> Vector3Stamped:
    """Rotate a vector by a TransformStamped."""
    return Vector3Stamped(transform.header, _rotate(vector3.vector, transform))


def do_transform_wrench(wrench: WrenchStamped, transform: Any) -> WrenchStamped:
    """Rotate a wrench by a TransformStamped."""
    parts = wrench.wrench
    rotated = Wrench(_rotate(parts.force, transform), _rotate(parts.torque, transform))
    return WrenchStamped(transform.header, rotated)


def _rotate(vector: Vector3, transform: Any) -> Vector3:
    rotation = pose_of(transform.transform).rotation
    return Vector3(*rotate(rotation, (vector.x, vector.y, vector.z)))


TRANSFORMATIONS: dict[type[Any], Callable[..., Any]] = {
    PointStamped: do_transform_point,
    PoseStamped: do_transform_pose,
    Vector3Stamped: do_transform_vector3,
    WrenchStamped: do_transform_wrench,
}
"""The functions by the class of the message."""
