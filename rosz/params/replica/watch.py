"""Watching parameters: changes of the tree, and the callbacks that are notified of them."""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable, Iterator
from typing import Final

import msgspec

from rosz.lifecycle import Closing
from rosz.params.paths import Path, joined
from rosz.params.replica.core.effects import TreeChanged
from rosz.params.tree import MISSING, Missing, lookup
from rosz.params.values import Value, copy
from rosz.worker import Worker

_log = logging.getLogger("rosz.params")
_MAX_BACKLOG: Final = 1000
"""Changes that wait for a slow callback; of more, only the newest of each path is kept."""


class Changed(msgspec.Struct, frozen=True):
    """One change of a parameter that is watched.

    Attributes:
        name: Name that changed: the name watched if it or a name above it was written, else the
            name below it that was written.
        old: Value before; ``None`` if it was not set.
        new: Value now; ``None`` if it is not set any more.
        origin: Writer, as shown to users.
        time: Time of the write by the writer's clock, in nanoseconds since the epoch.
    """

    name: str
    old: Value | None
    new: Value | None
    origin: str
    time: int

    @property
    def deleted(self) -> bool:
        """Whether the parameter is not set any more."""
        return self.new is None


Callback = Callable[[Changed], None]


class Watch(Closing):
    """A callback on changes of a name; `close` ends it.

    Attributes:
        name: Global name that is watched, with all names below it.
        path: Path of the name.
        callback: Function called with each change.
        on_end: Function called after all changes that one write has made.
    """

    def __init__(self, owner: Watchers, path: Path, callback: Callback) -> None:
        self.name: str = joined(path)
        self.path = path
        self.callback = callback
        self.on_end: Callable[[], object] = lambda: None
        self._owner = owner

    def close(self) -> None:
        """End the watch; a second call has no effect."""
        self._owner.remove(self)


class Watchers:
    """All watches of one copy of the store, and the thread that calls their callbacks.

    Safe for threads, and for a signal handler that ends a watch.
    """

    def __init__(self) -> None:
        self._watches: tuple[Watch, ...] = ()
        self._backlog: deque[TreeChanged] = deque()
        self._lock = threading.RLock()
        self._worker: Worker[Callable[[], object]] | None = None
        self._closed = False

    @property
    def active(self) -> bool:
        """Whether there are watches."""
        return bool(self._watches)

    def add(self, path: Path, callback: Callback) -> Watch:
        """Call a function on changes at a path, above it and below it."""
        watch = Watch(self, path, callback)
        with self._lock:
            self._watches = (*self._watches, watch)
            if self._worker is None and not self._closed:
                self._worker = Worker("rosz-params-watch")
        return watch

    def remove(self, watch: Watch) -> None:
        """End a watch; a second call has no effect."""
        with self._lock:
            self._watches = tuple(other for other in self._watches if other is not watch)

    def notify(self, change: TreeChanged) -> None:
        """Queue a change for the callbacks; must be called in the order of the changes."""
        if not self._watches:
            return
        with self._lock:
            idle = not self._backlog
            self._backlog.append(change)
            if len(self._backlog) > _MAX_BACKLOG:
                self._backlog = deque([_condense(self._backlog)])
            if idle and self._worker is not None:
                self._worker.submit(self._call_next)

    def close(self) -> None:
        """End all watches; a second call has no effect."""
        with self._lock:
            self._closed = True
            self._watches = ()
            worker, self._worker = self._worker, None
        if worker is not None:
            worker.close()

    def _call_next(self) -> None:
        """Call the callbacks for the oldest change."""
        with self._lock:
            if not self._backlog:
                return
            tree_change = self._backlog.popleft()
            watches = self._watches
            if self._backlog and self._worker is not None:
                self._worker.submit(self._call_next)
        for watch in watches:
            for change in _changes_seen(watch.path, tree_change):
                if watch in self._watches:
                    self._call(watch, change)
            watch.on_end()

    def _call(self, watch: Watch, change: Changed) -> None:
        try:
            watch.callback(change)
        except BaseException:  # noqa: BLE001  # callback boundary: the other callbacks go on
            _log.exception("the callback that watches '%s' failed on '%s'", watch.name, change.name)


def is_same(left: Value | Missing, right: Value | Missing) -> bool:
    """Tell whether two values and all their types are equal: 1, 1.0 and True differ."""
    if left is right:
        return True
    if type(left) is not type(right):
        return False
    if isinstance(left, dict) and isinstance(right, dict):
        return left.keys() == right.keys() and all(is_same(left[key], right[key]) for key in left)
    if isinstance(left, list) and isinstance(right, list):
        return len(left) == len(right) and all(map(is_same, left, right))
    return bool(left == right) or (left != left and right != right)  # noqa: PLR0124  # nan


def _condense(changes: deque[TreeChanged]) -> TreeChanged:
    """Return one change with the effect of several: the newest write of each path."""
    newest = {write.path: write for change in changes for write in change.writes}
    return TreeChanged(changes[0].old, changes[-1].new, list(newest.values()))


def _changes_seen(path: Path, change: TreeChanged) -> Iterator[Changed]:
    """Yield the notifications of a watch of a path for a change of the tree."""
    depth = len(path)
    seen: set[Path] = set()
    for write in change.writes:
        place = _changed_place(change, write.path) if write.path[:depth] == path else path
        if place[:depth] != path:
            continue
        if place is path and path[: len(write.path)] != write.path:
            continue
        if place in seen:
            continue
        seen.add(place)
        old, new = lookup(change.old, place), lookup(change.new, place)
        if not is_same(old, new):
            yield Changed(
                joined(place), _copy_or_none(old), _copy_or_none(new), write.origin, write.time
            )


def _changed_place(change: TreeChanged, path: Path) -> Path:
    """Return the path that a write changed: its own, or a leaf above it that is a dict now.

    A deletion turns all above it into dicts, though another has written a leaf there meanwhile.
    """
    place = path
    while place and lookup(change.old, place) is lookup(change.new, place) is MISSING:
        place = place[:-1]
    was_dict = type(lookup(change.old, place)) is dict
    return path if was_dict and type(lookup(change.new, place)) is dict else place


def _copy_or_none(value: Value | Missing) -> Value | None:
    return None if value is MISSING else copy(value)
