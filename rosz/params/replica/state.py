"""The history of a replica, shared between its threads."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable

from rosz.params.history import History
from rosz.params.merge import Change
from rosz.params.paths import Path
from rosz.params.replica.watch import Callback, Watch, Watchers
from rosz.params.tree import Tree
from rosz.params.writes import DELETED, Write, delete, put
from rosz.session import HybridClock, Stamp

__all__ = ("State", "Step")

Step = tuple[Tree, Tree, list[Write]]
"""A change of the tree: before, after, and the writes that made it."""

_PATIENCE = 0.002


class State:
    """A history behind a lock; its tree is read without.

    Args:
        clock: The session's, which is kept ahead of every write seen.

    Attributes:
        root: The tree now; never changed in place.
        watchers: Who is told of changes.
    """

    def __init__(self, clock: HybridClock) -> None:
        self.root: Tree = {}
        self.watchers = Watchers()
        self._clock = clock
        self._history = History()
        self._lock = threading.Lock()
        self._sinks: tuple[Callable[[list[Write]], None], ...] = ()

    def __len__(self) -> int:
        return len(self._history)

    def feed(self, sink: Callable[[list[Write]], None]) -> None:
        """Have a function given all that is news, in order; it must be quick."""
        self._sinks = (*self._sinks, sink)

    def write(
        self, changes: Iterable[Change], origin: str, stamp: Stamp | None = None
    ) -> tuple[Stamp, Step]:
        """Make writes, under a given stamp, or one that is later than all that was seen.

        Raises:
            ParamError: A change has no meaning in the tree; nothing has changed then.
        """
        with self._lock:
            stamp = stamp or self._clock.now()
            at = (stamp.time, stamp.id)
            writes = [
                delete(path, at, origin) if value is DELETED else put(path, at, value, origin)
                for path, value in changes
            ]
            return stamp, self._apply(writes)

    def apply(self, writes: Iterable[Write]) -> Step:
        """Take in writes of others.

        Raises:
            ParamError: A write has no meaning in the tree; nothing has changed then.
        """
        with self._lock:
            return self._apply(writes)

    def busy(self) -> bool:
        """Tell whether another thread is changing the tree and will be for a while."""
        if self._lock.acquire(timeout=_PATIENCE):
            self._lock.release()
            return False
        return True

    def writes(self) -> list[Write]:
        """Return all writes that are kept."""
        with self._lock:
            return list(self._history.writes())

    def bucket(self, indices: Iterable[int]) -> list[Write]:
        """Return the writes in some buckets of the digest."""
        with self._lock:
            return [write for index in indices for write in self._history.bucket(index)]

    def find(self, path: Path) -> Write | None:
        """Return the write at a path itself."""
        with self._lock:
            return self._history.find(path)

    def hides(self, write: Write) -> bool:
        """Tell whether a write is known, or has a newer one at its path or above."""
        with self._lock:
            return self._history.hides(write)

    def source(self, path: Path) -> Write | None:
        """Return the write that a parameter has its value from."""
        with self._lock:
            return self._history.source(path)

    def digest(self) -> bytes:
        """Return the fingerprint of the history."""
        with self._lock:
            return self._history.digest()

    def differing(self, digest: bytes) -> list[int]:
        """Return the buckets in which a replica with that digest differs.

        Raises:
            DecodeError: The bytes are no digest.
        """
        with self._lock:
            return self._history.differing(digest)

    def forget(self, age: int, keep: int) -> int:
        """Drop deletions older than an age in nanoseconds, or above a number, if not needed."""
        with self._lock:
            return self._history.forget(self._clock.now().time - age, keep)

    def watch(self, path: Path, callback: Callback) -> tuple[Watch, Tree]:
        """Start a watch; return it with the tree that its first change will be a change of."""
        with self._lock:
            return self.watchers.add(path, callback), self.root

    def _apply(self, writes: Iterable[Write]) -> Step:
        old = self.root
        news = self._history.apply(writes)
        self._clock.observe(Stamp(self._history.latest, ""))
        new = self.root = self._history.root
        if news:
            self.watchers.tell(old, new, news)
            for sink in self._sinks:
                sink(news)
        return old, new, news
