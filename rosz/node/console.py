"""The console of a node: ROS 1's format, colours and choice of stream."""

from __future__ import annotations

import logging
import re
import sys
import time
from collections.abc import Callable
from typing import TextIO

from rosz.node.clock import Clock
from rosz.node.severity import severity, severity_name
from rosz.node.sink import Sink

__all__ = ("DEFAULT_FORMAT", "ConsoleSink", "compile_format")

DEFAULT_FORMAT = "[${severity}] [${time}]: ${message}"
"""What ``ROSCONSOLE_FORMAT`` is when not set."""

_TOKEN = re.compile(r"\$\{(\w+)(?::([^}]*))?\}")
_RESET = "\033[0m"
_COLORS = {10: "\033[32m", 30: "\033[33m", 40: "\033[31m", 50: "\033[31m"}
_SECOND = 1_000_000_000

_Part = Callable[[logging.LogRecord, str], str]


class ConsoleSink(Sink):
    """Write to stdout what is below a warning, and to stderr the rest.

    The streams are looked up anew for each record, so that whoever replaces them gets the text,
    and flushed after it. A stream that breaks is given up, with one word about it.

    Args:
        node: Full name, for ``${node}``.
        clock: Whose time to show beside wall time while simulated.
        on_trouble: See `Sink`.
        text_format: What to write, as in ``ROSCONSOLE_FORMAT``.
        color: Whether to use colours on terminals.
    """

    def __init__(
        self,
        node: str,
        clock: Clock,
        on_trouble: Callable[[str], object],
        *,
        text_format: str = DEFAULT_FORMAT,
        color: bool = True,
    ) -> None:
        super().__init__(on_trouble)
        self._parts = compile_format(text_format, node, clock)
        self._color = color
        self._broken: list[TextIO] = []

    def _write(self, record: logging.LogRecord) -> None:
        stream: TextIO | None = sys.stdout if record.levelno < logging.WARNING else sys.stderr
        if stream is None or any(stream is broken for broken in self._broken):
            return
        message = self.format(record)
        text = "".join([part(record, message) for part in self._parts]) + "\n"
        color = _COLORS.get(severity(record.levelno)) if self._color else None
        try:
            if color and stream.isatty():
                text = f"{color}{text}{_RESET}"
            _write_encodable(stream, text)
            stream.flush()
        except (OSError, ValueError) as error:
            self._broken.append(stream)
            name = getattr(stream, "name", "the console")
            self._on_trouble(f"cannot log to {name}: {error}; what goes there is lost from now on")


def compile_format(text_format: str, node: str, clock: Clock) -> list[_Part]:
    """Split a format into parts that each make a piece of the line.

    The tokens are ROS 1's: ``${severity}``, ``${message}``, ``${time}``, ``${walltime}``, either of
    these with a strftime format as in ``${time:%H:%M}``, ``${thread}``, ``${logger}``, ``${file}``,
    ``${line}``, ``${function}``, ``${node}``. Anything else stands for itself.

    Args:
        text_format: The format.
        node: Full name of the node.
        clock: Its clock.

    Returns:
        Functions of a record and its formatted message.
    """
    tokens: dict[str, _Part] = {
        "severity": lambda record, _: severity_name(record.levelno),
        "message": lambda _, message: message,
        "time": lambda record, _: f"{record.created:f}" + _ros_time(clock),
        "walltime": lambda record, _: f"{record.created:f}",
        "thread": lambda record, _: str(record.thread),
        "logger": lambda record, _: record.name,
        "file": lambda record, _: record.pathname,
        "line": lambda record, _: str(record.lineno),
        "function": lambda record, _: record.funcName or "",
        "node": lambda _record, _: node,
    }
    parts: list[_Part] = []
    end = 0
    for match in _TOKEN.finditer(text_format):
        token, time_format = match.groups()
        part = tokens.get(token)
        if time_format is not None:
            part = _strftime(time_format, clock, token)
        if part is not None:
            parts += [_literal(text_format[end : match.start()]), part]
            end = match.end()
    return [*parts, _literal(text_format[end:])]


def _literal(text: str) -> _Part:
    return lambda _record, _: text


def _strftime(time_format: str, clock: Clock, token: str) -> _Part | None:
    def wall(record: logging.LogRecord, _: str) -> str:
        return time.strftime(time_format, time.localtime(record.created))

    def both(record: logging.LogRecord, message: str) -> str:
        return wall(record, message) + _ros_time(clock)

    return {"walltime": wall, "time": both}.get(token)


def _ros_time(clock: Clock) -> str:
    """Return what ROS 1 puts behind wall time in simulation: a comma and ROS time in seconds."""
    if not clock.simulated:
        return ""
    seconds, nanoseconds = divmod(clock.now(), _SECOND)
    return f", {seconds + nanoseconds / 1e9:f}"


def _write_encodable(stream: TextIO, text: str) -> None:
    try:
        stream.write(text)
    except UnicodeEncodeError:
        encoding = stream.encoding or "ascii"
        stream.write(text.encode(encoding, "backslashreplace").decode(encoding))
