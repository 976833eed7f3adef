"""rospy's logging functions, which write to the log of the node (ROS wiki, rospy/Overview/Logging).

Before there is a node they go to Python's logger ``rosout``, as in rospy: warnings and worse reach
stderr. Afterwards what is logged to that logger and those below it becomes the node's, and so does
the level that is set on it.
"""

from __future__ import annotations

import logging
from typing import Any, Protocol

from rosz.ros1.rospy.state import state

__all__ = (
    "DEBUG",
    "ERROR",
    "FATAL",
    "INFO",
    "WARN",
    "logdebug",
    "logdebug_once",
    "logdebug_throttle",
    "logdebug_throttle_identical",
    "logerr",
    "logerr_once",
    "logerr_throttle",
    "logerr_throttle_identical",
    "logfatal",
    "logfatal_once",
    "logfatal_throttle",
    "logfatal_throttle_identical",
    "loginfo",
    "loginfo_once",
    "loginfo_throttle",
    "loginfo_throttle_identical",
    "logout",
    "logwarn",
    "logwarn_once",
    "logwarn_throttle",
    "logwarn_throttle_identical",
)

DEBUG, INFO, WARN, ERROR, FATAL = 1, 2, 4, 8, 16
"""Levels as rosgraph_msgs/Log has them."""

LEVELS = {
    DEBUG: logging.DEBUG,
    INFO: logging.INFO,
    WARN: logging.WARNING,
    ERROR: logging.ERROR,
    FATAL: logging.CRITICAL,
}
"""ROS 1's levels to those of Python."""

_BASE = "rosout"
_CALLER = 3


class _Log(Protocol):
    def __call__(self, msg: object, *args: object, **kwargs: Any) -> None:
        """Log a message."""


class _Throttled(Protocol):
    def __call__(self, period: float, msg: object, *args: object, **kwargs: Any) -> None:
        """Log a message unless it was logged less than so many seconds ago."""


def _write(level: int, msg: object, args: tuple[object, ...], options: dict[str, Any]) -> None:
    """Log for whoever called the function that calls this one."""
    child = options.pop("logger_name", None)
    if state.node is None:
        for only_a_node_has in ("once", "throttle", "throttle_identical"):
            options.pop(only_a_node_has, None)
        plain = logging.getLogger(f"{_BASE}.{child}" if child else _BASE)
        plain.log(level, msg, *args, stacklevel=_CALLER, **options)
        return
    _follow_python()
    log = state.node.log.child(child) if child else state.node.log
    log.log(level, msg, *args, stacklevel=_CALLER, **options)


def _follow_python() -> None:
    """Take over the level that the program has set on Python's logger ``rosout``."""
    level = logging.getLogger(_BASE).level
    if level != state.python_level and state.node is not None:
        state.python_level = level
        state.node.log.setLevel(level)


def _plain(level: int, **fixed: bool) -> _Log:
    def log(msg: object, *args: object, **kwargs: Any) -> None:
        _write(level, msg, args, {**kwargs, **fixed})

    return log


def _throttled(level: int, option: str) -> _Throttled:
    def log(period: float, msg: object, *args: object, **kwargs: Any) -> None:
        _write(level, msg, args, {**kwargs, option: float(period)})

    return log


logdebug = _plain(logging.DEBUG)
loginfo = _plain(logging.INFO)
logwarn = _plain(logging.WARNING)
logerr = _plain(logging.ERROR)
logfatal = _plain(logging.CRITICAL)
logout = loginfo

logdebug_once = _plain(logging.DEBUG, once=True)
loginfo_once = _plain(logging.INFO, once=True)
logwarn_once = _plain(logging.WARNING, once=True)
logerr_once = _plain(logging.ERROR, once=True)
logfatal_once = _plain(logging.CRITICAL, once=True)

logdebug_throttle = _throttled(logging.DEBUG, "throttle")
loginfo_throttle = _throttled(logging.INFO, "throttle")
logwarn_throttle = _throttled(logging.WARNING, "throttle")
logerr_throttle = _throttled(logging.ERROR, "throttle")
logfatal_throttle = _throttled(logging.CRITICAL, "throttle")

logdebug_throttle_identical = _throttled(logging.DEBUG, "throttle_identical")
loginfo_throttle_identical = _throttled(logging.INFO, "throttle_identical")
logwarn_throttle_identical = _throttled(logging.WARNING, "throttle_identical")
logerr_throttle_identical = _throttled(logging.ERROR, "throttle_identical")
logfatal_throttle_identical = _throttled(logging.CRITICAL, "throttle_identical")


class Bridge(logging.Handler):
    """Passes on to the node what the program logs to Python's logger ``rosout`` itself."""

    def emit(self, record: logging.LogRecord) -> None:
        """Hand a record over."""
        node = state.node
        if node is None:
            return
        child = record.name.removeprefix(_BASE).strip(".")
        log = node.log.child(child) if child else node.log
        if log.isEnabledFor(record.levelno):
            log.handle(record)

    @classmethod
    def install(cls, level: int) -> None:
        """Take what comes to ``rosout`` from now on.

        Args:
            level: Least level that the node logs.
        """
        python = logging.getLogger(_BASE)
        if not any(isinstance(handler, cls) for handler in python.handlers):
            python.addHandler(cls())
            python.propagate = False
            if python.level == logging.NOTSET:
                python.setLevel(level)
        state.python_level = python.level
