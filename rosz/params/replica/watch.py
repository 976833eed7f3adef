"""Telling a program what changed, on a thread that belongs to the replica."""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from types import TracebackType
from typing import Final, Self

import msgspec

from rosz.params.paths import Path, joined
from rosz.params.replica.worker import Worker
from rosz.params.tree import MISSING, Missing, Tree, lookup
from rosz.params.values import Value, copy
from rosz.params.writes import Write

__all__ = ("Changed", "Watch", "Watchers", "same")

_log = logging.getLogger("rosz.params")
_BACKLOG: Final = 1000
"""Changes that may wait for a slow callback; beyond it, only the newest of each path is told."""


class Changed(msgspec.Struct, frozen=True):
    """One change of a parameter, seen from what is watched.

    Attributes:
        name: What changed: the name watched if something at it or above it was written, else the
            name below it that was.
        old: Its value before; ``None`` where it was not set.
        new: Its value now; ``None`` where it is not set any more.
        origin: Who wrote it.
        time: When, in nanoseconds since the epoch, by the writer's clock.
    """

    name: str
    old: Value | None
    new: Value | None
    origin: str
    time: int

    @property
    def deleted(self) -> bool:
        """Whether it is not set any more."""
        return self.new is None


Callback = Callable[[Changed], None]


class Watch:
    """A callback on a name; ends when closed.

    Attributes:
        name: What is watched, with all below it.
    """

    def __init__(self, owner: Watchers, path: Path, callback: Callback) -> None:
        self.name = joined(path)
        self.path = path
        self.callback = callback
        self._owner = owner

    def close(self) -> None:
        """Call back no more; again is no error."""
        self._owner.remove(self)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()


class _Step(msgspec.Struct, frozen=True):
    """A change of the tree."""

    old: Tree
    new: Tree
    writes: tuple[Write, ...]


class Watchers:
    """All watches of one replica, and the thread that calls them back.

    Safe for threads, and for a signal handler that ends a watch.
    """

    def __init__(self) -> None:
        self._watches: tuple[Watch, ...] = ()
        self._steps: deque[_Step] = deque()
        self._lock = threading.RLock()
        self._worker: Worker | None = None
        self._closed = False

    @property
    def active(self) -> bool:
        """Whether there are any."""
        return bool(self._watches)

    def add(self, path: Path, callback: Callback) -> Watch:
        """Call a function back on changes at a path, above it and below it."""
        watch = Watch(self, path, callback)
        with self._lock:
            self._watches = (*self._watches, watch)
            if self._worker is None and not self._closed:
                self._worker = Worker("rosz-params-watch")
        return watch

    def remove(self, watch: Watch) -> None:
        """End a watch."""
        with self._lock:
            self._watches = tuple(other for other in self._watches if other is not watch)

    def tell(self, old: Tree, new: Tree, writes: Iterable[Write]) -> None:
        """Take note of a change; call it in the order of the changes."""
        if not self._watches:
            return
        with self._lock:
            idle = not self._steps
            self._steps.append(_Step(old, new, tuple(writes)))
            if len(self._steps) > _BACKLOG:
                self._steps = deque([_condensed(self._steps)])
            if idle and self._worker is not None:
                self._worker.submit(self._call)

    def close(self) -> None:
        """End all watches; again is no error."""
        with self._lock:
            self._closed = True
            self._watches = ()
            worker, self._worker = self._worker, None
        if worker is not None:
            worker.close()

    def _call(self) -> None:
        with self._lock:
            if not self._steps:
                return
            step = self._steps.popleft()
            watches = self._watches
            if self._steps and self._worker is not None:
                self._worker.submit(self._call)
        for watch in watches:
            for change in _seen_from(watch.path, step):
                if watch in self._watches:
                    self._deliver(watch, change)

    def _deliver(self, watch: Watch, change: Changed) -> None:
        try:
            watch.callback(change)
        except BaseException:  # noqa: BLE001  # a program's own code: it must not end the others' calls
            _log.exception("the callback that watches '%s' failed on '%s'", watch.name, change.name)


def same(left: Value | Missing, right: Value | Missing) -> bool:
    """Tell whether two values are the same to the last type: 1, 1.0 and True are three."""
    if left is right:
        return True
    if type(left) is not type(right):
        return False
    if isinstance(left, dict) and isinstance(right, dict):
        return left.keys() == right.keys() and all(same(left[key], right[key]) for key in left)
    if isinstance(left, list) and isinstance(right, list):
        return len(left) == len(right) and all(map(same, left, right))
    return bool(left == right) or (left != left and right != right)  # noqa: PLR0124  # nan


def _condensed(steps: deque[_Step]) -> _Step:
    newest = {write.path: write for step in steps for write in step.writes}
    return _Step(steps[0].old, steps[-1].new, tuple(newest.values()))


def _seen_from(path: Path, step: _Step) -> Iterator[Changed]:
    depth = len(path)
    told: set[Path] = set()
    for write in step.writes:
        place = write.path if write.path[:depth] == path else path
        if place is path and path[: len(write.path)] != write.path:
            continue
        if place in told:
            continue
        told.add(place)
        old, new = lookup(step.old, place), lookup(step.new, place)
        if not same(old, new):
            yield Changed(joined(place), _shown(old), _shown(new), write.origin, write.time)


def _shown(value: Value | Missing) -> Value | None:
    return None if value is MISSING else copy(value)
