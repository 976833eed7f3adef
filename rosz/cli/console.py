"""Output, file writing and stopping of commands."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, Any, TextIO

from rosz.names import printable

if TYPE_CHECKING:
    from rosz.node import Context, MessageInfo

_LOOK_PERIOD = 0.2
"""Seconds between two looks for signals."""
_SAME_REQUEST_SECONDS = 1.0
_COLORS = {"debug": "32", "warn": "33", "warning": "33", "error": "31", "fatal": "31"}


def print_lines(lines: Iterable[str]) -> None:
    """Print lines to standard output, and flush it; control characters are escaped."""
    sys.stdout.write(printable("".join(f"{line}\n" for line in lines)))
    sys.stdout.flush()


def print_json(value: Any) -> None:
    """Print a value as indented JSON."""
    import msgspec

    print_lines([msgspec.json.format(msgspec.json.encode(value, enc_hook=str)).decode()])


def print_json_line(value: Any) -> None:
    """Print a value as JSON on one line, and flush standard output."""
    import msgspec

    print_lines([msgspec.json.encode(value).decode()])


def print_result(lines: Iterable[str], value: Any, *, as_json: bool) -> None:
    """Print lines, or the value that they show as JSON."""
    if as_json:
        print_json(value)
    else:
        print_lines(lines)


def print_error(text: str) -> None:
    """Print a line to standard error; control characters are escaped."""
    sys.stderr.write(printable(f"{text}\n"))
    sys.stderr.flush()


def warn(text: str) -> None:
    """Print a warning to standard error."""
    print_error(f"WARNING: {text}")


def count(number: int, word: str) -> str:
    """Return a number with its noun, such as ``2 nodes``."""
    return f"{number} {word}{'' if number == 1 else 's'}"


def paint(text: str, level: str) -> str:
    """Return a text in the color of a level, such as ``error``, if it has one."""
    return f"\033[{_COLORS[level]}m{text}\033[0m" if level in _COLORS else text


def takes_escapes(stream: TextIO) -> bool:
    """Return whether a stream is a terminal with colors and a cursor that can be moved."""
    return stream.isatty() and os.environ.get("TERM") != "dumb"


class MessagePrinter:
    """Prints messages on the thread of a subscription, while the main thread waits for the end.

    Args:
        to_text: Function that returns the text of a message; None for one that is left out.
        count: Number of texts after which it ends; no limit when not given.
    """

    def __init__(
        self, to_text: Callable[[Any, MessageInfo], str | None], count: int | None = None
    ) -> None:
        import threading

        self._to_text = to_text
        self._left = count or -1  # which is never 0 after a message
        self._ended = threading.Event()
        self._error: Exception | None = None

    def receive(self, message: Any, info: MessageInfo) -> None:
        """Print a message."""
        if self._ended.is_set():
            return
        try:
            text = self._to_text(message, info)
            if text is None:
                return
            sys.stdout.write(text)
            sys.stdout.flush()
        except Exception as error:  # noqa: BLE001  # raised in the main thread
            self._error = error
            self._ended.set()
            return
        self._left -= 1
        if not self._left:
            self._ended.set()

    def wait(self, context: Context, *, timeout: float | None = None, topic: str = "") -> None:
        """Wait for the last message, or for some seconds; then print no more.

        Raises:
            ClosedError: The context is shut down.
            Exception: A message could not be printed.
        """
        from rosz.errors import ClosedError

        withdraw = context.on_shutdown(lambda _: self._ended.set())
        self._ended.wait(timeout)
        self._ended.set()
        withdraw()
        if self._error is not None:
            raise self._error
        if context.is_shutdown:
            reason = context.reason or "shut down"
            raise ClosedError(f"no more of '{topic}': {reason}" if topic else reason)


def write_file(file: str, content: bytes) -> None:
    """Write a file that is named on the command line.

    Raises:
        OSError: The file cannot be written; the error always names it.
    """
    from pathlib import Path

    try:
        Path(file).write_bytes(content)
    except OSError as error:
        error.filename = error.filename or file
        raise


def at_first_signal(action: Callable[[], None]) -> Callable[[int, FrameType | None], None]:
    """Return a handler of signals: the first calls a function, a later one ends the process."""
    import signal
    import time

    first: list[float] = []

    def handle(number: int, _frame: FrameType | None) -> None:
        if not first:
            first.append(time.monotonic())
            action()
        # timeout(1) sends its signal twice; a terminal sends Ctrl-C to all, who may pass it on.
        elif time.monotonic() - first[0] > _SAME_REQUEST_SECONDS:
            signal.signal(number, signal.SIG_DFL)
            signal.raise_signal(number)

    return handle


@contextmanager
def until_stopped() -> Iterator[Callable[[], None]]:
    """Make Ctrl-C and SIGTERM the regular end of a block that runs for ever.

    The block gets a function to call when it is ready. Before that call, the signals end the
    process at once, because an exception that is raised while modules are imported may get lost.
    After it, they raise `KeyboardInterrupt` once: a second one could interrupt the release of a
    lock. A later signal ends the process at once, in case the end takes too long.
    """
    import signal  # imported here, because most commands do not need it

    handled: list[signal.Signals] = []

    def interrupt() -> None:
        raise KeyboardInterrupt

    stop = at_first_signal(interrupt)

    def ready() -> None:
        # Python does not see a signal that comes right before it begins to wait, until the wait
        # ends or another signal interrupts it.
        signal.signal(signal.SIGALRM, lambda *_: None)
        signal.setitimer(signal.ITIMER_REAL, _LOOK_PERIOD, _LOOK_PERIOD)
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) is signal.SIG_DFL:
                handled.append(number)
                signal.signal(number, stop)

    try:
        yield ready
    except KeyboardInterrupt:
        return
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        for number in handled:
            signal.signal(number, signal.SIG_DFL)
