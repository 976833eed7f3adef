"""Reading ahead: items are made on a thread, so that a slow chunk delays no message."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterator
from typing import Generic, TypeVar

from rosz.lifecycle import Closing
from rosz.worker import start_thread

T = TypeVar("T")

_BATCH = 50
_BATCHES = 40
"""Batches that wait at most: some seconds of most robots, and memory for 2000 messages."""
_BYTES = 64 << 20
_FILL_TIMEOUT = 0.2
"""Time to wait for a slow disk, which leaves the processor to others."""


class ReadAhead(Closing, Generic[T]):
    """Iterates over items in batches that a thread has made ahead; each has its size in bytes.

    The iteration raises an exception of the thread, behind the items before it.
    """

    def __init__(self, items: Iterator[tuple[int, T]]) -> None:
        self._items = items
        self._changed = threading.Condition()
        self._ready: deque[tuple[int, list[T]]] = deque()
        self._size = 0
        self._full = False
        self._ended = False
        self._error: Exception | None = None
        start_thread(threading.Thread(target=self._run, name="rosz-read-ahead", daemon=True))

    def _run(self) -> None:
        batch: list[T] = []
        size = 0
        try:
            for more, item in self._items:
                batch.append(item)
                size += more
                if len(batch) >= _BATCH or size >= _BYTES // 8:
                    if not self._put(size, batch):
                        return
                    batch, size = [], 0
        except Exception as error:  # noqa: BLE001  # raised where the items are taken
            self._error = error
        self._put(size, batch)
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def _put(self, size: int, batch: list[T]) -> bool:
        with self._changed:
            if not self._has_room(size):
                self._full = True
                self._changed.notify_all()
                self._changed.wait_for(lambda: self._ended or self._has_room(size))
            self._ready.append((size, batch))
            self._size += size
            self._changed.notify_all()
            return not self._ended

    def _has_room(self, size: int) -> bool:
        waiting = self._size + size
        return not self._ready or (len(self._ready) < _BATCHES and waiting <= _BYTES)

    def fill(self) -> None:
        """Wait until as many items wait as may, since the thread takes the processor meanwhile."""
        with self._changed:
            self._changed.wait_for(lambda: self._full or self._ended, _FILL_TIMEOUT)

    def __iter__(self) -> Iterator[list[T]]:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._ready or self._ended)
                if not self._ready:
                    break
                size, batch = self._ready.popleft()
                self._size -= size
                self._changed.notify_all()
            yield batch
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """End the thread, and drop the items that wait."""
        with self._changed:
            self._ended = True
            self._ready.clear()
            self._changed.notify_all()
