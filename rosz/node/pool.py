"""Threads for what takes its time: service calls, connection callbacks."""

from __future__ import annotations

import threading
from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import Generic, TypeVar

__all__ = ("Pool",)

_IDLE_SECONDS = 5.0
_SPARE = 2
"""Threads that stay however idle: one to set out, and one to wait meanwhile."""

J = TypeVar("J")


class Pool(Generic[J]):
    """A queue, and at most ``size`` daemon threads that work on what is put there, in order.

    Who sets out with a job sees to it that somebody else waits for the next. So who puts jobs need
    not know of threads, and ``put`` runs no Python: it is fit for Zenoh's threads.

    Args:
        size: Most threads at one time.
        name: Of the threads, for stack dumps.
        work: Called with each job; must not raise.

    Attributes:
        put: Takes a job.
    """

    def __init__(self, size: int, name: str, work: Callable[[J], object]) -> None:
        self._size = size
        self._name = name
        self._work = work
        self._jobs: SimpleQueue[J | None] = SimpleQueue()
        self.put: Callable[[J], None] = self._jobs.put
        self._lock = threading.Lock()
        self._threads = 1
        self._idle = 1
        self._start()

    def _start(self) -> None:
        threading.Thread(target=self._run, name=self._name, daemon=True).start()

    def _run(self) -> None:
        while True:
            try:
                job = self._jobs.get(timeout=_IDLE_SECONDS)
            except Empty:
                if self._is_one_too_many():
                    return
                continue
            if job is None:
                self._jobs.put(None)
                return
            self._set_out()
            try:
                self._work(job)
            finally:
                with self._lock:
                    self._idle += 1

    def _set_out(self) -> None:
        """Have another thread wait for the next job, if there may be one."""
        with self._lock:
            self._idle -= 1
            if self._idle or self._threads == self._size:
                return
            self._threads += 1
            self._idle += 1
        self._start()

    def _is_one_too_many(self) -> bool:
        with self._lock:
            if self._idle <= _SPARE:
                return False
            self._idle -= 1
            self._threads -= 1
            return True

    def close(self) -> None:
        """Have the threads end when all that was put until now is done; again is no error."""
        self._jobs.put(None)
