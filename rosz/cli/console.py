"""Output, file writing and stopping of commands."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, TextIO

_LOOK_PERIOD = 0.2
"""Seconds between two looks for signals."""
_SAME_REQUEST_SECONDS = 1.0
_COLORS = {"error": "31", "warning": "33"}


def print_lines(lines: Iterable[str]) -> None:
    """Print lines to standard output, and flush it."""
    sys.stdout.write("".join(f"{line}\n" for line in lines))
    sys.stdout.flush()


def print_json(value: Any) -> None:
    """Print a value as indented JSON."""
    import msgspec

    sys.stdout.write(msgspec.json.format(msgspec.json.encode(value, enc_hook=str)).decode() + "\n")


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
    """Print a line to standard error."""
    sys.stderr.write(f"{text}\n")
    sys.stderr.flush()


def warn(text: str) -> None:
    """Print a warning to standard error."""
    print_error(f"WARNING: {text}")


def count(number: int, word: str) -> str:
    """Return a number with its noun, such as ``2 nodes``."""
    return f"{number} {word}{'' if number == 1 else 's'}"


def paint(text: str, level: str) -> str:
    """Return a text in the color of ``error`` or ``warning``."""
    return f"\033[{_COLORS[level]}m{text}\033[0m"


def takes_escapes(stream: TextIO) -> bool:
    """Return whether a stream is a terminal with colors and a cursor that can be moved."""
    return stream.isatty() and os.environ.get("TERM") != "dumb"


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
