"""The history of a replica, shared between its threads."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from types import TracebackType
from typing import Final

from msgspec import structs

from rosz.errors import DecodeError, ParamError
from rosz.params.history import History
from rosz.params.keys import check_reach
from rosz.params.merge import Change
from rosz.params.paths import ROOT, Path
from rosz.params.replica.complaints import AHEAD, NO_PARAMETER, SAVED_AHEAD, Complaints
from rosz.params.replica.watch import Callback, Watch, Watchers
from rosz.params.tree import Tree
from rosz.params.wire import Batch, decode, unseal
from rosz.params.writes import DELETED, Write, check_time, delete, put
from rosz.session import HybridClock, Stamp

__all__ = ("State", "Step")

Step = tuple[Tree, Tree, list[Write]]
"""A change of the tree: before, after, and the writes that made it."""

_PATIENCE: Final = 0.002
_MOST_UNREAD: Final = 64
"""Messages that may wait to be read: what a read has to do at most before it returns."""

_INTERRUPTED: Final = (
    "a signal handler interrupted its thread at work on the parameters, and cannot work on them"
    " itself: have it start a thread that does"
)


class State:
    """A history behind a lock; its tree is read without.

    Messages of others are only noted as they arrive, and read when somebody looks at the tree: a
    process that nobody asks costs the writers next to nothing, and who asks gets what is newest.

    A signal handler may interrupt its own thread at work on the history, half of which is changed
    then. It sees the tree as it was before, and is refused all else.

    Args:
        clock: The session's, which is kept ahead of all writes seen whenever it is asked.

    Attributes:
        watchers: Who is told of changes.
        complaints: What was said of damage.
    """

    def __init__(self, clock: HybridClock) -> None:
        self.watchers = Watchers()
        self.complaints = Complaints()
        self._root: Tree = {}
        self._clock = clock
        self._history = History()
        self._lock = threading.RLock()
        self._holder = 0
        self._current = _Current(self)
        self._sinks: tuple[Callable[[list[Write]], None], ...] = ()
        self._unread: deque[tuple[bytes, Path]] = deque()
        self._reading = False

    def __len__(self) -> int:
        with self._current:
            return len(self._history)

    @property
    def root(self) -> Tree:
        """The tree now; never changed in place."""
        # Set before the last message is taken from the queue, so that one of the two always tells.
        if self._unread or self._reading:
            self.read()
        return self._root

    def read(self) -> None:
        """Apply what was noted, unless the same thread is at work on the history already."""
        if self._holder != threading.get_ident():
            with self._current:
                pass

    def note(self, message: bytes, reach: Path = ROOT) -> bool:
        """Take in a message of another replica, sealed, in next to no time.

        Args:
            message: It.
            reach: The path that all that it writes has to lie at or below.

        Returns:
            Whether that is all; if not, somebody waits for it and it has to be applied at once.
        """
        if self._is_followed() or len(self._unread) >= _MOST_UNREAD:
            return False
        self._unread.append((message, reach))
        # Whoever began to follow meanwhile may have read what was there before this.
        return not self._is_followed()

    def feed(self, sink: Callable[[list[Write]], None]) -> None:
        """Have a function given all that is news, in order; it must be quick."""
        with self._current:
            self._sinks = (*self._sinks, sink)

    def write(
        self, changes: Iterable[Change], origin: str, stamp: Stamp | None = None
    ) -> tuple[Stamp, Step]:
        """Make writes, under a given stamp, or one that is later than all that was seen.

        Raises:
            ParamError: A change has no meaning in the tree; nothing has changed then.
            DecodeError: The stamp given lies years ahead; nothing has changed then.
        """
        with self._current:
            given, stamp = stamp, stamp or self._now()
            at = (stamp.time, stamp.id)
            writes = [
                delete(path, at, origin) if value is DELETED else put(path, at, value, origin)
                for path, value in changes
            ]
            if given is not None:
                now = time.time_ns()
                for write in writes:
                    check_time(write, now)
            return stamp, self._apply(writes)

    def apply(self, writes: Iterable[Write]) -> Step:
        """Take in writes of others, except for those stamped years ahead.

        Raises:
            ParamError: A write has no meaning in the tree; nothing has changed then.
        """
        with self._current:
            return self._apply(self._parted(writes, AHEAD)[0])

    def restore(self, writes: Iterable[Write]) -> bool:
        """Take in writes that were saved; those stamped years ahead as if they were made now.

        Returns:
            Whether there were such.

        Raises:
            ParamError: A write has no meaning in the tree.
        """
        with self._current:
            sound, ahead = self._parted(writes, SAVED_AHEAD)
            self._apply(sound)
            for write in sorted(ahead, key=lambda write: write.order):
                now = self._now()
                self._apply([structs.replace(write, time=now.time, clock=now.id)])
            return bool(ahead)

    def take(self, message: bytes, reach: Path = ROOT) -> None:
        """Apply a message of another replica, sealed; the arguments are those of `note`."""
        with self._current:
            self._take(message, reach)

    def take_soon(self, message: bytes, reach: Path = ROOT) -> bool:
        """Apply a message of another replica, unless somebody is at work on the history just now.

        Returns:
            Whether it is done; if not, use `take` where waiting does no harm.
        """
        if not self.enter(_PATIENCE):
            return False
        try:
            self._take(message, reach)
        finally:
            self.leave()
        return True

    def stamp(self) -> Stamp:
        """Return a stamp that is later than all that was seen."""
        with self._current:
            return self._now()

    def writes(self) -> list[Write]:
        """Return all writes that are kept."""
        with self._current:
            return list(self._history.writes())

    def bucket(self, indices: Iterable[int]) -> list[Write]:
        """Return the writes in some buckets of the digest."""
        with self._current:
            return [write for index in indices for write in self._history.bucket(index)]

    def find(self, path: Path) -> Write | None:
        """Return the write at a path itself."""
        with self._current:
            return self._history.find(path)

    def hides(self, write: Write) -> bool:
        """Tell whether a write is known, or has a newer one at its path or above."""
        with self._current:
            return self._history.hides(write)

    def source(self, path: Path) -> Write | None:
        """Return the write that a parameter has its value from."""
        with self._current:
            return self._history.source(path)

    def digest(self) -> bytes:
        """Return the fingerprint of the history."""
        with self._current:
            return self._history.digest()

    def differing(self, digest: bytes) -> list[int]:
        """Return the buckets in which a replica with that digest differs.

        Raises:
            DecodeError: The bytes are no digest.
        """
        with self._current:
            return self._history.differing(digest)

    def forget(self, age: int, keep: int) -> int:
        """Drop deletions older than an age in nanoseconds, or above a number, if not needed."""
        with self._current:
            return self._history.forget(self._now().time - age, keep)

    def watch(self, path: Path, callback: Callback) -> Watch:
        """Start a watch, which hears of all that comes from now on."""
        with self._current:
            return self.watchers.add(path, callback)

    def enter(self, timeout: float = -1) -> bool:
        """Begin to work on the history; nobody else does until `leave`.

        Args:
            timeout: Seconds to wait for others to leave; for ever if negative.

        Returns:
            Whether it is so; false when the time was over.

        Raises:
            ParamError: The same thread is at work on it already, below a signal handler.
        """
        if not self._lock.acquire(timeout=timeout):
            return False
        if self._holder == threading.get_ident():
            self._lock.release()
            raise ParamError(_INTERRUPTED)
        self._holder = threading.get_ident()
        try:
            if self._unread:
                self._reading = True
                while self._unread:
                    self._take(*self._unread.popleft())
                self._reading = False
        except BaseException:  # Ctrl-C comes anywhere
            self._reading = False
            self.leave()
            raise
        return True

    def leave(self) -> None:
        """End what `enter` began."""
        self._holder = 0
        self._lock.release()

    def _is_followed(self) -> bool:
        return bool(self._sinks) or self.watchers.active

    def _take(self, message: bytes, reach: Path) -> None:
        try:
            start = unseal(message)[2]
            writes = decode(memoryview(message)[start:], Batch).writes()
            check_reach((write.path for write in writes), reach)
            self._apply(self._parted(writes, AHEAD)[0])
        except DecodeError as error:
            self.complaints.tell(NO_PARAMETER, error)

    def _parted(self, writes: Iterable[Write], what: str) -> tuple[list[Write], list[Write]]:
        """Return the writes that clocks can have stamped, and those that lie years ahead.

        Args:
            writes: All.
            what: What to say of the latter.
        """
        now = time.time_ns()
        sound: list[Write] = []
        ahead: list[Write] = []
        for write in writes:
            try:
                check_time(write, now)
                sound.append(write)
            except DecodeError as error:
                self.complaints.tell(what, error)
                ahead.append(write)
        return sound, ahead

    def _now(self) -> Stamp:
        self._clock.observe(Stamp(self._history.latest, ""))
        return self._clock.now()

    def _apply(self, writes: Iterable[Write]) -> Step:
        old = self._root
        news = self._history.apply(writes)
        new = self._root = self._history.root
        if news:
            self.watchers.tell(old, new, news)
            for sink in self._sinks:
                sink(news)
        return old, new, news


class _Current:
    """The history of a state with all that was noted applied, and nobody else at work on it."""

    __slots__ = ("_state",)

    def __init__(self, state: State) -> None:
        self._state = state

    def __enter__(self) -> None:
        self._state.enter()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._state.leave()
