"""A screen that may take nothing for long, such as a paged or a hung one: nobody waits for it.

A launch has to end nodes, and to start them again, whoever reads what it says.
"""

from __future__ import annotations

import os
import select
import threading
from collections import deque
from collections.abc import Callable
from typing import TextIO

__all__ = ("Screen",)

_USUAL_SECONDS = 0.05
"""How long a text is waited for, so that what nodes write next comes after it."""
_FULL = 1024 * 1024
"""Characters waiting from which on nothing should be added that can wait."""


class Screen:
    """Writes texts in order, on a thread of its own."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._texts: deque[tuple[TextIO, str]] = deque()
        self._waiting = 0
        self._stuck = False
        self._closed = False
        self._told: list[Callable[[], None]] = []
        self._thread: threading.Thread | None = None

    def write(self, stream: TextIO, text: str) -> None:
        """Write a text, now or as soon as the stream takes it."""
        with self._changed:
            if self._closed:
                return
            self._texts.append((stream, text))
            self._waiting += len(text)
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="rosz screen", daemon=True)
                self._thread.start()
            self._changed.notify_all()
            if not self._stuck:
                self._stuck = not self._changed.wait_for(self._written, _USUAL_SECONDS)

    def _written(self) -> bool:
        return not self._texts

    @property
    def full(self) -> bool:
        """Whether what can wait should wait."""
        return self._waiting > _FULL

    def when_free(self, told: Callable[[], None]) -> None:
        """Have something called once, on another thread, when it is not full any more."""
        with self._changed:
            if self.full:
                self._told.append(told)
                return
        told()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._texts or self._closed)
                if not self._texts:
                    return
                stream, text = self._texts[0]
            _put(stream, text)
            told: list[Callable[[], None]] = []
            with self._changed:
                self._texts.popleft()
                self._waiting -= len(text)
                self._stuck = self._stuck and bool(self._texts)
                if not self.full:
                    told, self._told = self._told, []
                self._changed.notify_all()
            for one in told:
                one()

    def close(self, timeout: float) -> None:
        """Write what waits, at most so many seconds, and no more; again is no error."""
        with self._changed:
            self._changed.wait_for(self._written, timeout)
            self._closed = True
            self._changed.notify_all()


def _put(stream: TextIO, text: str) -> None:
    try:
        try:
            fd = stream.fileno()
        except OSError:  # a stream in memory
            stream.write(text)
            return
        # Past the stream's own buffer, whose lock would hold up the end of the process.
        data = memoryview(text.encode(stream.encoding or "utf-8", "backslashreplace"))
        while data:
            try:
                data = data[os.write(fd, data) :]
            except BlockingIOError:
                select.select([], [fd], [])
    except (OSError, ValueError):
        return  # the terminal was closed; ending the nodes in order matters more
