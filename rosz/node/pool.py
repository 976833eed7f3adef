"""Threads for service calls: started when needed, at most so many, gone when idle."""

from __future__ import annotations

import threading
from collections.abc import Callable
from queue import Empty, SimpleQueue

__all__ = ("Pool",)

_IDLE_SECONDS = 5.0


class Pool:
    """Runs functions on at most ``size`` daemon threads; more have to wait in order.

    Args:
        size: Most threads at one time.
        name: Of the threads, for stack dumps.
    """

    def __init__(self, size: int, name: str) -> None:
        self._size = size
        self._name = name
        self._jobs: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._lock = threading.Lock()
        self._threads = 0
        self._unfinished = 0

    def run(self, job: Callable[[], None]) -> None:
        """Have a function run soon; it must not raise."""
        with self._lock:
            self._jobs.put(job)
            self._unfinished += 1
            # A job may wait for a later one, so each gets a thread as long as there are any left.
            if self._threads >= min(self._unfinished, self._size):
                return
            self._threads += 1
        threading.Thread(target=self._work, name=self._name, daemon=True).start()

    def _work(self) -> None:
        while True:
            try:
                job = self._jobs.get(timeout=_IDLE_SECONDS)
            except Empty:
                with self._lock:
                    if self._jobs.empty():
                        self._threads -= 1
                        return
                continue
            try:
                job()
            finally:
                with self._lock:
                    self._unfinished -= 1
