"""rclpy: the part of ROS 2's Python interface that tutorials and simple nodes use.

Callbacks run while an executor spins, on its thread. Waitables and the events of deadlines and
liveliness are missing: using them raises an error with their name. Submodules of rclpy that share a
file here (``rclpy.publisher``, ``rclpy.duration``, …) are listed in ``rosz.ros1.modules``.
"""

from rosz.ros2.rclpy import context, exceptions, executors, logging, node, parameter, qos, time
from rosz.ros2.rclpy.context import get_default_context
from rosz.ros2.rclpy.executors import Future, get_global_executor
from rosz.ros2.rclpy.parameter import Parameter
from rosz.ros2.rclpy.program import (
    SignalHandlerOptions,
    create_node,
    init,
    ok,
    shutdown,
    spin,
    spin_once,
    spin_until_future_complete,
    try_shutdown,
)

__all__ = (
    "Future",
    "Parameter",
    "SignalHandlerOptions",
    "context",
    "create_node",
    "exceptions",
    "executors",
    "get_default_context",
    "get_global_executor",
    "init",
    "logging",
    "node",
    "ok",
    "parameter",
    "qos",
    "shutdown",
    "spin",
    "spin_once",
    "spin_until_future_complete",
    "time",
    "try_shutdown",
)
