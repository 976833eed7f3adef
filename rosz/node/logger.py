"""Loggers of nodes: Python's, with ROS's severities and options, in a tree of their own."""

from __future__ import annotations

import io
import logging
import sys
import threading
import traceback
from bisect import bisect_right
from collections import deque
from collections.abc import Mapping
from types import FrameType, TracebackType
from typing import TypedDict, Unpack, cast

from rosz.errors import UsageError, near_miss
from rosz.node.clock import Clock, nanoseconds

__all__ = (
    "LogOptions",
    "LoggerTree",
    "NodeLogger",
    "parse_severity",
    "severity",
    "severity_name",
)

_NAMES = {10: "DEBUG", 20: "INFO", 30: "WARN", 40: "ERROR", 50: "FATAL"}
"""Severity to name; the numbers are those of rcl_interfaces/Log."""

_LEVELS = tuple(_NAMES)
_BY_NAME = {name: level for level, name in _NAMES.items()} | {"WARNING": 30, "CRITICAL": 50}

_Site = tuple[str, int, int]
"""The place of a call: file, line, and instruction, because two calls may share a line."""

_ExcInfo = (
    bool
    | BaseException
    | tuple[type[BaseException], BaseException, TracebackType | None]
    | tuple[None, None, None]
    | None
)


def severity(level: int) -> int:
    """Return the severity of a logging level: the highest that is not above it."""
    return _LEVELS[max(bisect_right(_LEVELS, level) - 1, 0)]


def severity_name(level: int) -> str:
    """Return ROS's name of a logging level."""
    return _NAMES[severity(level)]


def parse_severity(name: str) -> int:
    """Return the level of a name, ROS's or Python's, in upper or lower case.

    Raises:
        UsageError: No level has that name.
    """
    level = _BY_NAME.get(name.upper())
    if level is None:
        hint = near_miss(name.upper(), _NAMES.values())
        raise UsageError(
            f"'{name}' is not a level: expected one of {', '.join(_NAMES.values())}{hint}"
        )
    return level


class LogOptions(TypedDict, total=False):
    """Keyword options of every call that logs: Python's own, and those of ROS.

    Attributes:
        exc_info: An exception to show, or True for the one being handled.
        stack_info: Whether to show the stack.
        stacklevel: How many frames up the message is said to come from; 1 is the caller.
        extra: Attributes for the record.
        once: Whether to log this line of the program only the first time.
        throttle: Shortest time in seconds between two messages of this line of the program.
        throttle_identical: Like `throttle`, but a text that differs from the last is always logged.
    """

    exc_info: _ExcInfo
    stack_info: bool
    stacklevel: int
    extra: Mapping[str, object] | None
    once: bool
    throttle: float | None
    throttle_identical: float | None


class NodeLogger(logging.Logger):
    """A logger with ROS's additions: messages once or throttled, and its names of the levels."""

    manager: LoggerTree

    def __init__(self, name: str, level: int = logging.NOTSET) -> None:
        super().__init__(name, level)
        self._throttle = _Throttle()

    def debug(self, msg: object, *args: object, **options: Unpack[LogOptions]) -> None:
        """Log a message for developers only."""
        if self.isEnabledFor(logging.DEBUG):
            self._log(logging.DEBUG, msg, args, **options)

    def info(self, msg: object, *args: object, **options: Unpack[LogOptions]) -> None:
        """Log that something works as it should."""
        if self.isEnabledFor(logging.INFO):
            self._log(logging.INFO, msg, args, **options)

    def warning(self, msg: object, *args: object, **options: Unpack[LogOptions]) -> None:
        """Log something unexpected that does not stop the work."""
        if self.isEnabledFor(logging.WARNING):
            self._log(logging.WARNING, msg, args, **options)

    def error(self, msg: object, *args: object, **options: Unpack[LogOptions]) -> None:
        """Log a failure."""
        if self.isEnabledFor(logging.ERROR):
            self._log(logging.ERROR, msg, args, **options)

    def critical(self, msg: object, *args: object, **options: Unpack[LogOptions]) -> None:
        """Log a failure after which the node cannot go on."""
        if self.isEnabledFor(logging.CRITICAL):
            self._log(logging.CRITICAL, msg, args, **options)

    warn = warning
    fatal = critical

    def exception(self, msg: object, *args: object, **options: Unpack[LogOptions]) -> None:
        """Log an error with the exception being handled."""
        options.setdefault("exc_info", True)
        self.error(msg, *args, **options)

    def log(self, level: int, msg: object, *args: object, **options: Unpack[LogOptions]) -> None:
        """Log at any level.

        Args:
            level: Level, as Python counts them.
            msg: Text, with %-placeholders for `args`; filled in only if it is logged.
            args: Values for the placeholders.
            options: Options; see `LogOptions`.
        """
        if self.isEnabledFor(level):
            self._log(level, msg, args, **options)

    def report(self, text: str, error: BaseException) -> None:
        """Log an error that was caught, with its traceback."""
        self.error("%s", text, exc_info=error)

    def child(self, name: str) -> NodeLogger:
        """Return the logger of a part of this one, which may have a level of its own.

        Args:
            name: Name below this logger's; dots make children of children.
        """
        return cast("NodeLogger", self.manager.getLogger(f"{self.name}.{name}"))

    def handle(self, record: logging.LogRecord) -> None:
        """Format the message, once for all handlers, and pass it to them."""
        _fill_in(record)
        super().handle(record)
        self.manager.log_problems()

    def findCaller(  # noqa: N802  # logging's name
        self, stack_info: bool = False, stacklevel: int = 1
    ) -> tuple[str, int, str, str | None]:
        """Return file, line and function of a caller; methods with their class, as ROS 1 does."""
        frame = _caller(stacklevel)
        stack: str | None = None
        if stack_info:
            with io.StringIO() as buffer:
                buffer.write("Stack (most recent call last):\n")
                traceback.print_stack(frame, file=buffer)
                stack = buffer.getvalue().removesuffix("\n")
        return frame.f_code.co_filename, frame.f_lineno, _function_name(frame), stack

    def _log(  # type: ignore[override]  # all its callers pass options by keyword
        self,
        level: int,
        msg: object,
        args: tuple[object, ...],
        *,
        exc_info: _ExcInfo = None,
        extra: Mapping[str, object] | None = None,
        stack_info: bool = False,
        stacklevel: int = 1,
        once: bool = False,
        throttle: float | None = None,
        throttle_identical: float | None = None,
    ) -> None:
        if once or throttle is not None or throttle_identical is not None:
            frame = _caller(stacklevel)
            site = (frame.f_code.co_filename, frame.f_lineno, frame.f_lasti)
            if once and not self._throttle.first(site):
                return
            if throttle is not None and not self._elapsed(site, throttle):
                return
            if throttle_identical is not None:
                elapsed = self._elapsed(site, throttle_identical)
                text = _text(msg, args)
                if not self._throttle.changed(site, text) and not elapsed:
                    return
        super()._log(level, msg, args, exc_info, extra, stack_info, stacklevel)

    def _elapsed(self, site: _Site, seconds: float) -> bool:
        period = nanoseconds(seconds, "throttle")
        return self._throttle.elapsed(site, self.manager.clock.steady(), period)


class LoggerTree(logging.Manager):
    """The loggers of one node."""

    def __init__(self, root: NodeLogger, clock: Clock) -> None:
        super().__init__(root)  # type: ignore[arg-type]  # only its own tree needs a RootLogger
        self.clock = clock
        self.base = root
        self.loggerClass = NodeLogger
        self.loggerDict[root.name] = root
        self.problems: deque[str] = deque()

    def log_problems(self) -> None:
        """Log the problems of handlers, which they cannot log themselves while locked."""
        while self.problems:
            try:
                text = self.problems.popleft()
            except IndexError:  # another thread logs it
                return
            self.base.warning("%s", text)


def _text(msg: object, args: tuple[object, ...] | Mapping[str, object] | None) -> str:
    """Return a message with its arguments filled in, or why that is not possible."""
    if isinstance(args, tuple) and len(args) == 1 and isinstance(args[0], Mapping):
        args = args[0] or args
    try:
        return str(msg) % args if args else str(msg)
    except Exception as error:  # noqa: BLE001  # whatever the objects' own methods raise
        kinds = ", ".join(type(arg).__name__ for arg in args or ())
        text = repr(msg) if isinstance(msg, str) else f"of type {type(msg).__name__}"
        return f"message {text} cannot be filled in with ({kinds}): {error}"


def _fill_in(record: logging.LogRecord) -> None:
    record.msg = _text(record.msg, record.args)
    record.args = None


def _caller(stacklevel: int) -> FrameType:
    """Return the frame of the caller, skipping those of logging itself and of this module."""
    frame = sys._getframe(1)  # noqa: SLF001  # logging does the same
    while frame.f_code.co_filename in _OWN_FILES and frame.f_back is not None:
        frame = frame.f_back
    while stacklevel > 1 and frame.f_back is not None:
        frame = frame.f_back
        stacklevel -= 1
    return frame


def _function_name(frame: FrameType) -> str:
    """Return the name of a function, with its class if it is a method."""
    code = frame.f_code
    if code.co_argcount and code.co_varnames[0] == "self":
        return code.co_qualname.rpartition("<locals>.")[2]
    return code.co_name


_OWN_FILES = frozenset(function.__code__.co_filename for function in (_caller, logging.Logger.info))


class _Throttle:
    """What was logged where and when, to log it once or not too often.

    Any thread, and a signal handler, may call its methods.
    """

    def __init__(self) -> None:
        # A signal handler may interrupt the thread that holds it.
        self._lock = threading.RLock()
        self._seen: set[_Site] = set()
        self._times: dict[_Site, int] = {}
        self._texts: dict[_Site, str] = {}

    def first(self, site: _Site) -> bool:
        """Return whether this is the first call for a place."""
        with self._lock:
            count = len(self._seen)
            self._seen.add(site)
            return len(self._seen) > count

    def elapsed(self, site: _Site, now: int, period_ns: int) -> bool:
        """Return whether the last time is more than a period ago, or later than now.

        Args:
            site: Place of the call.
            now: Time in nanoseconds.
            period_ns: Period in nanoseconds.
        """
        with self._lock:
            last = self._times.get(site)
            if last is not None and last > now:
                self._times.clear()
            elif last is not None and now - last <= period_ns:
                return False
            self._times[site] = now
            return True

    def changed(self, site: _Site, text: str) -> bool:
        """Return whether the text differs from the last one of that place."""
        with self._lock:
            same = self._texts.get(site) == text
            self._texts[site] = text
            return not same
