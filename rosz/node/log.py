"""A node's log: to the console, a file and ``/rosout``, in a tree of loggers of its own.

The tree is not the process-wide one, so nothing here touches the root logger, or the level,
handlers or flags of any logger of the program. ``logging.disable`` and a ``dictConfig`` of the
program, which by default disables all loggers that it does not name, do not change the log of a
node. Two nodes of one name, in two domains, have a log each.
"""

from __future__ import annotations

import io
import logging
import sys
import threading
import traceback
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from types import FrameType, TracebackType
from typing import Any, TypedDict, Unpack, cast

from rosz.errors import NotFoundError, near_miss
from rosz.node.clock import Clock, nanoseconds
from rosz.node.log_handlers import (
    BACKUPS,
    DEFAULT_FORMAT,
    MAX_BYTES,
    ConsoleHandler,
    FileHandler,
    PublishLine,
    RosoutHandler,
    log_file_name,
    parse_severity,
    severity_name,
)

_BASE = "rosout"

_Site = tuple[str, int, int]
"""The place of a call: file, line, and instruction, because two calls may share a line."""

_ExcInfo = (
    bool
    | BaseException
    | tuple[type[BaseException], BaseException, TracebackType | None]
    | tuple[None, None, None]
    | None
)


class LogOptions(TypedDict, total=False):
    """Keyword options of every call that logs: Python's own, and those of ROS.

    Attributes:
        exc_info: An exception to show, or True for the one being handled.
        stack_info: Whether to show the stack.
        stacklevel: Number of frames up to the one that is shown as the origin; 1 is the caller.
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
        # Times and texts by place; a signal handler may interrupt the thread that holds it.
        self._lock = threading.RLock()
        self._times: dict[_Site, int] = {}
        self._texts: dict[_Site, str] = {}
        self._seen: set[_Site] = set()

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

    # An alias would have an ambiguous type: Python's Logger has two methods, too.
    def warn(self, msg: object, *args: object, **options: Unpack[LogOptions]) -> None:
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
        record.msg, record.args = _text(record.msg, record.args), None
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
        **limits: Any,
    ) -> None:
        if not (limits and self._is_left_out(_caller(stacklevel), msg, args, **limits)):
            super()._log(level, msg, args, exc_info, extra, stack_info, stacklevel)

    def _is_left_out(
        self,
        frame: FrameType,
        msg: object,
        args: tuple[object, ...],
        *,
        once: bool = False,
        throttle: float | None = None,
        throttle_identical: float | None = None,
    ) -> bool:
        site = (frame.f_code.co_filename, frame.f_lineno, frame.f_lasti)
        # Before the lock: an argument may log while it is formatted.
        text = "" if throttle_identical is None else _text(msg, args)
        with self._lock:
            if once:
                if site in self._seen:
                    return True
                self._seen.add(site)
            if throttle is not None and not self._elapsed(site, throttle):
                return True
            if throttle_identical is None:
                return False
            elapsed = self._elapsed(site, throttle_identical)
            last, self._texts[site] = self._texts.get(site), text
            return last == text and not elapsed

    def _elapsed(self, site: _Site, seconds: float) -> bool:
        """Return whether the last time is more than a period ago, or later than now."""
        period, now = nanoseconds(seconds, "throttle"), self.manager.clock.steady()
        last = self._times.get(site)
        if last is not None and last > now:
            self._times.clear()
        elif last is not None and now - last <= period:
            return False
        self._times[site] = now
        return True


class LoggerTree(logging.Manager):
    """The loggers of one node."""

    def __init__(self, root: NodeLogger, clock: Clock) -> None:
        super().__init__(root)  # type: ignore[arg-type]  # only its own tree needs a RootLogger
        self.clock = clock
        self.base = root
        self.loggerClass: type[NodeLogger] = NodeLogger
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


class NodeLog(NodeLogger):
    """The log of a node: a logger that writes to console, file and ``/rosout``.

    Its name in records is ``rosout``, as in ROS 1, and that of a child ``rosout.child``.

    Args:
        node: Full name of the node.
        clock: Clock of the node.
        log_dir: Folder for the log file; no file when not given.
        file_name: Log file to use instead of one named after the node in `log_dir`.
        console: Whether to write to the console.
        console_format: Format of a line, as in ``ROSCONSOLE_FORMAT``.
        color: Whether to use colours on terminals.
        rosout: Whether to keep lines for ``/rosout``.
        level: Lowest level that is logged.
        max_bytes: Largest size of a log file in bytes.
        backups: Number of full log files to keep.
    """

    def __init__(
        self,
        node: str,
        *,
        clock: Clock,
        log_dir: Path | None = None,
        file_name: str = "",
        console: bool = True,
        console_format: str = DEFAULT_FORMAT,
        color: bool = True,
        rosout: bool = True,
        level: int = logging.INFO,
        max_bytes: int = MAX_BYTES,
        backups: int = BACKUPS,
    ) -> None:
        super().__init__(_BASE, level)
        self.manager: LoggerTree = LoggerTree(self, clock)
        self.node = node
        self._ros_name = node.strip("/").replace("/", ".")
        self._file: FileHandler | None = None
        self._rosout: RosoutHandler | None = None
        self.addHandler(logging.NullHandler())
        report = self.manager.problems.append
        if console:
            self.addHandler(
                ConsoleHandler(node, clock, report, text_format=console_format, color=color)
            )
        path = Path(file_name).absolute() if file_name else None
        if path is None and log_dir is not None:
            path = log_dir / log_file_name(node)
        if path is not None:
            self._file = FileHandler(path, report, max_bytes=max_bytes, backups=backups)
            self.addHandler(self._file)
        if rosout:
            self._rosout = RosoutHandler(
                self._ros_name, _BASE, clock, lambda text: self.warning("%s", text)
            )
            self.addHandler(self._rosout)

    @property
    def file(self) -> Path | None:
        """The log file, which is made with the first message; None without one."""
        return None if self._file is None else self._file.path

    def publish_to(self, publish: PublishLine) -> None:
        """Begin to publish on ``/rosout``, with what was logged so far; once only.

        Args:
            publish: Function called on a thread of the log, one line at a time, with severity
                (the number in rcl_interfaces/Log), name of the logger as in ROS 2, message, file,
                function, line, and ROS time in nanoseconds. It may block, and log.
        """
        if self._rosout is not None:
            self._rosout.publish_to(publish)

    def publish_as_ros1(self) -> None:
        """Publish as ROS 1 does: child loggers have the name of the node, files no folder."""
        if self._rosout is not None:
            self._rosout.names_children = False

    def flush(self) -> None:
        """Wait, for a second at most, until what was logged is published on ``/rosout``."""
        if self._rosout is not None:
            self._rosout.flush()

    def get_levels(self) -> dict[str, str]:
        """Return the level in effect, such as ``INFO``, of each logger of the node."""
        return {
            name: severity_name(logger.getEffectiveLevel())
            for name, logger in sorted(self._loggers().items())
        }

    def set_level(self, name: str, level: str) -> None:
        """Set the level of a logger of the node, and of its children that have none of their own.

        Args:
            name: ``rosout``, as in ROS 1, an empty text, or the node's name with dots, as in ROS 2,
                for the node itself; ``rosout.child``, ``node.child`` or ``child`` for a part of it.
            level: ``DEBUG``, ``INFO``, ``WARN``, ``ERROR`` or ``FATAL``, in any case.

        Raises:
            NotFoundError: The node has no such logger.
            UsageError: The level does not exist.
        """
        loggers = self._loggers()
        is_ros_name = f"{name}.".startswith(f"{self._ros_name}.")
        local = name.removeprefix(self._ros_name).strip(".") if is_ros_name else name
        logger = loggers.get(local or _BASE) or loggers.get(f"{_BASE}.{local}")
        if logger is None:
            names = ", ".join(sorted(loggers))
            hint = near_miss(name, loggers)
            raise NotFoundError(
                f"{self.node} has no logger '{name}': expected one of {names}{hint}"
            )
        logger.setLevel(parse_severity(level))

    def close(self) -> None:
        """Publish the rest, for a second at most, and close the file; the console stays open."""
        if self._rosout is not None:
            self.removeHandler(self._rosout)
            self._rosout.stop()
        if self._file is not None:
            self.removeHandler(self._file)
            self._file.close()

    def _loggers(self) -> dict[str, logging.Logger]:
        return {
            name: logger
            for name, logger in list(self.manager.loggerDict.items())
            if isinstance(logger, logging.Logger)
        }
