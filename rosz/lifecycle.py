"""The lifecycle of objects that can be closed: open, closing, closed.

An owner has a `Lifecycle` and closes itself with it::

    class Recorder:
        def __init__(self) -> None:
            self._lifecycle = Lifecycle("the recorder", on_fork=self._forked)

        def close(self) -> None:
            self._lifecycle.close(self._finish)

The first `Lifecycle.close` does the work. A later one on another thread waits for the first; one on
the same thread, from a hook or a signal handler, returns at once. No method holds a lock, so a
signal handler may interrupt any of them.

Threads and Zenoh's links do not survive a fork. In a forked child this module closes every
lifecycle of the parent, without running hooks and without closing parts, and then calls ``on_fork``
of each, newest first. That is the only place where rosz deals with forks.
"""

from __future__ import annotations

import itertools
import logging
import os
import signal
import threading
import weakref
from collections.abc import Callable
from typing import Generic, Protocol, Self, TypeVar

from rosz.errors import ClosedError

FORKED = (
    "this process was forked from one that uses rosz, and threads and links do not outlive a fork:"
    " start the child first, or use the 'spawn' method of multiprocessing"
)
"""Reason of every lifecycle that a forked child inherits."""

Hook = Callable[[str], object]
"""A function that is called with the reason of the end."""

_CLOSE_TIMEOUT = 10.0
"""Seconds that a second caller of `Lifecycle.close` waits for the first."""

_log = logging.getLogger("rosz.lifecycle")


class Closable(Protocol):
    """Something that can be closed."""

    def close(self) -> None:
        """Close it; closing it again is not an error."""


class Closing:
    """A base class for what a ``with`` statement closes at its end."""

    __slots__ = ()

    def close(self) -> None:
        """Close it; closing it again is not an error."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


P = TypeVar("P", bound=Closable)
T = TypeVar("T")


C = TypeVar("C", bound=Closable)


class Use(Generic[C]):
    """The use of something shared, until it is closed.

    Attributes:
        value: What is shared.
    """

    def __init__(self, shared: SharedResource[C], value: C) -> None:
        self._shared: SharedResource[C] | None = shared
        self.value: C = value

    def close(self) -> None:
        """End the use; a second call has no effect."""
        shared, self._shared = self._shared, None
        if shared is not None:
            shared.release()


class SharedResource(Generic[C]):
    """Something that the first user opens, by a function, and the last one closes."""

    def __init__(self, open_one: Callable[[], C]) -> None:
        self._open = open_one
        self._lock = threading.Lock()
        self._value: C | None = None
        self._users = 0

    def use(self) -> Use[C]:
        """Open it, unless it is open, and count a user.

        Raises:
            RoszError: It cannot be opened.
        """
        with self._lock:
            if self._value is None:
                self._value = self._open()
            self._users += 1
            return Use(self, self._value)

    def release(self) -> None:
        """Count one user less, and close it after the last one."""
        with self._lock:
            self._users -= 1
            if self._users:
                return
            value, self._value = self._value, None
        if value is not None:
            value.close()


class Registration:
    """Something that was registered; closing it unregisters it.

    Args:
        unregister: The function that does so; calling it twice must not be an error.
    """

    def __init__(self, unregister: Callable[[], object]) -> None:
        self._unregister = unregister

    def close(self) -> None:
        """Unregister."""
        self._unregister()


class Lifecycle:
    """The state of an owner that can be closed, with its hooks and parts.

    Reading an attribute is all that a hot path needs: ``if lifecycle.closing: ...``.

    Args:
        what: The owner in error texts, such as ``the publisher of '/chatter'``.
        log: Logger for hooks and parts that fail.
        on_fork: Method of the owner that a forked child calls: to replace locks, and to keep alive
            what must not be freed. It must touch neither threads nor links. Only a weak reference
            to the owner is kept.

    Attributes:
        closing: Whether closing has begun; stays true.
        closed: Whether closing is complete.
        reason: Reason of the end; may be set before the end.
        forked: Whether the owner was inherited from the parent of this forked process.
    """

    def __init__(
        self, what: str, *, log: logging.Logger = _log, on_fork: Callable[[], object] | None = None
    ) -> None:
        self.closing: bool = False
        self.closed: bool = False
        self.reason: str = ""
        self.forked: bool = False
        self._what = what
        self._log = log
        self._on_fork = None if on_fork is None else weakref.WeakMethod(on_fork)
        self._parts: list[Closable] = []
        self._hooks: list[Hook] = []
        self._closer: dict[str, tuple[int]] = {}
        # Locks that are released once, since a signal handler must not set an event whose own
        # thread is about to wait for it.
        self._until_closing, self._until_closed = threading.Lock(), threading.Lock()
        self._until_closing.acquire()
        self._until_closed.acquire()
        self._number = next(_numbers)
        _lifecycles.add(self)

    def check_open(self, doing: str) -> None:
        """Refuse an operation on a closed owner.

        Args:
            doing: The operation, such as ``publish``.

        Raises:
            ClosedError: Closing has begun.
        """
        if self.closing:
            why = f": {self.reason}" if self.reason else ""
            raise ClosedError(f"cannot {doing}: {self._what} is closed{why}")

    def keep(self, part: P) -> P:
        """Close a part together with the owner, before the parts that came earlier.

        Returns:
            The part.

        Raises:
            ClosedError: Closing has begun; the part has been closed.
        """
        self._parts.append(part)
        if self.closing:
            self.forget(part)
            part.close()
            self.check_open("declare anything more")
        return part

    def forget(self, part: Closable) -> None:
        """Remove a part that was closed on its own."""
        _remove(self._parts, part)

    def on_close(self, hook: Hook) -> Callable[[], None]:
        """Call a function when closing begins; hooks are called newest first.

        Returns:
            A function that removes the hook.

        Raises:
            ClosedError: Closing has begun; the hook will not be called.
        """
        self._hooks.append(hook)
        if self.closing and _remove(self._hooks, hook):
            self.check_open("add a shutdown hook")

        def remove() -> None:
            _remove(self._hooks, hook)

        return remove

    def call(self, hook: Hook) -> None:
        """Call a hook with the reason, and log what it raises."""
        try:
            hook(self.reason)
        except (Exception, SystemExit):  # noqa: BLE001  # the callback boundary
            self._log.exception("a shutdown hook failed")

    def close(
        self,
        finish: Callable[[], object] | None = None,
        *,
        first: Callable[[], object] | None = None,
        reason: str = "",
    ) -> bool:
        """Close the owner: call the hooks, then `finish`, then close the parts, newest first.

        Args:
            finish: The owner's own work. It runs even if Ctrl-C interrupts a hook.
            first: Function to call before the hooks.
            reason: Reason of the end, for hooks and errors.

        Returns:
            Whether the owner is closed now. False on the thread that is closing it, and when the
            thread that closes it needs more than 10 seconds.
        """
        call = (threading.get_ident(),)
        closer = self._closer.setdefault("", call)
        if closer is not call:
            return self.closed or (closer != call and self._wait_for_closer())
        try:
            self.reason = reason or self.reason
            self.closing = True
            self._until_closing.release()
            if first is not None:
                first()
            while self._hooks:
                self.call(self._hooks.pop())
        finally:  # also where Ctrl-C interrupts a hook
            try:
                if finish is not None:
                    finish()
            finally:
                self._close_parts()
        return True

    def wait_closing(self, timeout: float | None = None) -> bool:
        """Wait until closing begins.

        Args:
            timeout: Time limit in seconds; none when not given.

        Returns:
            Whether closing has begun.
        """
        return self.closing or _wait(self._until_closing, timeout)

    def _close_parts(self) -> None:
        try:
            while self._parts:
                part = self._parts.pop()
                try:
                    part.close()
                except Exception:  # noqa: BLE001  # a part may belong to the program
                    self._log.exception("a part of %s could not be closed", self._what)
        finally:
            self.closed = True
            self._until_closed.release()

    def _wait_for_closer(self) -> bool:
        """Wait for the first caller, so that the main thread does not end before it."""
        if _wait(self._until_closed, _CLOSE_TIMEOUT):
            return True
        self._log.warning(
            "closing %s takes more than %g s: a hook blocks it", self._what, _CLOSE_TIMEOUT
        )
        return False

    def _close_in_child(self) -> None:
        self.reason = FORKED
        self.forked = self.closing = self.closed = True
        self._closer = {"": (threading.get_ident(),)}


def _wait(until: threading.Lock, timeout: float | None) -> bool:
    """Wait for the release of a lock, and release it for the next waiter."""
    released = until.acquire(timeout=-1 if timeout is None else timeout)
    if released:
        until.release()
    return released


def _remove(items: list[T], item: T) -> bool:
    """Remove an item if the list contains it; return whether it did."""
    try:
        items.remove(item)
    except ValueError:
        return False
    return True


_numbers = itertools.count()
_lifecycles: weakref.WeakSet[Lifecycle] = weakref.WeakSet()


_held = threading.local()


def _hold_signal() -> None:
    """Let SIGTERM wait until the child has its own handlers.

    Pools terminate their processes at any time. A child that has just begun would call the handler
    of its parent, which writes to the parent's pipe, and so shut down the parent and not itself.
    """
    _held.mask = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGTERM,))


def _release_signal() -> None:
    signal.pthread_sigmask(signal.SIG_SETMASK, _held.mask)


def _close_all_in_child() -> None:
    inherited = sorted(_lifecycles, key=lambda lifecycle: -lifecycle._number)  # noqa: SLF001
    for lifecycle in inherited:
        lifecycle._close_in_child()  # noqa: SLF001
    for lifecycle in inherited:
        on_fork = lifecycle._on_fork and lifecycle._on_fork()  # noqa: SLF001
        if on_fork is not None:
            on_fork()


os.register_at_fork(after_in_child=_close_all_in_child)
os.register_at_fork(  # in the child after the one above
    before=_hold_signal, after_in_parent=_release_signal, after_in_child=_release_signal
)
