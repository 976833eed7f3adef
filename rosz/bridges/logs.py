"""The messages of ``/rosout``, which are of other types in ROS 1 and in ROS 2."""

from __future__ import annotations

from typing import Any

from rosz.msgs.rcl_interfaces.msg import Log as Ros2Log
from rosz.msgs.rosgraph_msgs.msg import Log as Ros1Log
from rosz.msgs.std_msgs.msg import Header

LOGS = "/rosout"
"""The topic that nodes log to."""

GATHERED = "/rosout_agg"
"""The topic with the logs of all nodes, in ROS 1."""

_LEVELS = ((10, 1), (20, 2), (30, 4), (40, 8), (50, 16))
"""Levels of ROS 2 and ROS 1, by severity."""


def is_log(topic: str, cls: Any) -> bool:
    """Return whether a topic has logs of ROS 2."""
    return topic in (LOGS, GATHERED) and cls._type == Ros2Log._type


def to_ros1_log(log: Any) -> Ros1Log:
    """Return a message of ROS 2 as one of ROS 1; it does not say what its node publishes."""
    return Ros1Log(
        Header(stamp=log.stamp),
        next((old for new, old in reversed(_LEVELS) if log.level >= new), 1),
        # A logger that has the name of its node comes without the first slash from ROS 2.
        log.name if log.name.startswith("/") else f"/{log.name.replace('.', '/')}",
        log.msg,
        log.file,
        log.function,
        log.line,
    )


def to_ros2_log(log: Any) -> Ros2Log:
    """Return a message of ROS 1 as one of ROS 2."""
    level = next((new for new, old in _LEVELS if old == log.level), _LEVELS[1][0])
    return Ros2Log(log.header.stamp, level, log.name, log.msg, log.file, log.function, log.line)
