"""Messages over pipes that may be slow, or hang: nobody waits for them."""

from __future__ import annotations

import os
import queue
import threading
from collections.abc import Callable
from contextlib import suppress

import msgspec

__all__ = ("Lines", "Outbox")

_CHUNK = 65536
_LONGEST_LINE = 64 * 1024 * 1024
_FULL = 1024 * 1024
"""Bytes waiting from which on nothing should be added that can wait."""


class Outbox:
    """Sends messages in order, on a thread of its own.

    Args:
        fd: Where to; closed in the end.
        freed: Called on that thread when it is no longer full.
    """

    def __init__(self, fd: int, freed: Callable[[], None] = lambda: None) -> None:
        self._fd = fd
        self._freed = freed
        self._lines: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._waiting = 0
        self._encoder = msgspec.json.Encoder()
        self._thread = threading.Thread(target=self._write, name="rosz outbox", daemon=True)
        self._thread.start()

    @property
    def full(self) -> bool:
        """Whether what can wait should wait."""
        with self._lock:
            return self._waiting > _FULL

    def send(self, message: msgspec.Struct) -> None:
        """Send a message as soon as it can be; where nobody reads any more it is lost."""
        line = self._encoder.encode(message) + b"\n"
        with self._lock:
            self._waiting += len(line)
        self._lines.put(line)

    def _write(self) -> None:
        with suppress(OSError):  # the other side is gone, which its end of the other pipe tells
            while (line := self._lines.get()) is not None:
                view = memoryview(line)
                while view:
                    view = view[os.write(self._fd, view) :]
                with self._lock:
                    before = self._waiting > _FULL
                    self._waiting -= len(line)
                    freed = before and self._waiting <= _FULL
                if freed:
                    self._freed()
        with suppress(OSError):
            os.close(self._fd)

    def close(self, timeout: float) -> None:
        """Send what waits, at most so many seconds, and close the pipe; again is no error."""
        self._lines.put(None)
        self._thread.join(timeout)


class Lines:
    """What comes out of a pipe, as lines.

    Args:
        fd: What to read.
    """

    def __init__(self, fd: int) -> None:
        self.fd = fd
        self.ended = False
        self._rest = b""
        os.set_blocking(fd, False)

    def read(self) -> list[bytes]:
        """Return the lines that are there, without waiting; sets `ended` at the end."""
        try:
            data = os.read(self.fd, _CHUNK)
        except BlockingIOError:
            return []
        except OSError:
            data = b""
        if not data:
            self.ended = True
            rest, self._rest = self._rest, b""
            return [rest] if rest else []
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > _LONGEST_LINE:
            lines, self._rest = [*lines, self._rest], b""
        return lines
