"""The tasks of one client that take long, on threads that all clients of a bridge share."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import TypeAlias

import msgspec

from rosz.bridges.clients.settings import ClientLimits
from rosz.errors import UsageError
from rosz.worker import Worker

Task: TypeAlias = Callable[[], object]

# A client whose calls never end takes 16 of 512 threads; under one limit for all clients together,
# it took every thread.
_AT_ONCE = 16
_THREADS = 512


def task_worker(name: str) -> Worker[Task]:
    """Return the threads for the tasks of all clients."""
    return Worker[Task](name, threads=_THREADS)


class ClientTasks(msgspec.Struct, eq=False):
    """The tasks of one client: calls and goals.

    A few run at once and others wait for their turn, so that calls that do not end leave threads
    for the tasks of other clients.

    Args:
        limit: Largest size of the tasks that have not ended, in bytes.
        limits: The limits on a client.
    """

    _worker: Worker[Task]
    _limit: int
    _limits: ClientLimits = ClientLimits()
    _lock: threading.Lock = msgspec.field(default_factory=threading.Lock)
    _size: int = 0
    _running: int = 0
    _waiting: deque[tuple[Task, int]] = msgspec.field(default_factory=deque)

    def submit(self, task: Task, size: int) -> None:
        """Perform a task on a thread, when its turn comes.

        Args:
            task: The task.
            size: Bytes that it takes until it has ended.

        Raises:
            UsageError: The tasks that have not ended are too many, or too large together.
        """
        with self._lock:
            self._limits.check("calls", self._running + len(self._waiting))
            if self._size and self._size + size > self._limit:
                raise UsageError(
                    f"earlier operations of {self._size} bytes have not ended; wait for answers"
                )
            self._size += size
            self._waiting.append((task, size))
            self._start_next()

    def close(self) -> None:
        """Forget the tasks that wait."""
        with self._lock:
            self._waiting.clear()

    def _start_next(self) -> None:
        if self._waiting and self._running < _AT_ONCE:
            self._running += 1
            self._worker.submit(partial(self._perform, *self._waiting.popleft()))

    def _perform(self, task: Task, size: int) -> None:
        try:
            task()
        finally:
            with self._lock:
                self._size -= size
                self._running -= 1
                self._start_next()
