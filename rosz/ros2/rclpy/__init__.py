"""A small rclpy: ROS 2's Python interface as far as tutorials and simple nodes use it.

Callbacks run while something spins, on the thread that spins. There are no actions, lifecycle
nodes, guard conditions, waitables or event handlers; whatever is not there is an ``AttributeError``
or ``ModuleNotFoundError`` with its name.
"""

from rosz.ros2.rclpy import (
    callback_groups,
    clock,
    context,
    duration,
    exceptions,
    executors,
    logging,
    node,
    parameter,
    qos,
    task,
    time,
    utilities,
)
from rosz.ros2.rclpy.program import (
    create_node,
    get_default_context,
    get_global_executor,
    init,
    ok,
    shutdown,
    spin,
    spin_once,
    spin_until_future_complete,
    try_shutdown,
)
from rosz.ros2.rclpy.task import Future

__all__ = (
    "Future",
    "callback_groups",
    "clock",
    "context",
    "create_node",
    "duration",
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
    "task",
    "time",
    "try_shutdown",
    "utilities",
)
