"""What Zenoh logs by itself, as warnings of a command: each kind once in a while.

Zenoh writes to standard output, a line for each attempt of somebody who may not be linked to this
machine; and who is refused tries again five times a second, for days.
"""

from __future__ import annotations

import os
import re
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

__all__ = ("Digest", "zenoh_log_bounded")

_COLOUR = re.compile(r"\x1b\[[0-9;]*m")
_LINE = re.compile(r"\S+ +(?:WARN|ERROR) .*?zenoh_link_tls\S*: (?P<reason>.*)")
_MISLEADING = re.compile(r"\.? Hint: .*")
_LOOKED = "tls handshake eof"
"""Somebody has only looked whether anybody is there, as whoever has keys does first."""
_NUMBER = re.compile(r"\d+")
_EVERY_SECONDS = 60.0
_KINDS = 100
_STANDARD_OUTPUT = 1


class Digest:
    """Lines of Zenoh's log, told in short.

    Args:
        tell: Gets each line that is to be read.
        clock: Seconds.
    """

    def __init__(
        self, tell: Callable[[str], object], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._tell = tell
        self._clock = clock
        self._told: dict[str, tuple[float, int]] = {}

    def take(self, line: str) -> None:
        """Tell of a line, unless another of its kind has been told within a minute."""
        line = _COLOUR.sub("", line).strip()
        match = _LINE.fullmatch(line)
        reason = _MISLEADING.sub("", match["reason"]) if match else line
        if reason == _LOOKED:
            return
        kind = _NUMBER.sub("0", reason)
        since, more = self._told.pop(kind, (-_EVERY_SECONDS, 0))
        now = self._clock()
        if now - since < _EVERY_SECONDS:
            self._told[kind] = (since, more + 1)
            return
        while len(self._told) >= _KINDS:
            del self._told[next(iter(self._told))]
        self._told[kind] = (now, 0)
        again = f" ({more} times more since)" if more else ""
        self._tell(f"WARNING: a link is refused: {reason}{again}" if match else reason)


@contextmanager
def zenoh_log_bounded() -> Iterator[None]:
    """Have what Zenoh logs go to standard error as a `Digest`, unless ``RUST_LOG`` asks for all."""
    if "RUST_LOG" in os.environ:
        yield
        return
    before = sys.stdout
    before.flush()
    own = os.dup(_STANDARD_OUTPUT)
    reader, writer = os.pipe()
    os.dup2(writer, _STANDARD_OUTPUT)
    os.close(writer)
    digest = Digest(lambda line: sys.stderr.write(f"{line}\n"))
    thread = threading.Thread(target=_pass_on, args=(reader, digest), name="rosz-log", daemon=True)
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


def _pass_on(reader: int, digest: Digest) -> None:
    with os.fdopen(reader, encoding="utf-8", errors="replace") as lines:
        for line in lines:
            digest.take(line)
