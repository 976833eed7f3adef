"""The log as ROS 1's programs hear it: what is on the wire is ROS 2's message about a log line."""

from __future__ import annotations

from rosz.msgs.rcl_interfaces.msg import Log as Ros2Log
from rosz.msgs.rosgraph_msgs.msg import Log
from rosz.msgs.std_msgs.msg import Header

__all__ = ("Ros2Log", "to_ros1")

_LEVELS = (
    (Ros2Log.FATAL, Log.FATAL),
    (Ros2Log.ERROR, Log.ERROR),
    (Ros2Log.WARN, Log.WARN),
    (Ros2Log.INFO, Log.INFO),
)


def to_ros1(line: Ros2Log) -> Log:
    """Return ROS 1's message about a log line; its node's topics are not known here."""
    level = next((ours for theirs, ours in _LEVELS if line.level >= theirs), Log.DEBUG)
    name = "/" + line.name.lstrip("/").replace(".", "/")
    return Log(
        header=Header(stamp=line.stamp),
        level=level,
        name=name,
        msg=line.msg,
        file=line.file,
        function=line.function,
        line=line.line,
    )
