"""Threads for work that takes its time: service calls, connection callbacks."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from queue import SimpleQueue
from typing import Generic, TypeVar

from rosz.session.starting import start

__all__ = ("Jobs", "Pool")

J = TypeVar("J")


class Jobs(Generic[J]):
    """A queue of jobs for a pool.

    Attributes:
        put: Takes a job.
    """

    def __init__(self) -> None:
        self._queue: SimpleQueue[J | None] = SimpleQueue()
        self.put: Callable[[J], None] = self._queue.put

    def take(self) -> J | None:
        """Wait for a job and return it; ``None`` at the end, however often it is asked for."""
        job = self._queue.get()
        if job is None:
            self._queue.put(None)
        return job

    def close(self) -> None:
        """Have it end after what was put until now; again is no error."""
        self._queue.put(None)


class Pool(Generic[J]):
    """At most ``size`` daemon threads that take jobs from somewhere, and work on them in order.

    Who sets out with a job sees to it that somebody else waits for the next. So who brings jobs
    need not know of threads. Threads are started as they are needed, as far as the system has any,
    and stay until the end.

    Args:
        size: Most threads at one time.
        name: Of the threads, for stack dumps.
        take: Waits for a job and returns it; ``None`` at the end, to every thread that asks.
        work: Called with each job; must not raise.
    """

    def __init__(
        self, size: int, name: str, take: Callable[[], J | None], work: Callable[[J], object]
    ) -> None:
        self._size = size
        self._name = name
        self._take = take
        self._work = work
        self._lock = threading.Lock()
        self._threads = 1
        self._idle = 1
        self._start()

    def _start(self) -> bool:
        return start(threading.Thread(target=self._run, name=self._name, daemon=True))

    def _run(self) -> None:
        while (job := self._take()) is not None:
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
        started = False
        with suppress(RuntimeError):  # no more threads: the next job waits for one of these
            started = self._start()
        if not started:
            with self._lock:
                self._threads -= 1
                self._idle -= 1
