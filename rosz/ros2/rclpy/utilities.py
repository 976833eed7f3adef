"""rclpy.utilities: bits and pieces of a program."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from rosz.ros2.rclpy.arguments import remove_ros_args as _remove
from rosz.ros2.rclpy.program import get_default_context, ok, shutdown, try_shutdown

__all__ = (
    "get_default_context",
    "get_rmw_implementation_identifier",
    "ok",
    "remove_ros_args",
    "shutdown",
    "try_shutdown",
)


def remove_ros_args(args: Sequence[str] | None = None) -> list[str]:
    """Return a command line without what is ROS's.

    Args:
        args: With the program's name; that of the process when not given.
    """
    return _remove(sys.argv if args is None else args)


def get_rmw_implementation_identifier() -> str:
    """Return the name of the middleware whose wire format is spoken."""
    return "rmw_zenoh_cpp"
