"""Wall and ROS time, and sleeping in it.

One time source is shared by a clock and all its branches: the context's clock, those of its nodes,
those of their timers. Each of them can be closed by itself, which ends the sleeps on it and on its
branches at once.

A sleeper enters itself in a set, looks at time and closing once more, and only then waits, on a
lock of its own that whoever wakes it releases. So no wake-up is lost, nobody polls, a tick of
``/clock`` wakes only those whose time has come, and, because nothing is held meanwhile, closing is
safe from a signal handler too.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable

import msgspec

from rosz.errors import TimeMovedBackwards, UsageError
from rosz.session import LONGEST_WAIT

__all__ = ("Clock", "TimeJump", "nanoseconds")


def nanoseconds(seconds: float, what: str) -> int:
    """Return seconds as nanoseconds.

    Args:
        seconds: Of any sign.
        what: What lasts so long, for the error.

    Raises:
        UsageError: It is no number, or infinite.
    """
    if not math.isfinite(seconds):
        raise UsageError(f"{what} is '{seconds}' s: expected a finite number")
    return round(seconds * 1e9)


class TimeJump(msgspec.Struct, frozen=True):
    """A leap of ROS time.

    Attributes:
        before: ROS time before it, in nanoseconds.
        after: ROS time after it, in nanoseconds.
    """

    before: int
    after: int

    @property
    def delta(self) -> int:
        """How far time moved, in nanoseconds; negative when it moved back."""
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
        """Tell whether a ROS time ends the sleep; nothing but closing ends a sleep in wall time."""
        return self.target is not None and (now >= self.target or now < self.start)


class _Source:
    """The time that a clock and its branches share."""

    __slots__ = ("advancing", "heard", "now", "observers", "simulated", "sleepers")

    def __init__(self) -> None:
        self.now = 0
        self.simulated = False
        self.sleepers: set[_Sleeper] = set()
        self.observers: list[tuple[Callable[[TimeJump], None], int | None]] = []
        self.advancing = threading.Lock()
        self.heard: tuple[bytes, int] = b"", 0

    def wake(self, sleeper: _Sleeper, now: int) -> None:
        """End a sleep, unless somebody else just did."""
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
        self._source = _Source()
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

        Simulated, it is the newest time of ``/clock``, and 0 before the first.
        """
        source = self._source
        return source.now if source.simulated else time.time_ns()

    def steady(self) -> int:
        """Return nanoseconds to measure intervals with.

        In wall time they come from the monotonic clock, which nobody sets; simulated, they are
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
        """Whether this clock, or one that it branched off, is closed."""
        return self._closed or (self._parent is not None and self._parent.closed)

    def enable_simulation(self) -> None:
        """Take time from `advance` from now on; it is 0 until the first.

        Sleeps under way end by the wall time they began in.
        """
        self._source.simulated = True

    def advance(self, time_ns: int, *, teller: bytes = b"", number: int = 0) -> None:
        """Set ROS time, and wake who waited for it.

        Each node of a context hears ``/clock`` on a thread of its own, and one that lags behind the
        others must not set time back. So who tells the time numbers what it says, from 1, and what
        the same one said before the last thing heard of it is left out.

        Args:
            time_ns: Nanoseconds; may be earlier than before, as when a simulation starts over.
            teller: Who tells it.
            number: Of what it says; 0 where it does not count.

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
            last_teller, last = source.heard
            if teller == last_teller and 0 < number <= last:
                return
            source.heard = teller, number
            before, source.now = source.now, time_ns
            for sleeper in list(source.sleepers):
                if sleeper.is_due(time_ns):
                    source.wake(sleeper, time_ns)
        if before:
            self._tell(TimeJump(before, time_ns))

    def on_jump(
        self, observer: Callable[[TimeJump], None], *, forward_ns: int | None = None
    ) -> Callable[[], None]:
        """Have a function called when ROS time moves back, or forward by a leap.

        It runs on the thread that advances the clock, after the time is set.

        Args:
            observer: What to call.
            forward_ns: The least step forward that counts as a leap; none does when not given.

        Returns:
            A function that ends the observation.
        """
        entry = (observer, forward_ns)
        observers = self._source.observers
        observers.append(entry)

        def withdraw() -> None:
            if entry in observers:
                observers.remove(entry)

        return withdraw

    def wait_started(self) -> bool:
        """Wait until there is a time: in simulation, for the first ``/clock`` above 0.

        Returns:
            Whether there is; False, at once, if the clock is closed.
        """
        if self._source.simulated:
            self._await_start()
        return not self.closed

    def sleep(self, duration_ns: int) -> bool:
        """Sleep for a time; simulated, from the first ``/clock`` on.

        Args:
            duration_ns: Nanoseconds; nothing to sleep for if not above 0.

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

        In wall time the length of the sleep is settled when it begins: setting the machine's clock
        meanwhile changes nothing.

        Args:
            time_ns: Nanoseconds since the Unix epoch, or of ROS time.

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
        """End all sleeps on this clock and its branches, those to come too; again is no error."""
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

    def _tell(self, jump: TimeJump) -> None:
        errors: list[Exception] = []
        for observer, forward_ns in list(self._source.observers):
            if jump.delta < 0 or (forward_ns is not None and jump.delta >= forward_ns):
                try:
                    observer(jump)
                except Exception as error:  # noqa: BLE001  # raised together below
                    errors.append(error)
        if errors:
            raise ExceptionGroup("observers of a jump of time failed", errors)
