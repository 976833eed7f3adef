"""The log of all nodes, as published on ``/rosout``: its lines, and its messages in ROS 1.

These are of another type than those of ROS 2.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

import msgspec

from rosz.errors import UsageError
from rosz.msgs.rcl_interfaces.msg import Log
from rosz.msgs.rosgraph_msgs.msg import Log as Ros1Log
from rosz.msgs.std_msgs.msg import Header
from rosz.node import parse_severity, severity_name

LOGS = "/rosout"
"""The topic that nodes log to."""

GATHERED = "/rosout_agg"
"""The topic with the logs of all nodes, in ROS 1."""

_LEVELS = ((10, 1), (20, 2), (30, 4), (40, 8), (50, 16))
"""Levels of ROS 2 and ROS 1, by severity."""


class LogLine(msgspec.Struct, frozen=True):
    """A line of the log.

    Attributes:
        level: ``DEBUG``, ``INFO``, ``WARN``, ``ERROR`` or ``FATAL``.
        stamp: ROS time of the node in seconds since the Unix epoch.
        node: Full name of the node, and the name of its child logger behind a dot.
        text: Text of the line.
        file: Source file.
        line: Line in the source file.
        function: Name of the function.
    """

    level: str
    stamp: float
    node: str
    text: str
    file: str
    line: int
    function: str


def ros1_node(name: str, nodes: Iterable[str]) -> str:
    """Return the name of a logger with the full name of its node in ROS 1's form.

    Args:
        name: Name in ROS 2's form: ``ns.talker.arm`` is the logger arm of node ``/ns/talker``.
        nodes: Full names of the known nodes.
    """
    best = ""
    for node in nodes:
        dotted = node.strip("/").replace("/", ".")
        if f"{name}.".startswith(f"{dotted}.") and len(node) > len(best):
            best = node
    return best + name[len(best) - 1 :] if best else f"/{name}"


def read_line(message: Log, nodes: Iterable[str]) -> LogLine:
    """Return the line in a message of ``/rosout``."""
    return LogLine(
        level=severity_name(max(message.level, 10)),
        stamp=message.stamp.to_sec(),
        node=ros1_node(message.name, nodes),
        text=message.msg,
        file=message.file,
        line=message.line,
        function=message.function,
    )


class LogFilter:
    """A condition on lines of the log.

    Args:
        nodes: Full names of nodes, or namespaces; empty for all.
        level: Lowest level.
        pattern: Regular expression that must match in the text; empty for any text.

    Raises:
        UsageError: The level does not exist, or the pattern is not a regular expression.
    """

    def __init__(self, nodes: Iterable[str] = (), level: str = "DEBUG", pattern: str = "") -> None:
        self._nodes = tuple(nodes)
        self._level = parse_severity(level)
        try:
            self._pattern = re.compile(pattern)
        except re.error as error:
            raise UsageError(f"'{pattern}' is not a regular expression: {error}") from error

    def accepts(self, line: LogLine) -> bool:
        """Return whether a line passes."""
        if parse_severity(line.level) < self._level or not self._pattern.search(line.text):
            return False
        return not self._nodes or any(
            line.node == node or line.node.startswith((f"{node}.", f"{node.rstrip('/')}/"))
            for node in self._nodes
        )


def format_line(line: LogLine, *, verbose: bool = False) -> str:
    """Return a line as text.

    Args:
        line: The line.
        verbose: Whether to add its place in the source.
    """
    text = f"[{line.level}] [{line.stamp:.6f}] [{line.node}]: {line.text}"
    if verbose:
        text += f"\n    at {line.file}:{line.line} in {line.function}"
    return text


def is_log(topic: str, cls: Any) -> bool:
    """Return whether a topic has logs of ROS 2."""
    return topic in (LOGS, GATHERED) and cls._type == Log._type


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


def to_ros2_log(log: Any) -> Log:
    """Return a message of ROS 1 as one of ROS 2."""
    level = next((new for new, old in _LEVELS if old == log.level), _LEVELS[1][0])
    return Log(log.header.stamp, level, log.name, log.msg, log.file, log.function, log.line)
