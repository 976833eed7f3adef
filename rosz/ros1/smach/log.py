"""smach.log: where smach writes what it does; ``smach_ros`` sets rospy's log."""

from __future__ import annotations

import sys
from collections.abc import Callable

__all__ = ("logdebug", "logerr", "loginfo", "logwarn", "set_loggers")

Logger = Callable[[str], object]


def _printer(level: str) -> Logger:
    def write(msg: str) -> None:
        sys.stdout.write(f"[{level:^7}] : {msg}\n")

    return write


_loggers: dict[str, Logger] = {
    "info": _printer("INFO"),
    "warn": _printer("WARN"),
    "debug": _printer("DEBUG"),
    "error": _printer("ERROR"),
}


def set_loggers(info: Logger, warn: Logger, debug: Logger, error: Logger) -> None:
    """Replace the functions that write messages, one of each level."""
    _loggers.update(info=info, warn=warn, debug=debug, error=error)


def loginfo(msg: str) -> None:
    """Write a message."""
    _loggers["info"](msg)


def logwarn(msg: str) -> None:
    """Write a warning."""
    _loggers["warn"](msg)


def logdebug(msg: str) -> None:
    """Write a message for debugging."""
    _loggers["debug"](msg)


def logerr(msg: str) -> None:
    """Write an error."""
    _loggers["error"](msg)
