"""The handlers of a node's log: console, a file of bounded size, ``/rosout``; ROS's severities."""

from __future__ import annotations

import logging
import os
import re
import stat
import sys
import threading
import time
from abc import abstractmethod
from bisect import bisect_right
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from io import FileIO
from pathlib import Path
from typing import TextIO

from rosz.errors import ClosedError, UsageError, near_miss
from rosz.names import printable
from rosz.node.clock import Clock
from rosz.worker import Worker

_NAMES = {10: "DEBUG", 20: "INFO", 30: "WARN", 40: "ERROR", 50: "FATAL"}
"""Severity to name; the numbers are those of rcl_interfaces/Log."""

_LEVELS = tuple(_NAMES)
_BY_NAME = {name: level for level, name in _NAMES.items()} | {"WARNING": 30, "CRITICAL": 50}

DEFAULT_FORMAT = "[${severity}] [${time}]: ${message}"
"""Default of ``ROSCONSOLE_FORMAT``."""

_TOKEN = re.compile(r"\$\{(\w+)(?::([^}]*))?\}")
_RESET = "\033[0m"
_COLORS = {10: "\033[32m", 30: "\033[33m", 40: "\033[31m", 50: "\033[31m"}
_CONTROLS = re.compile(r"\x1b(?!\[[\d;]*m)|\r(?!\n|\Z)|[\0-\x08\x0b\f\x0e-\x1a\x1c-\x1f\x7f-\x9f]")
"""Control characters that do more to a terminal than lines and colours."""
_SECOND = 1_000_000_000

_Part = Callable[[logging.LogRecord, str], str]

MAX_BYTES = 10_000_000
"""Largest size of a log file in bytes, after which a new one is begun."""

BACKUPS = 4
"""Number of full log files to keep."""

_FILE_FORMAT = "[%(name)s][%(levelname)s] %(asctime)s: %(message)s"
_CUT = b" [cut]\n"

_CAPACITY = 1000  # as many lines as the publisher of /rosout keeps for late subscriptions
_DRAIN_TIMEOUT = 1.0

PublishLine = Callable[[int, str, str, str, str, int, int], object]
"""Called with severity, name, message, file, function, line, and stamp in nanoseconds."""

_Line = tuple[int, str, str, str, str, int, int]


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


class LogHandler(logging.Handler):
    """A handler that never raises into the program, and that a signal handler may use.

    A signal handler may log in the middle of a write of the same thread; its record waits until
    that write is done.

    Args:
        on_problem: Function that gets a sentence when records are lost. It must not log at once,
            because the handler is locked meanwhile.
    """

    def __init__(self, on_problem: Callable[[str], object]) -> None:
        super().__init__()
        self._on_problem = on_problem
        self._busy = False
        self._waiting: deque[logging.LogRecord] = deque()

    def emit(self, record: logging.LogRecord) -> None:
        """Write a record, and those that came meanwhile."""
        self._waiting.append(record)
        if self._busy:
            return
        self._busy = True
        try:
            while self._waiting:
                self._write(self._waiting.popleft())
        except Exception:  # noqa: BLE001  # as logging does
            self.handleError(record)
        finally:
            self._busy = False

    @abstractmethod
    def _write(self, record: logging.LogRecord) -> None:
        """Write one record."""


class ConsoleHandler(LogHandler):
    """Write records below a warning to stdout, and the others to stderr.

    The streams are looked up anew for each record, because a program may replace them, and are
    flushed after it. A stream that fails is not used again, and that is logged once.

    Args:
        node: Full name of the node, for ``${node}``.
        clock: Clock of the node, whose time is shown beside wall time while it is simulated.
        on_problem: See `LogHandler`.
        text_format: Format of a line, as in ``ROSCONSOLE_FORMAT``.
        color: Whether to use colours on terminals.
    """

    def __init__(
        self,
        node: str,
        clock: Clock,
        on_problem: Callable[[str], object],
        *,
        text_format: str = DEFAULT_FORMAT,
        color: bool = True,
    ) -> None:
        super().__init__(on_problem)
        self._parts = _compile_format(text_format, node, clock)
        self._color = color
        self._broken: list[TextIO] = []

    def _write(self, record: logging.LogRecord) -> None:
        stream: TextIO | None = sys.stdout if record.levelno < logging.WARNING else sys.stderr
        if stream is None or any(stream is broken for broken in self._broken):
            return
        message = _CONTROLS.sub(lambda match: printable(match[0]), self.format(record))
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
            self._on_problem(f"cannot log to {name}: {error}; what goes there is lost from now on")


def _compile_format(text_format: str, node: str, clock: Clock) -> list[_Part]:
    """Split a format into functions of a record and its message, each for a part of the line.

    The tokens are ROS 1's: ``${severity}``, ``${message}``, ``${time}``, ``${walltime}``, either of
    these with a strftime format as in ``${time:%H:%M}``, ``${thread}``, ``${logger}``, ``${file}``,
    ``${line}``, ``${function}``, ``${node}``. Other text is written as it is.
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
    """Return ROS 1's suffix of wall time in simulation: a comma and ROS time in seconds."""
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


def log_file_name(node: str) -> str:
    """Return the name of a node's log file: ``/ns/talker`` writes ``ns-talker.log``."""
    return f"{node.strip('/').replace('/', '-')}.log"


class FileHandler(LogHandler):
    """Append to a file; rename a full one to ``.1``, the one before that to ``.2``, and so on.

    The file, and its folder, are made with the first record. Each record is handed to the system
    at once, so that nothing is lost when the process is killed. While the file cannot be written,
    records are lost, which is logged once; the next record tries anew. If the file was renamed or
    removed by another process, the next record goes to a new one.

    Args:
        path: The file. If it is not a regular file, such as ``/dev/null``, it is never renamed.
        on_problem: See `LogHandler`.
        max_bytes: Largest size of a file in bytes; a longer record is cut.
        backups: Number of full files to keep.
    """

    def __init__(
        self,
        path: Path,
        on_problem: Callable[[str], object],
        *,
        max_bytes: int = MAX_BYTES,
        backups: int = BACKUPS,
    ) -> None:
        super().__init__(on_problem)
        self.path = path
        self.setFormatter(logging.Formatter(_FILE_FORMAT))
        self._max_bytes = max_bytes
        self._backups = backups
        self._file: FileIO | None = None
        self._size = 0
        self._identity = (0, 0)
        self._regular = True
        self._torn = False
        self._reported = False

    def close(self) -> None:
        """Close the file; a later record opens it again.

        A program that configures logging anew closes all handlers of the process, this one too.
        """
        self.acquire()
        try:
            self._close_file()
        finally:
            self.release()
        super().close()

    def _write(self, record: logging.LogRecord) -> None:
        data = self.format(record).encode("utf-8", "backslashreplace") + b"\n"
        if len(data) > self._max_bytes:
            whole = data[: max(self._max_bytes - len(_CUT), 0)].decode("utf-8", "ignore")
            data = whole.encode() + _CUT
        try:
            self._append(data)
        except OSError as error:
            self._close_file()
            if not self._reported:
                self._reported = True
                self._on_problem(
                    f"cannot write log file '{self.path}': {error.strerror or error};"
                    " the program goes on without it"
                )

    def _append(self, data: bytes) -> None:
        file = self._current() or self._open()
        if self._regular and self._size and self._size + len(data) > self._max_bytes:
            self._close_file()
            self._rotate()
            file = self._open()
        data = b"\n" + data if self._torn else data
        while data:
            self._torn = True
            written = file.write(data)
            data = data[written:]
        self._torn = False

    def _current(self) -> FileIO | None:
        """Return the open file, unless another file or none has its name now."""
        if self._file is not None and self._regular:
            with suppress(FileNotFoundError):
                status = self.path.stat()
                self._size = status.st_size
                if (status.st_dev, status.st_ino) == self._identity:
                    return self._file
            self._close_file()
        return self._file

    def _open(self) -> FileIO:
        with suppress(FileExistsError):  # a file is in the way: the error of opening says more
            self.path.parent.mkdir(parents=True, exist_ok=True)
        self._file = FileIO(self.path, "a")
        status = os.fstat(self._file.fileno())
        self._size = status.st_size
        self._identity = (status.st_dev, status.st_ino)
        self._regular = stat.S_ISREG(status.st_mode)
        return self._file

    def _close_file(self) -> None:
        file, self._file = self._file, None
        if file is not None:
            file.close()

    def _rotate(self) -> None:
        if not self._backups:
            self.path.unlink(missing_ok=True)
        for number in range(self._backups, 0, -1):
            source = self._numbered(number - 1)
            with suppress(FileNotFoundError):
                source.replace(self._numbered(number))

    def _numbered(self, number: int) -> Path:
        return self.path.with_name(f"{self.path.name}.{number}") if number else self.path


class RosoutHandler(logging.Handler):
    """Publish records on ``/rosout``, from a worker.

    Logging waits neither for the network nor for a lock of it that the caller may hold, and a
    signal handler may log. Up to a thousand records wait, also before there is a publisher; more
    are dropped, and the next line tells how many. What publishing itself logs is not published.

    Args:
        name: Name of the node's logger as ROS 2 writes it, such as ``ns.talker``.
        base: Name of the node's logger in records.
        clock: Clock that gives the lines their stamps.
        on_problem: Function that gets a sentence when publishing fails for the first time; it may
            log.

    Attributes:
        names_children: Whether a line of a child logger has its name, as in ROS 2, instead of the
            node's, as in ROS 1.
    """

    def __init__(
        self, name: str, base: str, clock: Clock, on_problem: Callable[[str], object]
    ) -> None:
        super().__init__()
        self._ros_name = name
        self._base = base
        self._clock = clock
        self._on_problem = on_problem
        self.names_children = True
        self._publish: PublishLine | None = None
        self._ready = threading.Event()
        self._dropped = 0
        self._reported = False
        self._worker = Worker(f"rosz-rosout {name}", self._publish_line, capacity=_CAPACITY)

    def handle(self, record: logging.LogRecord) -> bool:
        """Queue a record, unless publishing logs it.

        No lock is held: the queue needs none, and the thread that publishes may hold one.
        """
        if self._worker.is_current:
            return False
        passed = self.filter(record)
        if passed:
            # From Python 3.12 on, a filter may put another record in its place.
            self.emit(passed if isinstance(passed, logging.LogRecord) else record)
        return bool(passed)

    def emit(self, record: logging.LogRecord) -> None:
        """Queue a record."""
        if self._worker.closed:
            return
        if self._worker.full:
            self._dropped += 1
            return
        child = record.name.removeprefix(self._base) if self.names_children else ""
        self._worker.submit(
            (
                severity(record.levelno),
                self._ros_name + child,
                self.format(record),
                record.pathname if self.names_children else record.filename,
                record.funcName or "",
                record.lineno,
                self._clock.now(),
            )
        )

    def publish_to(self, publish: PublishLine) -> None:
        """Begin to publish, with what has been logged so far.

        Args:
            publish: Function that publishes one line; called on the worker.
        """
        if self._publish is not None:
            raise RuntimeError("already publishing")
        self._publish = publish
        self._ready.set()

    def flush(self) -> None:
        """Wait, for a second at most, until what was logged so far is published.

        There is no `close` of its own: a program that configures logging anew closes all handlers
        of the process, and this one must go on then.
        """
        if self._publish is not None:
            self._worker.flush(_DRAIN_TIMEOUT)

    def stop(self) -> None:
        """Publish the rest, for a second at most, and end."""
        self._ready.set()
        self._worker.close(_DRAIN_TIMEOUT)
        super().close()

    def _publish_line(self, line: _Line) -> None:
        self._ready.wait()
        publish = self._publish
        if publish is None:  # the node ended before there was a publisher
            return
        try:
            publish(*line)
            dropped, self._dropped = self._dropped, 0
            if dropped:
                text = (
                    f"{dropped} messages are missing here: more was logged than could be published"
                )
                here = __file__, "_publish_line", 0
                publish(logging.WARNING, self._ros_name, text, *here, self._clock.now())
        except ClosedError:
            return  # the node ended before this began
        except Exception as error:  # noqa: BLE001  # whatever publishing may raise
            if not self._reported and not self._worker.closed:
                self._reported = True
                self._on_problem(f"cannot publish the log on /rosout: {error}")
