"""The state of one copy of the store: its history behind a lock, and its tree for readers."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Final

from msgspec import structs

from rosz.errors import DecodeError, ParamError, ParamNotFound
from rosz.params.history import History
from rosz.params.paths import ROOT, Path, climb, joined, to_path
from rosz.params.replica.watch import Callback, TreeChange, Watch, Watchers
from rosz.params.tree import MISSING, Missing, Tree, leaves, lookup
from rosz.params.values import Value, copy
from rosz.params.wire import Batch, check_reach, decode, read_header, read_time
from rosz.params.writes import DELETED, Change, Write, check_time, condense, latest_time, put
from rosz.session import HybridClock, Stamp

__all__ = ("NOT_A_PARAMETER", "DamageLog", "State", "TreeReader", "names_beside", "not_found")

_log = logging.getLogger("rosz.params")

NOT_A_PARAMETER: Final = "a replica wrote something that is not a parameter"
_REFUSED: Final = "a write of a replica is refused"
_LOST: Final = (
    "'%s' and %d more parameters are dropped: they were set while this replica was away for more"
    " deletions than others remember, or deleted since"
)
_STORED_AHEAD: Final = "a stored write counts as written just now"

_LOCK_TIMEOUT: Final = 0.002
_MAX_DEFERRED: Final = 64
"""Messages that may be deferred, which bounds the work that a read has to do before it returns."""

_MAX_SUGGESTIONS: Final = 200
"""Names beside a missing one that are compared with it."""

_INTERRUPTED: Final = (
    "a signal handler interrupted its thread during a change of the parameters, and cannot do one"
    " itself; start a thread from it that does"
)


def not_found(root: Tree, path: Path) -> ParamNotFound:
    """Return the error for a path that is not set, with a similar name if there is one."""
    return ParamNotFound(joined(path), names_beside(root, path))


def names_beside(root: Tree, path: Path) -> list[str]:
    """Return the names in the namespace of a path, or some of them if there are many."""
    beside = lookup(root, path[:-1])
    names = list(beside)[:_MAX_SUGGESTIONS] if type(beside) is dict else []
    return [joined((*path[:-1], name)) for name in names]


class DamageLog:
    """Log of damaged messages, with one line for each kind of damage: senders may repeat it."""

    def __init__(self) -> None:
        self._kinds: set[tuple[str, str]] = set()

    def report(self, what: str, error: DecodeError) -> None:
        """Log a warning, unless the same kind of damage was logged before.

        Args:
            what: What is wrong, such as `NOT_A_PARAMETER`.
            error: Reason.
        """
        kind = (what, error.type_name)
        if kind not in self._kinds:
            self._kinds.add(kind)
            _log.warning("%s (reported once): %.300s", what, error)


class State:
    """A history behind a lock. Its tree is read without the lock.

    As a context manager it locks the history, applies deferred messages, and returns the history.

    Messages of other replicas are deferred: they are applied when somebody reads the tree. So a
    process whose parameters nobody reads costs the writers almost nothing, and a reader always sees
    the newest state.

    A signal handler may interrupt its own thread while that thread changes the history. It then
    reads the tree as it was before, and everything else raises `ParamError`.

    Args:
        clock: Clock of the session; it is kept ahead of all writes seen.

    Attributes:
        watchers: Callbacks that are notified of changes.
        damage: Log of damaged messages.
    """

    def __init__(self, clock: HybridClock) -> None:
        self.watchers: Watchers = Watchers()
        self.damage: DamageLog = DamageLog()
        self._root: Tree = {}
        self._clock = clock
        self._history = History()
        self._lock = threading.RLock()
        self._holder = 0
        self._on_new: Callable[[list[Write]], None] | None = None
        self._deferred: deque[tuple[bytes, Path]] = deque()
        self._applying = False

    def __enter__(self) -> History:
        self.acquire()
        return self._history

    def __exit__(self, *_: object) -> None:
        self.release()

    def __len__(self) -> int:
        with self as history:
            return len(history)

    @property
    def root(self) -> Tree:
        """The tree now; never changed in place."""
        # One of the two is always true until the last deferred message has been applied.
        if self._deferred or self._applying:
            self.apply_deferred()
        return self._root

    def apply_deferred(self) -> None:
        """Apply deferred messages, unless this thread is at work on the history already."""
        if self._holder != threading.get_ident():
            with self:
                pass

    def defer(self, message: bytes, reach: Path = ROOT) -> bool:
        """Queue a message of another replica, to be applied by the next read.

        Args:
            message: Message with its header.
            reach: Path that all writes in the message must lie at or below.

        Returns:
            Whether that is enough; if not, the message must be applied now, because somebody is to
            be notified of it, too many messages are deferred, or it may have to be refused.
        """
        if self._is_followed() or len(self._deferred) >= _MAX_DEFERRED:
            return False
        if not self._is_plausible(message):
            return False
        self._deferred.append((message, reach))
        # Somebody may have begun to follow after the first check, and seen the queue without this.
        return not self._is_followed()

    def receive(self, message: bytes, reach: Path = ROOT) -> str:
        """Apply a message of another replica; the arguments are those of `defer`.

        Returns:
            The reason why it is refused; empty if it is not.
        """
        with self:
            return self._receive(message, reach)

    def try_receive(self, message: bytes, reach: Path = ROOT) -> str | None:
        """Apply a message of another replica, unless another thread holds the history.

        Returns:
            What `receive` returns, or ``None`` if the message was not applied; then call `receive`
            on a thread that may wait.
        """
        if not self.acquire(_LOCK_TIMEOUT):
            return None
        try:
            return self._receive(message, reach)
        finally:
            self.release()

    def write(
        self, changes: Iterable[Change], origin: str, stamp: Stamp | None = None
    ) -> tuple[Stamp, TreeChange]:
        """Write a batch, under a given stamp or one that is later than all writes seen.

        Raises:
            ParamError: The tree cannot hold a change; nothing is changed then.
            DecodeError: The given stamp lies years ahead, or before deletions that are forgotten;
                nothing is changed then.
        """
        with self:
            given, stamp = stamp, stamp or self._now()
            at = (stamp.time, stamp.id)
            writes = [put(path, at, value, origin) for path, value in changes]
            if given is not None:
                now = time.time_ns()
                for write in writes:
                    check_time(write, now)
                    self._check_horizon(write)
            return stamp, self._apply(writes)

    def undo(
        self, change: TreeChange, stamp: Stamp, origin: str
    ) -> tuple[list[Change], Stamp, TreeChange]:
        """Write what a batch replaced, unless it is overwritten already.

        Args:
            change: What the batch changed.
            stamp: Stamp of the batch.
            origin: Writer, as shown to users.

        Returns:
            The changes that undo the batch, their stamp, and what they changed.
        """
        at = (stamp.time, stamp.id)
        with self as history:
            mine = [write.path for write in change.writes if history.find(write.path) == write]
            changes = condense(_before(change.old, path, history, at) for path in mine)
            now = self._now()
            again = self._apply(
                [put(path, (now.time, now.id), old, origin) for path, old in changes]
            )
            return changes, now, again

    def apply(self, writes: Iterable[Write]) -> None:
        """Add writes of other replicas, except for those stamped years ahead.

        Raises:
            ParamError: The tree cannot hold a write; nothing is changed then.
        """
        with self:
            self._apply(self._check_times(writes, _REFUSED)[0])

    def restore(self, writes: Iterable[Write], horizon: int = 0) -> bool:
        """Add stored writes; those stamped years ahead get a new stamp.

        Args:
            writes: The writes.
            horizon: Horizon of the stored set.

        Returns:
            Whether any got a new stamp.

        Raises:
            ParamError: The tree cannot hold a write.
        """
        with self:
            sound, ahead = self._check_times(writes, _STORED_AHEAD)
            self._apply(sound)
            self._history.restore(horizon)
            for write in sorted(ahead, key=lambda write: write.order):
                now = self._now()
                self._apply([structs.replace(write, time=now.time, clock=now.id)])
            return bool(ahead)

    def on_new(self, callback: Callable[[list[Write]], None]) -> None:
        """Call a function with all new writes from now on, in order; it must return quickly."""
        with self:
            self._on_new = callback

    @contextmanager
    def frozen(self) -> Iterator[History]:
        """Return a context in which nothing is written, and which gets the history."""
        before = self._on_new
        self.on_new(before or _ignore)  # a message that is deferred would be acknowledged
        try:
            with self as history:
                yield history
        finally:
            self._on_new = before

    def stamp(self) -> Stamp:
        """Return a stamp that is later than all writes seen."""
        with self:
            return self._now()

    def forget(self, keep: int) -> int:
        """Drop the oldest deletions if there are far too many; see `History.forget`."""
        with self as history:
            return history.forget(keep)

    def merge(self, writes: Iterable[Write], horizon: int) -> None:
        """Become one with another replica, whose horizon may be later.

        Args:
            writes: All writes of the other replica.
            horizon: Its horizon.

        Raises:
            ParamError: The tree cannot hold a write; nothing is changed then.
            DecodeError: The horizon lies years ahead; nothing is changed then.
        """
        with self as history:
            check_time(Write(ROOT, horizon, "", {}, "another replica"), time.time_ns())
            old = self._root
            merge = history.merge(self._check_times(writes, _REFUSED)[0], horizon)
            self._notify(old, merge.new, merge.dropped)
        lost = [write for write in merge.dropped if not write.deleted]
        if lost:
            _log.warning(_LOST, joined(lost[0].path), len(lost) - 1)

    def watch(self, path: Path, callback: Callback) -> Watch:
        """Call a function on all changes of a path from now on."""
        with self:
            return self.watchers.add(path, callback)

    def acquire(self, timeout: float = -1) -> bool:
        """Lock the history and apply deferred messages.

        Args:
            timeout: Time limit in seconds; none if negative.

        Returns:
            Whether the history is locked; false if the time was over.

        Raises:
            ParamError: This thread holds the history already, below a signal handler.
        """
        if not self._lock.acquire(timeout=timeout):
            return False
        if self._holder == threading.get_ident():
            self._lock.release()
            raise ParamError(_INTERRUPTED)
        self._holder = threading.get_ident()
        try:
            if self._deferred:
                self._applying = True
                while self._deferred:
                    self._receive(*self._deferred.popleft())
                self._applying = False
        except BaseException:  # KeyboardInterrupt may be raised anywhere
            self._applying = False
            self.release()
            raise
        return True

    def release(self) -> None:
        """Unlock the history."""
        self._holder = 0
        self._lock.release()

    def _is_followed(self) -> bool:
        return self._on_new is not None or self.watchers.active

    def _is_plausible(self, message: bytes) -> bool:
        """Tell whether no write in a message is to be refused for its time."""
        try:
            time_ = read_time(memoryview(message)[read_header(message)[2] :])
        except DecodeError:
            return False
        return self._history.horizon < time_ <= latest_time(time.time_ns())

    def _receive(self, message: bytes, reach: Path) -> str:
        try:
            start = read_header(message)[2]
            writes = decode(memoryview(message)[start:], Batch).writes()
            check_reach((write.path for write in writes), reach)
        except DecodeError as error:
            self.damage.report(NOT_A_PARAMETER, error)
            return str(error)
        try:
            if writes:  # all of them have the same time
                check_time(writes[0], time.time_ns())
            if writes and writes[0].time <= self._history.horizon:
                for write in writes:
                    self._check_horizon(write)
        except DecodeError as error:
            self.damage.report(_REFUSED, error)
            return error.reason
        self._apply(writes)
        return ""

    def _check_horizon(self, write: Write) -> None:
        """Raise `DecodeError` if the history neither holds nor takes a write."""
        history = self._history
        if write.time <= history.horizon and not (history.hides(write) or history.provable(write)):
            raise DecodeError(
                "parameter stamp",
                -1,
                f"'{joined(write.path)}' is older than deletions that are forgotten: set it again",
            )

    def _check_times(self, writes: Iterable[Write], what: str) -> tuple[list[Write], list[Write]]:
        """Return the writes with a plausible stamp, and those stamped years ahead.

        Args:
            writes: All writes.
            what: What to report of the latter.
        """
        now = time.time_ns()
        sound: list[Write] = []
        ahead: list[Write] = []
        for write in writes:
            try:
                check_time(write, now)
                sound.append(write)
            except DecodeError as error:
                self.damage.report(what, error)
                ahead.append(write)
        return sound, ahead

    def _now(self) -> Stamp:
        self._clock.observe(Stamp(self._history.latest, ""))
        return self._clock.now()

    def _apply(self, writes: Iterable[Write]) -> TreeChange:
        old = self._root
        return self._notify(old, self._history.apply(writes))

    def _notify(
        self, old: Tree, new_writes: list[Write], dropped: Iterable[Write] = ()
    ) -> TreeChange:
        """Show the tree of the history, and notify everybody of the writes that changed it."""
        self._root = self._history.root
        change = TreeChange(old, self._root, [*new_writes, *dropped])
        if change.writes:
            self.watchers.notify(change)
        if new_writes and self._on_new is not None:
            self._on_new(new_writes)
        return change


def _ignore(_writes: list[Write]) -> None: ...


def _before(old: Tree, path: Path, history: History, at: tuple[int, str]) -> Change:
    """Return the change that makes a path what it was, without the writes of one stamp."""
    for depth in range(len(path)):
        start = path[:depth]
        value = lookup(old, start)
        if value is MISSING and all(
            write.deleted or (write.time, write.clock) == at for write in history.below(start)
        ):
            return start, DELETED
        if value is not MISSING and type(value) is not dict:
            return start, value
    value = lookup(old, path)
    return path, DELETED if value is MISSING else value


class TreeReader:
    """Reading access to a copy of the store. Safe for threads.

    Names are global names or their paths.

    Args:
        state: State of the copy.
    """

    def __init__(self, state: State) -> None:
        self._state = state

    @property
    def root(self) -> Tree:
        """The tree now; it must not be changed, and is replaced when a parameter changes."""
        return self._state.root

    def lookup(self, path: Path) -> Value | Missing:
        """Return the value at a path, or `MISSING`; it must not be changed."""
        return lookup(self._state.root, path)

    def peek(self, name: str | Path) -> Value:
        """Return the value of a name; it must not be changed.

        Raises:
            ParamNotFound: The parameter is not set.
            InvalidName: The name is not a global name.
        """
        root, path = self._state.root, to_path(name)
        found = lookup(root, path)
        if found is MISSING:
            raise not_found(root, path)
        return found

    def get(self, name: str | Path) -> Value:
        """Return a copy of the value of a name; the errors are those of `peek`."""
        return copy(self.peek(name))

    def has(self, name: str | Path) -> bool:
        """Tell whether a name is set.

        Raises:
            InvalidName: The name is not a global name.
        """
        return lookup(self._state.root, to_path(name)) is not MISSING

    def names(self) -> list[str]:
        """Return the sorted global names of all parameters that are not dicts."""
        return sorted(joined(path) for path, _ in leaves(self._state.root) if path)

    def search(self, name: str, node: str) -> str | None:
        """Search for a name from a node's own name upwards; return the global name found.

        Raises:
            ParamError: The name is empty or private.
        """
        return climb(name, node, self.has)

    def origin(self, name: str | Path) -> str:
        """Return the writer of a value, as shown to users; empty if nobody wrote it."""
        with self._state as history:
            write = history.source(to_path(name))
        return write.origin if write is not None else ""

    def watch(self, name: str | Path, callback: Callback) -> Watch:
        """Call a function on every change at a name, above it and below it.

        Args:
            name: Name to watch; it need not be set.
            callback: Function called with each change, in order, on a thread of the store, where it
                may do anything. If it is too slow, it gets only the newest change of each name.

        Raises:
            InvalidName: The name is not a global name.
        """
        return self._state.watch(to_path(name), callback)
