"""Wall and ROS time, and sleeping in it.

A clock and all its branches share one source of time: the clock of the context, those of its nodes,
and those of their timers. Each can be closed by itself, which ends the sleeps on it and on its
branches at once.

A sleep adds itself to a set, looks at the time and the state of the clock once more, and only then
waits, on a lock of its own that is released to wake it. So no wake-up is lost, nothing polls, and a
tick of ``/clock`` wakes only the sleeps whose time has come. No lock is held meanwhile, so a signal
handler may close a clock.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable

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
    """

    before: int
    after: int

    @property
    def delta(self) -> int:
        """Size of the jump in nanoseconds; negative if time moved back."""
        return self.after - self.before


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

    __slots__ = ("advancing", "last", "now", "observers", "simulated", "sleepers")

    def __init__(self) -> None:
        self.now = 0
        self.simulated = False
        self.sleepers: set[_Sleeper] = set()
        self.observers: list[tuple[Callable[[TimeJump], None], int | None]] = []
        self.advancing = threading.Lock()
        self.last: tuple[bytes, int] = b"", 0

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
        self._parent: Clock | None = None
        self._closed = False

    def branch(self) -> Clock:
        """Return a clock of the same time that is closed with this one, or alone."""
        clock = Clock()
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
        self._source.simulated = True

    def advance(self, time_ns: int, *, publisher: bytes = b"", number: int = 0) -> None:
        """Set ROS time, and wake the sleeps whose time has come.

        Each node of a context receives ``/clock`` on a thread of its own, and one that lags behind
        the others must not set time back. So publishers number their messages, from 1, and a
        message older than the last one of the same publisher is ignored.

        Args:
            time_ns: Time in nanoseconds; may be earlier than before, as when a simulation restarts.
            publisher: Gid of the publisher of the time.
            number: Number of its message; 0 if it does not count.

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
            last_publisher, last = source.last
            if publisher == last_publisher and 0 < number <= last:
                return
            source.last = publisher, number
            before, source.now = source.now, time_ns
            for sleeper in list(source.sleepers):
                if sleeper.is_due(time_ns):
                    source.wake(sleeper, time_ns)
        if before:
            self._report(TimeJump(before, time_ns))

    def on_jump(
        self, observer: Callable[[TimeJump], None], *, forward_ns: int | None = None
    ) -> Callable[[], None]:
        """Call a function when ROS time jumps back, or far enough forward.

        It is called on the thread that advances the clock, after the time is set.

        Args:
            observer: Function that gets the jump.
            forward_ns: Smallest step forward that counts as a jump; none does when not given.

        Returns:
            A function that removes the observer.
        """
        entry = (observer, forward_ns)
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
        if not self._source.simulated:
            return self._sleep_wall(duration_ns)
        start = self._await_start()
        return start is not None and self._await(start, start + duration_ns) is not None

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
        if not self._source.simulated:
            return self._sleep_wall(time_ns - time.time_ns())
        start = self._await_start()
        return start is not None and self._await(start, time_ns) is not None

    def close(self) -> None:
        """End all sleeps on this clock and its branches, later ones too; again has no effect."""
        self._closed = True
        source = self._source
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
        """Wait for a ROS time and return the one that ended the wait; None if closed."""
        source = self._source
        sleeper = _Sleeper(self, start, target)
        source.sleepers.add(sleeper)
        try:
            now = source.now
            if not sleeper.is_due(now) and not self.closed:
                sleeper.lock.acquire()
                now = sleeper.woken
        finally:
            source.sleepers.discard(sleeper)
        if self.closed:
            return None
        if now < start:
            raise TimeMovedBackwards(start, now)
        return now

    def _report(self, jump: TimeJump) -> None:
        errors: list[Exception] = []
        for observer, forward_ns in list(self._source.observers):
            if jump.delta < 0 or (forward_ns is not None and jump.delta >= forward_ns):
                try:
                    observer(jump)
                except Exception as error:  # noqa: BLE001  # raised together below
                    errors.append(error)
        if errors:
            raise ExceptionGroup("observers of a jump of time failed", errors)
