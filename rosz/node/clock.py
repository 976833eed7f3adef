"""Wall and ROS time, and sleeping in it.

A clock and its branches share one source of time: that of a node and those of its timers. The clock
of a node is itself a branch of that of the context, but with a source of its own, since each node
may take its time from ``/clock``. Each can be closed by itself, which ends the sleeps on it and on
its branches at once.

A sleep adds itself to a set, looks at the time and the state of the clock once more, and only then
waits, on a lock of its own that is released to wake it. So no wake-up is lost, nothing polls, and a
tick of ``/clock`` wakes only the sleeps whose time has come. No lock is held meanwhile, so a signal
handler may close a clock.
"""

from __future__ import annotations

import math
import threading
import time
import weakref
from collections.abc import Callable, Iterable
from functools import partial

import msgspec

from rosz.errors import TimeMovedBackwards, UsageError
from rosz.session import LONGEST_WAIT


def nanoseconds(seconds: float, what: str) -> int:
    """Return seconds as nanoseconds.

    Args:
        seconds: Seconds, of any sign.
        what: Name of the duration, for the error.

    Raises:
        UsageError: `seconds` is not a finite number.
    """
    if not math.isfinite(seconds):
        raise UsageError(f"{what} is '{seconds}' s: expected a finite number")
    return round(seconds * 1e9)


class TimeJump(msgspec.Struct, frozen=True):
    """A jump of ROS time.

    Attributes:
        before: ROS time before the jump, in nanoseconds.
        after: ROS time after the jump, in nanoseconds.
        switched: Whether ROS time is simulated now and was not before, or the other way round.
    """

    before: int
    after: int
    switched: bool = False

    @property
    def delta(self) -> int:
        """Size of the jump in nanoseconds; negative if time moved back."""
        return self.after - self.before


def _is_back(jump: TimeJump) -> bool:
    return jump.delta < 0


class _Observer(msgspec.Struct, frozen=True, eq=False):
    """The functions that a caller of `Clock.on_jump` gave."""

    wanted: Callable[[TimeJump], bool]
    before: Callable[[], object] | None
    after: Callable[[TimeJump], object]


class _Sleeper:
    """One sleep: when it began, when it ends, and the lock that its thread waits on."""

    __slots__ = ("clock", "lock", "start", "target", "woken")

    def __init__(self, clock: Clock, start: int, target: int | None) -> None:
        self.clock = clock
        self.start = start
        self.target = target
        self.woken = start
        self.lock = threading.Lock()
        self.lock.acquire()

    def is_due(self, now: int) -> bool:
        """Return whether a ROS time ends the sleep; only closing ends a sleep in wall time."""
        return self.target is not None and (now >= self.target or now < self.start)


class _TimeSource:
    """The time that a clock and its branches share."""

    __slots__ = ("__weakref__", "advancing", "now", "observers", "simulated", "sleepers")

    def __init__(self) -> None:
        self.now = 0
        self.simulated = False
        self.sleepers: set[_Sleeper] = set()
        self.observers: list[_Observer] = []
        self.advancing = threading.Lock()

    def wake(self, sleeper: _Sleeper, now: int) -> None:
        """End a sleep, unless another thread just did."""
        try:
            self.sleepers.remove(sleeper)
        except KeyError:
            return
        sleeper.woken = now
        sleeper.lock.release()


class Clock:
    """The time of a context, node or timer: wall time, or ROS time while simulated.

    All its methods may be called from any thread.
    """

    def __init__(self) -> None:
        self._source = _TimeSource()
        self._others: weakref.WeakSet[_TimeSource] = weakref.WeakSet()
        self._parent: Clock | None = None
        self._closed = False

    def branch(self, *, apart: bool = False) -> Clock:
        """Return a clock that is closed with this one, or alone.

        Args:
            apart: Whether it has a time of its own, which may be simulated while this one is not.
        """
        clock = Clock()
        if apart:
            self._others.add(clock._source)
        else:
            clock._source = self._source
        clock._parent = self
        return clock

    def now(self) -> int:
        """Return the time in nanoseconds since the Unix epoch.

        Simulated time is the newest time of ``/clock``, and 0 before the first.
        """
        source = self._source
        return source.now if source.simulated else time.time_ns()

    def steady(self) -> int:
        """Return nanoseconds to measure intervals with.

        In wall time they come from the monotonic clock, which is never set; in simulation they are
        ROS time.
        """
        source = self._source
        return source.now if source.simulated else time.monotonic_ns()

    @property
    def simulated(self) -> bool:
        """Whether time comes from ``/clock``."""
        return self._source.simulated

    @property
    def closed(self) -> bool:
        """Whether this clock, or one that it is a branch of, is closed."""
        return self._closed or (self._parent is not None and self._parent.closed)

    def enable_simulation(self) -> None:
        """Take the time from `advance` from now on; it is 0 until the first call.

        Sleeps that have begun end by wall time.
        """
        self._switch(simulated=True)

    def disable_simulation(self) -> None:
        """Take wall time again. A sleep that has begun goes on in wall time."""
        self._switch(simulated=False)

    def _switch(self, *, simulated: bool) -> None:
        source = self._source
        with source.advancing:
            if source.simulated is simulated:
                return
            jump = TimeJump(self.now(), 0 if simulated else time.time_ns(), switched=True)
            observers, errors = self._prepare(jump)
            if simulated:
                source.now = 0
            source.simulated = simulated
            for sleeper in () if simulated else list(source.sleepers):
                source.wake(sleeper, source.now)
        self._report(jump, observers, errors)

    def advance(self, time_ns: int) -> None:
        """Set ROS time, and wake the sleeps whose time has come.

        Args:
            time_ns: Time in nanoseconds; may be earlier than before, as when a simulation restarts.

        Raises:
            UsageError: Time is not simulated, or `time_ns` is negative.
            ExceptionGroup: Observers of jumps raised; all of them were called.
        """
        source = self._source
        if not source.simulated:
            raise UsageError("time is not simulated: call enable_simulation() first")
        if time_ns < 0:
            raise UsageError(f"ROS time cannot be '{time_ns}' ns: expected 0 or more")
        with source.advancing:
            jump = TimeJump(source.now, time_ns)
            observers, errors = self._prepare(jump) if source.now else ([], [])
            source.now = time_ns
            for sleeper in list(source.sleepers):
                if sleeper.is_due(time_ns):
                    source.wake(sleeper, time_ns)
        self._report(jump, observers, errors)

    def on_jump(
        self,
        observer: Callable[[TimeJump], object],
        *,
        wanted: Callable[[TimeJump], bool] = _is_back,
        before: Callable[[], object] | None = None,
    ) -> Callable[[], None]:
        """Call a function when ROS time jumps.

        It is called on the thread that sets the time, after that.

        Args:
            observer: Function that gets the jump.
            wanted: Function that tells whether a step of time is a jump; one back is by default.
            before: Function to call before the time is set.

        Returns:
            A function that removes the observer.
        """
        entry = _Observer(wanted, before, observer)
        observers = self._source.observers
        observers.append(entry)

        def remove() -> None:
            if entry in observers:
                observers.remove(entry)

        return remove

    def wait_started(self) -> bool:
        """Wait until there is a time: in simulation, for the first ``/clock`` above 0.

        Returns:
            Whether there is a time; False, at once, if the clock is closed.
        """
        if self._source.simulated:
            self._await_start()
        return not self.closed

    def sleep(self, duration_ns: int) -> bool:
        """Sleep for a time; simulated, from the first ``/clock`` on.

        Args:
            duration_ns: Duration in nanoseconds; no sleep if it is not above 0.

        Returns:
            Whether the time is over; False, at once, if the clock is closed.

        Raises:
            TimeMovedBackwards: ROS time became earlier than it was when the sleep began.
        """
        if self._source.simulated:
            start = self._await_start()
            end = None if start is None else self._await(start, start + duration_ns)
            if start is None or end is None:
                return False
            if self._source.simulated:
                return True
            duration_ns -= end - start
        return self._sleep_wall(duration_ns)

    def sleep_until(self, time_ns: int) -> bool:
        """Sleep until a time comes.

        In wall time the duration of the sleep is fixed when it begins: setting the machine's clock
        meanwhile changes nothing.

        Args:
            time_ns: Time in nanoseconds since the Unix epoch, or of ROS time.

        Returns:
            Whether that time has come; False, at once, if the clock is closed.

        Raises:
            TimeMovedBackwards: ROS time became earlier than it was when the sleep began.
        """
        if self._source.simulated:
            start = self._await_start()
            if start is None or self._await(start, time_ns) is None:
                return False
            if self._source.simulated:
                return True
        return self._sleep_wall(time_ns - time.time_ns())

    def close(self) -> None:
        """End all sleeps on this clock and its branches, later ones too; again has no effect."""
        self._closed = True
        for source in (self._source, *self._others):
            for sleeper in list(source.sleepers):
                if sleeper.clock.closed:
                    source.wake(sleeper, source.now)

    def _sleep_wall(self, duration_ns: int) -> bool:
        if duration_ns <= 0:
            return not self.closed
        end = time.monotonic_ns() + duration_ns
        sleeper = _Sleeper(self, 0, None)
        sleepers = self._source.sleepers
        sleepers.add(sleeper)
        try:
            while not self.closed:
                left = (end - time.monotonic_ns()) / 1e9
                if left <= 0:
                    return True
                sleeper.lock.acquire(timeout=min(left, LONGEST_WAIT))
        finally:
            sleepers.discard(sleeper)
        return False

    def _await_start(self) -> int | None:
        """Wait for ROS time to be above 0, and return it; None if the clock is closed."""
        return self._source.now or self._await(0, 1)

    def _await(self, start: int, target: int) -> int | None:
        """Wait for a ROS time and return the one that ended the wait; None if closed.

        The wait also ends when time is simulated no longer.
        """
        source = self._source
        sleeper = _Sleeper(self, start, target)
        source.sleepers.add(sleeper)
        try:
            now = source.now
            if source.simulated and not sleeper.is_due(now) and not self.closed:
                sleeper.lock.acquire()
                now = sleeper.woken
        finally:
            source.sleepers.discard(sleeper)
        if self.closed:
            return None
        if now < start:
            raise TimeMovedBackwards(start, now)
        return now

    def _prepare(self, jump: TimeJump) -> tuple[list[_Observer], list[Exception]]:
        """Return the observers of a jump that is about to come, and what they raised."""
        observers = [entry for entry in self._source.observers if entry.wanted(jump)]
        return observers, _raised_by(entry.before for entry in observers if entry.before)

    def _report(self, jump: TimeJump, observers: list[_Observer], errors: list[Exception]) -> None:
        errors += _raised_by(partial(entry.after, jump) for entry in observers)
        if errors:
            raise ExceptionGroup("observers of a jump of time failed", errors)


def _raised_by(calls: Iterable[Callable[[], object]]) -> list[Exception]:
    """Call all functions, and return what they raise."""
    errors: list[Exception] = []
    for call in calls:
        try:
            call()
        except Exception as error:  # noqa: BLE001  # the caller raises all of them together
            errors.append(error)
    return errors
