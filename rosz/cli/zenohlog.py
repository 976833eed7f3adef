"""Summarize what Zenoh logs by itself: each kind of message once per minute.

Zenoh writes to standard output, one line for each attempt to connect that it refuses; and a peer
that is refused tries again five times a second, for days.
"""

from __future__ import annotations

import os
import re
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rosz.cli.console import print_error

__all__ = ("LogSummary", "summarize_zenoh_log")

_COLOUR = re.compile(r"\x1b\[[0-9;]*m")
_LINE = re.compile(r"\S+ +(?:WARN|ERROR) .*?zenoh_link_tls\S*: (?P<reason>.*)")
_MISLEADING = re.compile(r"\.? Hint: .*")
_PROBE = "tls handshake eof"
"""A peer has only probed the port, as a peer with keys does first."""
_NUMBER = re.compile(r"\d+")
_EVERY_SECONDS = 60.0
_KINDS = 100
_STANDARD_OUTPUT = 1


class LogSummary:
    """A summary of Zenoh's log.

    Args:
        write: Function called with each line of the summary.
        clock: Clock in seconds.
    """

    def __init__(
        self, write: Callable[[str], object], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._write = write
        self._clock = clock
        self._seen: dict[str, tuple[float, int]] = {}

    def add(self, line: str) -> None:
        """Write a line, unless one of its kind has been written within a minute."""
        line = _COLOUR.sub("", line).strip()
        match = _LINE.fullmatch(line)
        reason = _MISLEADING.sub("", match["reason"]) if match else line
        if reason == _PROBE:
            return
        kind = _NUMBER.sub("0", reason)
        since, more = self._seen.pop(kind, (-_EVERY_SECONDS, 0))
        now = self._clock()
        if now - since < _EVERY_SECONDS:
            self._seen[kind] = (since, more + 1)
            return
        while len(self._seen) >= _KINDS:
            del self._seen[next(iter(self._seen))]
        self._seen[kind] = (now, 0)
        again = f" ({more} times more since)" if more else ""
        self._write(f"WARNING: a link is refused: {reason}{again}" if match else reason)


@contextmanager
def summarize_zenoh_log() -> Iterator[None]:
    """Write a `LogSummary` of Zenoh's log to standard error, unless ``RUST_LOG`` is set."""
    if "RUST_LOG" in os.environ:
        yield
        return
    before = sys.stdout
    before.flush()
    own = os.dup(_STANDARD_OUTPUT)
    reader, writer = os.pipe()
    os.dup2(writer, _STANDARD_OUTPUT)
    os.close(writer)
    summary = LogSummary(print_error)
    thread = threading.Thread(target=_read, args=(reader, summary), name="rosz-log", daemon=True)
    thread.start()
    sys.stdout = os.fdopen(os.dup(own), "w", buffering=1, encoding=before.encoding)
    try:
        yield
    finally:
        sys.stdout.close()
        sys.stdout = before
        os.dup2(own, _STANDARD_OUTPUT)
        os.close(own)
        thread.join(1)


def _read(reader: int, summary: LogSummary) -> None:
    with os.fdopen(reader, encoding="utf-8", errors="replace") as lines:
        for line in lines:
            summary.add(line)
