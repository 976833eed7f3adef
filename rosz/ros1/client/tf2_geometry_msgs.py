"""tf2_geometry_msgs: transformed points, poses, vectors and wrenches (ROS wiki).

Each result is in the frame, and has the stamp, of the TransformStamped that is given.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rosz.msgs.geometry_msgs.msg import PointStamped, PoseStamped, Vector3Stamped, WrenchStamped
from rosz.ros1.libraries.PyKDL import Frame, Rotation, Vector
from rosz.transforms import (
    pose_of,
    transform_point,
    transform_pose,
    transform_vector,
    transform_wrench,
)


def to_msg_msg(msg: Any) -> Any:
    """Return a message, which needs no conversion."""
    return msg


from_msg_msg = to_msg_msg


def transform_to_kdl(t: Any) -> Frame:
    """Return a TransformStamped as a frame of PyKDL."""
    p, q = t.transform.translation, t.transform.rotation
    return Frame(Rotation.Quaternion(q.x, q.y, q.z, q.w), Vector(p.x, p.y, p.z))


def do_transform_point(point: PointStamped, transform: Any) -> PointStamped:
    """Transform a point by a TransformStamped."""
    return transform_point(point, pose_of(transform.transform), transform.header)


def do_transform_pose(pose: PoseStamped, transform: Any) -> PoseStamped:
    """Transform a pose by a TransformStamped."""
    return transform_pose(pose, pose_of(transform.transform), transform.header)


def do_transform_vector3(vector3: Vector3Stamped, transform: Any) -> Vector3Stamped:
    """Rotate a vector by a TransformStamped."""
    return transform_vector(vector3, pose_of(transform.transform), transform.header)


def do_transform_wrench(wrench: WrenchStamped, transform: Any) -> WrenchStamped:
    """Rotate a wrench by a TransformStamped."""
    return transform_wrench(wrench, pose_of(transform.transform), transform.header)


TRANSFORMATIONS: dict[type[Any], Callable[..., Any]] = {
    PointStamped: do_transform_point,
    PoseStamped: do_transform_pose,
    Vector3Stamped: do_transform_vector3,
    WrenchStamped: do_transform_wrench,
}
"""The functions by the class of the message."""
