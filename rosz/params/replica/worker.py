"""One thread that does, one after the other, what must not be done where it came up."""

from __future__ import annotations

import heapq
import itertools
import logging
import threading
import time
from collections.abc import Callable
from queue import Empty, SimpleQueue

from rosz.errors import ClosedError

__all__ = ("Worker",)

_log = logging.getLogger("rosz.params")
_JOINED_BY = 2.0
_MOST_WAITING = 2000
"""Tasks that may wait before what the network asks is turned away."""

Task = Callable[[], None]


class Worker:
    """A thread with a queue of tasks and a list of tasks for later.

    Args:
        name: Name of the thread.
    """

    def __init__(self, name: str) -> None:
        self._queue: SimpleQueue[tuple[float, Task] | None] = SimpleQueue()
        self._later: list[tuple[float, int, Task]] = []
        self._numbers = itertools.count()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def submit(self, task: Task) -> None:
        """Have a task done as soon as those before it are."""
        self._queue.put((0.0, task))

    def offer(self, task: Task) -> bool:
        """Have a task done for somebody else, unless too many wait already.

        Returns:
            Whether it will be done.
        """
        if self._queue.qsize() >= _MOST_WAITING:
            return False
        self.submit(task)
        return True

    def later(self, seconds: float, task: Task) -> None:
        """Have a task done after a while; what is still to come when it closes is left undone."""
        self._queue.put((time.monotonic() + seconds, task))

    @property
    def pending(self) -> bool:
        """Whether there is more to do at once."""
        return not self._queue.empty()

    @property
    def here(self) -> bool:
        """Whether the caller is a task."""
        return threading.current_thread() is self._thread

    def close(self) -> None:
        """Let the tasks already queued finish, and end; again is no error."""
        if not self._closed:
            self._closed = True
            self._queue.put(None)
        if not self.here:
            self._thread.join(_JOINED_BY)

    def _run(self) -> None:
        while True:
            try:
                entry = self._queue.get(timeout=self._patience())
            except Empty:
                self._run_due()
                continue
            if entry is None:
                return
            due, task = entry
            if due:
                heapq.heappush(self._later, (due, next(self._numbers), task))
            else:
                self._do(task)
            self._run_due()

    def _patience(self) -> float | None:
        return max(0.0, self._later[0][0] - time.monotonic()) if self._later else None

    def _run_due(self) -> None:
        while self._later and self._later[0][0] <= time.monotonic():
            self._do(heapq.heappop(self._later)[2])

    def _do(self, task: Task) -> None:
        try:
            task()
        except ClosedError as error:
            if not self._closed:
                _log.debug("a task of the parameter store came too late: %s", error)
        except Exception:  # noqa: BLE001  # the thread has to outlive any task
            _log.exception("a task of the parameter store failed")
