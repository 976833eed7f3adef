"""tf2_kdl: vectors, frames, twists and wrenches of PyKDL, also transformed by buffers.

Importing it registers the types for ``Buffer.transform`` and ``tf2_ros.convert``.
"""

from __future__ import annotations

from typing import Any, TypeVar

from rosz.msgs.geometry_msgs.msg import Point, PointStamped
from rosz.ros1.client.tf2_geometry_msgs import transform_to_kdl
from rosz.ros1.client.tf2_ros import ConvertRegistration, Stamped, TransformRegistration
from rosz.ros1.libraries.PyKDL import Frame, Twist, Vector, Wrench

__all__ = (
    "convert_vector",
    "do_transform_frame",
    "do_transform_twist",
    "do_transform_vector",
    "do_transform_wrench",
    "from_msg_vector",
    "to_msg_vector",
    "transform_to_kdl",
)


def do_transform_vector(vector: Vector, transform: Any) -> Vector:
    """Transform a point by a TransformStamped, whose header the result has."""
    return _moved(vector, transform)


def do_transform_frame(frame: Frame, transform: Any) -> Frame:
    """Transform a frame by a TransformStamped, whose header the result has."""
    return _moved(frame, transform)


def do_transform_twist(twist: Twist, transform: Any) -> Twist:
    """Transform a twist by a TransformStamped, whose header the result has."""
    return _moved(twist, transform)


def do_transform_wrench(wrench: Wrench, transform: Any) -> Wrench:
    """Transform a wrench by a TransformStamped, whose header the result has."""
    return _moved(wrench, transform)


_Moved = TypeVar("_Moved", Vector, Frame, Twist, Wrench)


def _moved(value: _Moved, transform: Any) -> _Moved:
    moved: Any = transform_to_kdl(transform) * value
    moved.header = transform.header
    return moved  # type: ignore[no-any-return]


def to_msg_vector(vector: Any) -> PointStamped:
    """Return a vector that has a header as a PointStamped."""
    return PointStamped(vector.header, Point(*vector.numbers))


def from_msg_vector(msg: Any) -> Vector:
    """Return a PointStamped as a vector that has a header."""
    vector = Vector(msg.point.x, msg.point.y, msg.point.z)
    return _stamped(vector, msg.header)


def convert_vector(vector: Any) -> Vector:
    """Return a copy of a vector, with its header."""
    return _stamped(Vector(vector), vector.header)


def _stamped(vector: Vector, header: Any) -> Vector:
    stamped: Vector = Stamped(vector, header.stamp, header.frame_id)
    return stamped


TransformRegistration().add(Vector, do_transform_vector)
TransformRegistration().add(Frame, do_transform_frame)
TransformRegistration().add(Twist, do_transform_twist)
TransformRegistration().add(Wrench, do_transform_wrench)
ConvertRegistration().add_to_msg(Vector, to_msg_vector)
ConvertRegistration().add_from_msg(Vector, from_msg_vector)
ConvertRegistration().add_convert((Vector, Vector), convert_vector)
