"""rclpy.logging: loggers with rclpy's methods and line format."""

from __future__ import annotations

import logging
import os
import re
import sys
from collections.abc import Callable
from enum import IntEnum
from typing import Any
from weakref import WeakValueDictionary

from rosz.errors import UsageError
from rosz.msgs.rcl_interfaces.msg import LoggerLevel, SetLoggerLevelsResult
from rosz.msgs.rcl_interfaces.srv import GetLoggerLevels, SetLoggerLevels
from rosz.node import (
    Clock,
    ConsoleHandler,
    LogHandler,
    NodeLog,
    NodeLogger,
    severity,
    severity_name,
)

_DEFAULT_FORMAT = "[{severity}] [{time}] [{name}]: {message}"
_TOKEN = re.compile(r"\{(\w+)\}")
_COLORS = {10: "\033[32m", 20: "\033[0m", 30: "\033[33m", 40: "\033[31m", 50: "\033[31m"}
_OPTIONS = frozenset({"throttle_duration_sec", "throttle_time_source_type", "skip_first", "once"})


class LoggingSeverity(IntEnum):
    """Severity of a message."""

    UNSET = 0
    DEBUG = 10
    INFO = 20
    WARN = 30
    ERROR = 40
    FATAL = 50


class RcutilsLogger:
    """A logger with rclpy's methods.

    Args:
        name: Name of the logger, with dots between its parts.
        logger: Logger of the node.
    """

    def __init__(self, name: str, logger: NodeLogger) -> None:
        self.name: str = name
        self._logger = logger
        self._seen: set[tuple[str, int]] = set()

    def get_child(self, name: str) -> RcutilsLogger:
        """Return a child of the logger.

        Raises:
            UsageError: The name is empty.
        """
        if not name:
            raise UsageError("the name of a child logger is empty")
        return RcutilsLogger(f"{self.name}.{name}", self._logger.child(name))

    def set_level(self, level: int) -> None:
        """Log only messages of this severity or a higher one."""
        self._logger.setLevel(int(level))

    def get_effective_level(self) -> LoggingSeverity:
        """Return the lowest severity that is logged."""
        return LoggingSeverity(severity(self._logger.getEffectiveLevel()))

    def is_enabled_for(self, severity: int) -> bool:
        """Return whether messages of a severity are logged."""
        return self._logger.isEnabledFor(int(severity))

    def log(self, message: Any, severity: int, **kwargs: Any) -> bool:
        """Log a message.

        Args:
            message: The text, or an object to convert to text.
            severity: Severity of the message.
            kwargs: ``once=True``, ``skip_first=True``, or ``throttle_duration_sec``, the shortest
                time in seconds between two messages of the same line of the program.

        Returns:
            Whether messages of that severity are logged.

        Raises:
            TypeError: The option does not exist.
        """
        return self._log(int(severity), message, kwargs)

    def debug(self, message: Any, **kwargs: Any) -> bool:
        """Log a message for developers; see `log`."""
        return self._log(10, message, kwargs)

    def info(self, message: Any, **kwargs: Any) -> bool:
        """Log an informational message; see `log`."""
        return self._log(20, message, kwargs)

    def warning(self, message: Any, **kwargs: Any) -> bool:
        """Log a warning; see `log`."""
        return self._log(30, message, kwargs)

    def error(self, message: Any, **kwargs: Any) -> bool:
        """Log an error; see `log`."""
        return self._log(40, message, kwargs)

    def fatal(self, message: Any, **kwargs: Any) -> bool:
        """Log an error that the node cannot recover from; see `log`."""
        return self._log(50, message, kwargs)

    warn = warning

    def _log(self, level: int, message: Any, options: dict[str, Any]) -> bool:
        unknown = options.keys() - _OPTIONS - {"name"}
        if unknown:
            raise TypeError(f"a logger takes no '{min(unknown)}'")
        if not self._logger.isEnabledFor(level):
            return False
        if options.get("skip_first") and self._is_first():
            return True
        once, throttle = bool(options.get("once")), options.get("throttle_duration_sec")
        self._logger.log(level, "%s", message, stacklevel=3, once=once, throttle=throttle)
        return True

    def _is_first(self) -> bool:
        """Return whether the calling line of the program logs for the first time."""
        frame = sys._getframe(3)  # noqa: SLF001  # the caller of `info` and so on
        place = frame.f_code.co_filename, frame.f_lineno
        count = len(self._seen)
        self._seen.add(place)
        return len(self._seen) > count


class _Console(LogHandler):
    """Write lines like rclpy: all to stderr, in the format that the environment sets."""

    def __init__(self, name: str, on_problem: Callable[[str], object], text_format: str) -> None:
        super().__init__(on_problem)
        self._name = name
        self._format = text_format
        setting = os.environ.get("RCUTILS_COLORIZED_OUTPUT", "")
        self._color = (
            sys.stderr is not None and sys.stderr.isatty() if not setting else setting == "1"
        )

    def _write(self, record: logging.LogRecord) -> None:
        stream = sys.stderr
        if stream is None:
            return
        nanoseconds = round(record.created * 1e9)
        values = {
            "severity": severity_name(record.levelno),
            "name": self._name + record.name.removeprefix("rosout"),
            "message": self.format(record),
            "time": f"{nanoseconds // 10**9}.{nanoseconds % 10**9:09d}",
            "time_as_nanoseconds": str(nanoseconds),
            "function_name": record.funcName or "",
            "file_name": record.pathname,
            "line_number": str(record.lineno),
        }
        text = _TOKEN.sub(lambda match: values.get(match[1], match[0]), self._format)
        color = _COLORS[severity(record.levelno)] if self._color else ""
        try:
            stream.write(f"{color}{text}\033[0m\n" if color else f"{text}\n")
            stream.flush()
        except (OSError, ValueError) as error:
            self._on_problem(f"cannot log to the console: {error}")


def write_as_rclpy(log: NodeLog, name: str) -> None:
    """Write the log of a node to the console in rclpy's format, under a name."""
    for handler in list(log.handlers):
        if isinstance(handler, ConsoleHandler):
            log.removeHandler(handler)
    text_format = os.environ.get("RCUTILS_CONSOLE_OUTPUT_FORMAT") or _DEFAULT_FORMAT
    log.addHandler(_Console(name, log.manager.problems.append, text_format))
    _logs[name] = log
    if name in _levels:
        log.setLevel(_levels[name])


_logs: WeakValueDictionary[str, NodeLog] = WeakValueDictionary()
_levels: dict[str, int] = {}


def set_logger_level(name: str, level: int, detailed_error: bool = False) -> None:  # noqa: ARG001
    """Let a logger, also one to come, log only messages of this severity or a higher one."""
    name = name.strip("/").replace("/", ".")
    _levels[name] = int(level)
    if name in _logs:
        _logs[name].setLevel(int(level))


def get_logging_severity_from_string(log_severity: str) -> LoggingSeverity:
    """Return a severity by its name; a `KeyError` if there is none."""
    return LoggingSeverity[log_severity.upper()]


def get_logger(name: str) -> RcutilsLogger:
    """Return a logger without a node, which writes only to the console."""
    log = NodeLog(name, clock=Clock(), rosout=False)
    write_as_rclpy(log, name)
    return RcutilsLogger(name, log)


def serve_logger_levels(node: Any, logger: RcutilsLogger) -> None:
    """Serve ``NODE/get_logger_levels`` and ``NODE/set_logger_levels`` of a node of rclpy.

    Args:
        node: The node.
        logger: Logger of the node; names below its own are those of its children.
    """
    levels: dict[str, int] = {}

    def child(name: str) -> RcutilsLogger | None:
        if name == logger.name:
            return logger
        below = name.removeprefix(f"{logger.name}.")
        return logger.get_child(below) if below != name and below else None

    def get(request: Any, response: Any) -> Any:
        response.levels = [LoggerLevel(name, levels.get(name, 0)) for name in request.names]
        return response

    def set_levels(request: Any, response: Any) -> Any:
        for level in request.levels:
            target = child(level.name)
            if target is None:
                reason = f"node {node.get_fully_qualified_name()} has no logger '{level.name}'"
            elif level.level not in set(LoggingSeverity):
                reason = f"{level.level} is no level; expected 0, 10, 20, 30, 40 or 50"
            else:
                target.set_level(level.level)
                levels[level.name] = level.level
                reason = ""
            response.results.append(SetLoggerLevelsResult(successful=not reason, reason=reason))
        return response

    name = node.get_fully_qualified_name()
    node.create_service(GetLoggerLevels, f"{name}/get_logger_levels", get)
    node.create_service(SetLoggerLevels, f"{name}/set_logger_levels", set_levels)
