"""Loggers of nodes: Python's, with ROS's options, in a tree that is not the process-wide one."""

from __future__ import annotations

import io
import logging
import sys
import traceback
from collections import deque
from collections.abc import Mapping
from types import FrameType, TracebackType
from typing import TypedDict, Unpack, cast

from rosz.node.clock import Clock, nanoseconds
from rosz.node.throttle import Site, Throttle

__all__ = ("LogOptions", "LoggerTree", "NodeLogger")

_ExcInfo = (
    bool
    | BaseException
    | tuple[type[BaseException], BaseException, TracebackType | None]
    | tuple[None, None, None]
    | None
)


class LogOptions(TypedDict, total=False):
    """What any call that logs takes by keyword: Python's own options, and those of ROS.

    Attributes:
        exc_info: An exception to show, or True for the one being handled.
        stack_info: Whether to show the stack.
        stacklevel: How many frames up the message is said to come from; 1 is the caller.
        extra: Attributes for the record.
        once: Whether to log this line of the program only the first time.
        throttle: Seconds that must have passed since this line was last logged.
        throttle_identical: As `throttle`, but another text than the last is always logged.
    """

    exc_info: _ExcInfo
    stack_info: bool
    stacklevel: int
    extra: Mapping[str, object] | None
    once: bool
    throttle: float | None
    throttle_identical: float | None


class NodeLogger(logging.Logger):
    """A logger with what ROS adds: once, throttled, and its names of the levels."""

    manager: LoggerTree

    def __init__(self, name: str, level: int = logging.NOTSET) -> None:
        super().__init__(name, level)
        self._throttle = Throttle()

    def debug(self, msg: object, *args: object, **options: Unpack[LogOptions]) -> None:
        """Log what only developers want to know."""
        if self.isEnabledFor(logging.DEBUG):
            self._log(logging.DEBUG, msg, args, **options)

    def info(self, msg: object, *args: object, **options: Unpack[LogOptions]) -> None:
        """Log what goes as it should."""
        if self.isEnabledFor(logging.INFO):
            self._log(logging.INFO, msg, args, **options)

    def warning(self, msg: object, *args: object, **options: Unpack[LogOptions]) -> None:
        """Log what was not expected, though work goes on."""
        if self.isEnabledFor(logging.WARNING):
            self._log(logging.WARNING, msg, args, **options)

    def error(self, msg: object, *args: object, **options: Unpack[LogOptions]) -> None:
        """Log what failed."""
        if self.isEnabledFor(logging.ERROR):
            self._log(logging.ERROR, msg, args, **options)

    def critical(self, msg: object, *args: object, **options: Unpack[LogOptions]) -> None:
        """Log what the node cannot go on after."""
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
            level: As Python counts them.
            msg: Text, with %-placeholders for `args`; filled in only if it is logged.
            args: For the placeholders.
            options: See `LogOptions`.
        """
        if self.isEnabledFor(level):
            self._log(level, msg, args, **options)

    def report(self, text: str, error: BaseException) -> None:
        """Log an error that was caught, with its traceback."""
        self.error("%s", text, exc_info=error)

    def child(self, name: str) -> NodeLogger:
        """Return the logger of a part of this one, which may have a level of its own.

        Args:
            name: Name below this one's; dots make children of children.
        """
        return cast("NodeLogger", self.manager.getLogger(f"{self.name}.{name}"))

    def handle(self, record: logging.LogRecord) -> None:
        """Fill the message in, once for all handlers, and pass it to them."""
        _fill_in(record)
        super().handle(record)
        self.manager.tell_troubles()

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

    def _elapsed(self, site: Site, seconds: float) -> bool:
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
        self.troubles: deque[str] = deque()

    def tell_troubles(self) -> None:
        """Log what handlers could not say themselves, being locked."""
        while self.troubles:
            try:
                text = self.troubles.popleft()
            except IndexError:  # another thread tells it
                return
            self.base.warning("%s", text)


def _text(msg: object, args: tuple[object, ...] | Mapping[str, object] | None) -> str:
    """Return a message with its arguments filled in, or what is wrong with them."""
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
    """Return the frame of who logs, not counting those of logging itself and of this module."""
    frame = sys._getframe(1)  # noqa: SLF001  # what logging does, too
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
