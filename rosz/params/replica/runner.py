"""Running the core of a copy of the store: one step at a time, on any thread.

A step is made under a lock. Some effects are carried out under it as well, and therefore in the
order of the steps: readers see the new tree, watchers are notified, calls return, writes go to the
file. All others are carried out after it.
"""

from __future__ import annotations

import itertools
import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, Final

from rosz.errors import ClosedError, DecodeError, ParamError, RoszError
from rosz.params.history import History
from rosz.params.paths import ROOT, Path
from rosz.params.replica.core import ReplicaCore
from rosz.params.replica.core.effects import (
    Answer,
    Compact,
    Effect,
    Log,
    Save,
    StartTimer,
    TreeChanged,
)
from rosz.params.replica.core.events import (
    BatchReceived,
    Event,
    MemberLeft,
    Moment,
    Timer,
    TimerFired,
)
from rosz.params.replica.core.store import NOT_A_PARAMETER
from rosz.params.replica.core.work import damage
from rosz.params.replica.storage import Storage
from rosz.params.replica.watch import Callback, Watch, Watchers
from rosz.params.tree import Tree
from rosz.params.wire import Departure, decode, read_header, read_time
from rosz.session import HybridClock, Stamp
from rosz.worker import Worker, lend_thread

_log = logging.getLogger("rosz.params")
_CLOCK: Final = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)
"""The clock that counts the time in which the machine sleeps, where there is one."""

_LOCK_TIMEOUT: Final = 0.002
"""Seconds that a thread that receives waits for the lock before the worker gets the event."""

_MAX_DEFERRED: Final = 64
"""Largest number of deferred messages, which a read has to apply before it returns."""

_MAX_WAITING: Final = 2000
"""Tasks of the worker above which requests from the network are refused."""

_BEAT: Final = 0.1
"""Seconds between two reports of progress. The sender repeats a batch without any for longer."""

_INTERRUPTED: Final = (
    "a signal handler interrupted its thread during a change of the parameters, and cannot do one"
    " itself; start a thread from it that does"
)


def beat_until(ended: threading.Event, beat: Callable[[], object]) -> None:
    """Call a function about ten times a second, on another thread, until an event is set."""

    def run() -> None:
        beat()
        while not ended.wait(_BEAT):
            beat()

    lend_thread(run)


def _run(task: Callable[[], object]) -> None:
    try:
        task()
    except ClosedError as error:
        _log.debug("a task of the parameter store came too late: %s", error)


class _PendingCall:
    """A call of the process that the core has not answered yet; its thread makes its timer fire."""

    __slots__ = ("answered", "due", "result", "timer")

    def __init__(self) -> None:
        self.result: Any = None
        self.timer: Timer | None = None
        self.due = 0.0
        # A bare lock is the fastest thing to wait on: it is acquired here and released at the end.
        self.answered = threading.Lock()
        self.answered.acquire()

    def wait(self) -> Timer | None:
        """Wait for the answer; return the timer if that fires first."""
        while not self.answered.acquire(timeout=self.seconds_left()):
            if self.seconds_left() == 0:
                return self.timer
        return None

    def seconds_left(self) -> float:
        """Return the seconds until the timer fires; -1 if there is none."""
        if self.timer is None:
            return -1
        return max(0.0, self.due - time.clock_gettime(_CLOCK))


class CoreRunner:
    """The core of a copy of the store, for all threads of the process.

    As a context manager it locks the core, applies deferred messages, and returns the history.

    Messages of other replicas are deferred: they are applied when somebody reads the tree. So a
    process whose parameters nobody reads costs the writers almost nothing, and a reader always sees
    the newest state.

    A signal handler may interrupt its own thread while that thread makes a step. It then reads the
    tree as it was before, and everything else raises `ParamError`.

    Args:
        core: The core.
        clock: Clock of the session; it is kept ahead of all writes seen.
        storage: What keeps the writes, if anything does.

    Attributes:
        core: The core; only what is replaced as a whole may be read without the lock.
        worker: Worker for timers, and for events for which the lock was not soon free.
        watchers: Callbacks that are notified of changes.
        handlers: Function that carries out an effect after the step, for each type of them.
        on_own_change: Function called with changes that this process made.
    """

    def __init__(
        self, core: ReplicaCore, clock: HybridClock, storage: Storage | None = None
    ) -> None:
        self.worker: Worker[Callable[[], object]] = Worker(
            "rosz-params", _run, capacity=_MAX_WAITING, logger=_log
        )
        self.watchers: Watchers = Watchers()
        self.handlers: dict[type[Effect], Callable[[Any], object]] = {
            Log: self._log,
            StartTimer: self._start_timer,
        }
        self.on_own_change: Callable[[TreeChanged], object] = lambda _: None
        self.core: ReplicaCore = core
        self._clock = clock
        self._root: Tree = {}
        self._lock = threading.RLock()
        self._holder = 0
        self._deferred: deque[tuple[bytes, Path]] = deque()
        self._applying = False
        self._apply_at_once = storage is not None or core.config.listens
        self._later_effects: list[Effect] = []
        self._numbers = itertools.count(1)
        self._calls: dict[int, _PendingCall] = {}
        self._logged: set[str] = set()
        self._closed = False
        self._under_lock: dict[type[Effect], Callable[[Any], object]] = {
            TreeChanged: self._show,
            Answer: self._answer,
        }
        if storage is not None:
            storage.on_saved = self.run
            self._under_lock |= {Save: storage.save, Compact: storage.save}

    def __enter__(self) -> History:
        self._acquire()
        return self.core.history

    def __exit__(self, *_: object) -> None:
        self._release()

    def __len__(self) -> int:
        with self as history:
            return len(history)

    @property
    def root(self) -> Tree:
        """The tree, after deferred messages are applied; never changed in place."""
        # One of the two is always true until the last deferred message has been applied.
        if self._deferred or self._applying:
            self.apply_deferred()
        return self._root

    def apply_deferred(self) -> None:
        """Apply deferred messages, unless this thread holds the lock already."""
        if self._holder != threading.get_ident():
            with self:
                pass

    def run(self, event: Event, timeout: float = -1) -> bool:
        """Make a step, and carry out its effects.

        Args:
            event: What happened.
            timeout: Time limit in seconds of the wait for the lock; none if negative.

        Returns:
            Whether the step was made.

        Raises:
            ParamError: This thread makes a step already, below a signal handler.
        """
        if not self._acquire(timeout):
            return False
        try:
            effects = self._step(event)
        finally:
            self._release()
        self._carry_out(effects)
        return True

    def run_soon(self, event: Event) -> None:
        """Make a step now if the lock is soon free, else on the worker."""
        if not self.run(event, _LOCK_TIMEOUT):
            self.worker.submit(partial(self.run, event))

    def call(self, make: Callable[[int, Stamp], Event]) -> Any:
        """Hand a call of the process to the core, and wait for its answer.

        Args:
            make: Function that returns the event for the number of the call, and a new stamp.

        Raises:
            ClosedError: The copy is closed.
        """
        number, pending = next(self._numbers), _PendingCall()
        self._calls[number] = pending
        try:
            self._acquire()
            try:
                if self._closed:
                    raise ClosedError("the copy of the parameter store is closed")
                # The core moves the stamp behind all writes that it has seen.
                effects = self._step(make(number, self._clock.now()))
            finally:
                self._release()
            self._carry_out(effects)
            while timer := pending.wait():
                self.run(TimerFired(timer))
        except BaseException:
            if pending.timer is not None:  # interrupted: its timer ends the call in the core
                event = TimerFired(pending.timer)
                self.worker.later(max(0.0, pending.seconds_left()), partial(self.run, event))
            raise
        finally:
            del self._calls[number]
        if isinstance(pending.result, Exception):
            raise pending.result
        return pending.result

    def read_batch(
        self, message: bytes, reach: Path, query: int = 0, *, acknowledged: bool = False
    ) -> BatchReceived | MemberLeft:
        """Return the event for a message with a batch.

        Raises:
            DecodeError: The message is not a batch.
        """
        sender, number, start = read_header(message)
        batch = decode(memoryview(message)[start:], Departure)
        if batch.kind:
            return MemberLeft(sender, returns=batch.kind == Departure.RESTARTS)
        return BatchReceived(sender, number, batch, reach, query, acknowledged)

    def defer(self, message: bytes, reach: Path = ROOT) -> tuple[str, int] | None:
        """Queue a message of another replica, to be applied by the next read.

        Returns:
            The sender and the number of the message if it was deferred. None if the caller must
            apply it now: somebody is to be notified of it, too many messages are deferred, it is
            not a batch, or its time may be a reason to refuse it.
        """
        if self._must_apply_at_once() or len(self._deferred) >= _MAX_DEFERRED:
            return None
        try:
            sender, number, start = read_header(message)
            written_at = read_time(memoryview(message)[start:])
        except DecodeError:
            return None
        if not number or not self.core.may_defer(written_at, time.time_ns()):
            return None
        self._deferred.append((message, reach))
        # A watcher that was added after the first check would miss this message.
        return None if self._must_apply_at_once() else (sender, number)

    def stamp(self) -> Stamp:
        """Return a stamp that is later than all writes seen."""
        with self as history:
            self._clock.observe(Stamp(history.latest, ""))
            return self._clock.now()

    def watch(self, path: Path, callback: Callback) -> Watch:
        """Call a function on all changes of a path from now on."""
        with self:
            return self.watchers.add(path, callback)

    @contextmanager
    def frozen(self) -> Iterator[History]:
        """Return a context in which no step is made, and which gets the history."""
        before, self._apply_at_once = self._apply_at_once, True  # to defer is to acknowledge
        try:
            with self as history:
                yield history
        finally:
            self._apply_at_once = before

    def report(self, what: str, error: DecodeError) -> None:
        """Log damaged bytes, once for each kind."""
        self._log(damage(what, error))

    def close(self) -> None:
        """Make no more steps, and end the threads; a second call has no effect."""
        self._closed = True
        self.worker.close()
        self.watchers.close()

    def _step(self, event: Event) -> list[Effect]:
        """Make a step under the lock; return the effects to carry out after its release."""
        if self._closed:
            return []
        moment = Moment(time.clock_gettime(_CLOCK), time.time_ns())
        remaining: list[Effect] = []
        for effect in self.core.step(event, moment):
            carry_out = self._under_lock.get(type(effect))
            if carry_out is None:
                remaining.append(effect)
            else:
                carry_out(effect)
        return remaining

    def _carry_out(self, effects: list[Effect]) -> None:
        for effect in effects:
            carry_out = self.handlers.get(type(effect))
            if carry_out is not None:
                try:
                    carry_out(effect)
                except RoszError as error:
                    _log.debug("%s is not done: %s", type(effect).__name__, error)

    def _acquire(self, timeout: float = -1) -> bool:
        """Lock the core and apply deferred messages; return False at the time limit.

        Raises:
            ParamError: This thread holds the lock already, below a signal handler.
        """
        if not self._lock.acquire(timeout=timeout):
            return False
        thread = threading.get_ident()
        if self._holder == thread:
            self._lock.release()
            raise ParamError(_INTERRUPTED)
        self._holder = thread
        try:
            if self._deferred:
                self._applying = True
                while self._deferred:
                    self._apply(*self._deferred.popleft())
                self._applying = False
        except BaseException:  # KeyboardInterrupt may be raised anywhere
            self._applying = False
            self._release()
            raise
        return True

    def _release(self) -> None:
        effects = self._later_effects
        if effects:
            self._later_effects = []
        self._holder = 0
        self._lock.release()
        self._carry_out(effects)

    def _apply(self, message: bytes, reach: Path) -> None:
        """Apply a deferred message."""
        try:
            self._later_effects += self._step(self.read_batch(message, reach, acknowledged=True))
        except DecodeError as error:
            self._later_effects.append(damage(NOT_A_PARAMETER, error))

    def _must_apply_at_once(self) -> bool:
        return self._apply_at_once or self.watchers.active

    def _show(self, change: TreeChanged) -> None:
        """Show the new tree to readers, and notify everybody of the writes that changed it."""
        self._root = change.new
        self.watchers.notify(change)
        if change.own:
            self.on_own_change(change)

    def _answer(self, answer: Answer) -> None:
        pending = self._calls.get(answer.call)
        if pending is not None:
            pending.result = answer.result
            pending.answered.release()

    def _start_timer(self, effect: StartTimer) -> None:
        pending = self._calls.get(effect.call)
        if pending is not None:
            pending.timer = effect.timer
            pending.due = time.clock_gettime(_CLOCK) + effect.seconds
        else:
            self.worker.later(effect.seconds, partial(self.run, TimerFired(effect.timer)))

    def _log(self, line: Log) -> None:
        if line.once not in self._logged:
            if line.once:
                self._logged.add(line.once)
            _log.log(line.level, "%s", line.text)
