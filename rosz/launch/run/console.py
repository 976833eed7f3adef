"""The launch's own messages: to the screen in roslaunch's words, and to the log of the launch.

A terminal may accept no output for a long time, for example while it is paged. Messages are
therefore written on a thread, and a launch ends and restarts nodes whether or not they are read.
"""

from __future__ import annotations

import faulthandler
import os
import select
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TextIO

from rosz.worker import Worker

_BOLD, _RED, _PLAIN = "\033[1m", "\033[31m", "\033[0m"
_CLOSE_TIMEOUT = 1.0
_WRITE_TIMEOUT = 0.5
"""Time in seconds to wait for a text, so that later output of nodes comes after it."""
_CAPACITY = 1024 * 1024
"""Number of waiting characters at which the writer is full."""


class ConsoleWriter(Worker[tuple[TextIO, str, threading.Event]]):
    """Writes texts to streams in order, on a thread."""

    def __init__(self) -> None:
        super().__init__("rosz console", _write, capacity=_CAPACITY, size=lambda item: len(item[1]))
        self._last = threading.Event()
        self._last.set()
        self._stuck = False

    def write(self, stream: TextIO, text: str) -> None:
        """Write a text, now or as soon as the stream accepts it."""
        if self.closed:
            return
        self._stuck = self._stuck and not self._last.is_set()
        self._last = threading.Event()
        self.submit((stream, text, self._last))
        if not self._stuck:
            self._stuck = not self._last.wait(_WRITE_TIMEOUT)


def _write(item: tuple[TextIO, str, threading.Event]) -> None:
    stream, text, written = item
    try:
        try:
            fd = stream.fileno()
        except OSError:  # a stream in memory
            stream.write(text)
            return
        # Not through the stream's buffer, whose lock would delay the end of the process.
        data = memoryview(text.encode(stream.encoding or "utf-8", "backslashreplace"))
        while data:
            try:
                data = data[os.write(fd, data) :]
            except BlockingIOError:
                select.select([], [fd], [])
    except (OSError, ValueError):
        return  # the terminal is closed; the launch must still end its nodes
    finally:
        written.set()


class LaunchLog:
    """The log file of the launch process itself.

    Raises:
        OSError: If it cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: TextIO | None = path.open("a", encoding="utf-8")

    def write(self, level: str, text: str) -> None:
        """Append a line; a full disk does not stop the launch."""
        if self._file is None:
            return
        try:
            self._file.write(f"[{_timestamp()}] [{level}] {text}\n")
            self._file.flush()
        except OSError:
            self.close()

    def dump_stacks(self, reason: str) -> None:
        """Append the stacks of all threads; safe in a signal handler, even within `write`."""
        if self._file is None:
            return
        fd = self._file.fileno()
        line = f"[{_timestamp()}] [INFO] {reason}; the stacks of all threads:\n"
        try:
            os.write(fd, line.encode())
        except OSError:  # a full disk does not stop the launch
            return
        faulthandler.dump_traceback(fd)

    def close(self) -> None:
        """Close the file; a second call has no effect."""
        file, self._file = self._file, None
        if file is not None:
            with suppress(OSError):  # the disk is full: the lines that were not flushed are lost
                file.close()


class Console:
    """The output streams of a launch, with colours on terminals.

    Attributes:
        log: The log file of the launch, or None.
    """

    def __init__(
        self, out: TextIO, err: TextIO, *, verbose: bool = False, color: bool = True
    ) -> None:
        self._verbose = verbose
        self._color = color
        self._out = out
        self._err = err
        self._writer = ConsoleWriter()
        self.log: LaunchLog | None = None

    @property
    def full(self) -> bool:
        """Whether so much output waits that nodes of other machines should wait."""
        return self._writer.full

    def when_free(self, callback: Callable[[], None]) -> None:
        """Call a function once, here or on another thread, when the console is not full."""
        self._writer.when_free(callback)

    def say(self, text: str = "") -> None:
        """Print a line."""
        self._print(self._out, text, "", "INFO")

    def strong(self, text: str) -> None:
        """Print an important line."""
        self._print(self._out, text, _BOLD, "INFO")

    def error(self, text: str) -> None:
        """Print a line about an error."""
        self._print(self._err, text, _RED, "ERROR")

    def note(self, text: str) -> None:
        """Print a line if the launch is verbose; otherwise only log it."""
        if self._verbose:
            self.say(text)
        elif self.log is not None:
            self.log.write("INFO", text)

    def show(self, sink: int, text: str) -> None:
        """Print output of nodes on another machine, to standard output (1) or error (2)."""
        self._writer.write(self._out if sink == 1 else self._err, text)

    def title(self, text: str) -> None:
        """Set the title of the terminal's window."""
        if self._out.isatty():
            self._writer.write(self._out, f"\033]2;{text}\007")

    def dump_stacks(self, reason: str) -> None:
        """Write the stacks of all threads to the log; safe in a signal handler."""
        if self.log is not None:
            self.log.dump_stacks(reason)

    def close(self) -> None:
        """Print waiting texts, and close the log; a second call has no effect."""
        self._writer.close(_CLOSE_TIMEOUT)
        if self.log is not None:
            self.log.close()

    def _print(self, stream: TextIO, text: str, colour: str, level: str) -> None:
        if text and self.log is not None:
            self.log.write(level, text)
        if colour and self._color and stream.isatty():
            text = f"{colour}{text}{_PLAIN}"
        # One write for each message, so that lines of nodes do not appear within it.
        self._writer.write(stream, f"{text}\n")


def _timestamp() -> str:
    return time.strftime("%Y-%m-%d %H:%M:%S")
