"""Waiting until every other replica has applied a write."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Collection

__all__ = ("Acks", "Pending")


class Pending:
    """One write on its way.

    Attributes:
        number: Which write of this replica.
        waiting: Sessions that have not acknowledged it yet.
    """

    __slots__ = ("_done", "number", "waiting")

    def __init__(self, number: int, waiting: set[str]) -> None:
        self.number = number
        self.waiting = waiting
        # A bare lock is the cheapest thing to wait on: it is taken here and let go at the end.
        self._done = threading.Lock()
        if waiting:
            self._done.acquire()

    def wait(self, seconds: float) -> bool:
        """Wait until all have acknowledged; tell whether they have."""
        return self._done.acquire(timeout=max(0.0, seconds)) if self.waiting else True

    def drop(self, zid: str) -> None:
        """Wait for a session no longer."""
        if zid in self.waiting:
            self.waiting.discard(zid)
            if not self.waiting:
                self._done.release()


class Acks:
    """All writes of this replica that somebody has still to acknowledge.

    A replica that once did not answer in time is *lagging*: nobody waits for it again until it is
    heard of. Safe for threads, and for a signal handler that writes.
    """

    def __init__(self) -> None:
        self._numbers = itertools.count(1)
        self._pending: dict[int, Pending] = {}
        self._lagging: set[str] = set()
        self._lock = threading.RLock()

    def open(self, zids: Collection[str]) -> Pending:
        """Start waiting for sessions, except for those that lag."""
        with self._lock:
            waiting = {zid for zid in zids if zid not in self._lagging}
            pending = Pending(next(self._numbers), waiting)
            if waiting:
                self._pending[pending.number] = pending
            return pending

    def close(self, pending: Pending) -> frozenset[str]:
        """Stop waiting; return those that did not answer, who lag from now on."""
        with self._lock:
            self._pending.pop(pending.number, None)
            late = frozenset(pending.waiting)
            self._lagging |= late
            return late

    def heard(self, zid: str, number: int) -> None:
        """Take in an acknowledgement."""
        with self._lock:
            self._lagging.discard(zid)
            pending = self._pending.get(number)
            if pending is not None:
                pending.drop(zid)

    def gone(self, zid: str) -> None:
        """Wait no longer for a session that is not there any more."""
        with self._lock:
            self._lagging.discard(zid)
            for pending in self._pending.values():
                pending.drop(zid)

    def give_up(self) -> None:
        """Wait for nobody any more."""
        with self._lock:
            for pending in self._pending.values():
                for zid in tuple(pending.waiting):
                    pending.drop(zid)
