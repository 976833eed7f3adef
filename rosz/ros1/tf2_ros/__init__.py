"""tf2_ros: transforms between coordinate frames (ROS wiki, tf2_ros).

``BufferClient`` and ``BufferServer`` are not there.
"""

from rosz.ros1.tf2_ros.buffer import (
    Buffer,
    BufferInterface,
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    StaticTransformBroadcaster,
    TimeoutException,
    TransformBroadcaster,
    TransformException,
    TransformListener,
    TypeException,
)

__all__ = (
    "Buffer",
    "BufferInterface",
    "ConnectivityException",
    "ExtrapolationException",
    "InvalidArgumentException",
    "LookupException",
    "StaticTransformBroadcaster",
    "TimeoutException",
    "TransformBroadcaster",
    "TransformException",
    "TransformListener",
    "TypeException",
)
