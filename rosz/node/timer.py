"""Work at a steady rate: loops with a `Rate`, and callbacks with a `Timer`, by ROS 1's rules."""

from __future__ import annotations

import itertools
import math
import threading
import time
from collections.abc import Callable, Iterator

import msgspec

from rosz.errors import ClosedError, TimeMovedBackwards, UsageError
from rosz.lifecycle import Closing
from rosz.node.clock import Clock
from rosz.session import clamp_timeout

_HIGHEST_HZ = 1_000_000_000  # clocks count nanoseconds
_MISSED_PERIODS = 2  # as in rospy, whose Rate starts anew when it is later


class _Pace:
    """The time at which the next turn of a loop is due; it does not read a clock.

    A turn that starts late shortens the wait for the next, so that the mean rate holds. A loop that
    is more than two periods late skips the turns that it missed.
    """

    __slots__ = ("last", "period_ns")

    def __init__(self, period_ns: int, now: int) -> None:
        self.period_ns = period_ns
        self.last = now

    def remaining(self, now: int) -> int:
        """Return the nanoseconds until the next turn; 0 or less if it is due."""
        self.last = min(self.last, now)
        return self.period_ns - (now - self.last)

    def step(self, now: int) -> None:
        """Begin the next period; `now` is the time before the wait for the turn."""
        self.last += self.period_ns
        if now - self.last > _MISSED_PERIODS * self.period_ns:
            self.last = now


class Rate:
    """Run a loop at a rate.

    Call `sleep` at the end of each turn, or iterate::

        for tick in node.rate(10):
            ...

    which yields 0 at once, then 1, 2, … at the rate, until the node shuts down.

    Args:
        hz: Turns per second.
        clock: Clock to use; the loop ends when it is closed.
        reset: Whether `sleep` begins a new period when ROS time moves back, instead of raising.

    Raises:
        UsageError: `hz` is not above 0, or a period is less than a nanosecond.
    """

    def __init__(self, hz: float, clock: Clock, *, reset: bool = False) -> None:
        if not 0 < hz <= _HIGHEST_HZ or math.isinf(1e9 / hz):
            raise UsageError(f"rate is '{hz}' Hz: expected above 0 and at most {_HIGHEST_HZ}")
        self._clock = clock
        self._reset = reset
        self._pace = _Pace(int(1e9 / hz), clock.steady())

    @property
    def period_ns(self) -> int:
        """Period in nanoseconds."""
        return self._pace.period_ns

    def remaining(self) -> int:
        """Return the nanoseconds until the next turn; 0 or less if it is due."""
        return self._pace.remaining(self._clock.steady())

    def restart(self) -> None:
        """Begin a period now."""
        self._pace.last = self._clock.steady()

    def sleep(self) -> None:
        """Sleep until the next turn is due.

        Raises:
            ClosedError: The node or context of the clock was shut down before or during the sleep.
            TimeMovedBackwards: ROS time moved back during the sleep, and `reset` is off.
        """
        if not self._pause(reset=self._reset):
            raise ClosedError("shut down during the sleep of a rate")

    def __iter__(self) -> Iterator[int]:
        """Yield 0, 1, 2, … at the rate, until shutdown; also when ROS time moves back."""
        self.restart()
        for tick in itertools.count():
            if self._clock.closed:
                return
            yield tick
            if not self._pause(reset=True):
                return

    def _pause(self, *, reset: bool) -> bool:
        now, simulated = self._clock.steady(), self._clock.simulated
        try:
            ended = self._clock.sleep(self._pace.remaining(now))
        except TimeMovedBackwards:
            if not reset:
                raise
            self.restart()
            return not self._clock.closed
        self._pace.step(now)
        if self._clock.simulated is not simulated:
            self.restart()
        return ended


class TimerEvent(msgspec.Struct, frozen=True):
    """The times at which calls of a timer were due and made; ROS 1's fields, in nanoseconds.

    Attributes:
        last_expected: Time at which the previous call was due; None at the first.
        last_real: Time at which it was made; None at the first.
        current_expected: Time at which this call was due.
        current_real: Time at which it was made.
        last_duration: Duration of the previous call in wall time; None at the first.
    """

    last_expected: int | None
    last_real: int | None
    current_expected: int
    current_real: int
    last_duration: int | None


class Timer(Closing):
    """Call a function at each period until closed, or once.

    Calls never overlap. Like a `Rate`, the timer makes up for a late call, and skips the calls that
    it missed when it is more than two periods late. In simulated time it starts with the first
    ``/clock``.

    Args:
        period_ns: Period in nanoseconds; the first call is due after one period.
        callback: Function that gets a `TimerEvent`.
        clock: Clock to use; the timer ends when it is closed.
        on_error: Function that gets a text and what the callback raised; the timer goes on.
        oneshot: Whether to call only once.
        reset: Whether to call at once and begin anew when ROS time moves back; otherwise, as in
            ROS 1, the timer calls `on_error` and ends.
        name: Name of the timer in such texts and of its thread.
        on_end: Function that gets the timer, on its thread, when it has ended.

    Raises:
        UsageError: The period is not above 0.
    """

    def __init__(
        self,
        period_ns: int,
        callback: Callable[[TimerEvent], object],
        clock: Clock,
        *,
        on_error: Callable[[str, BaseException], None],
        oneshot: bool = False,
        reset: bool = False,
        name: str = "",
        on_end: Callable[[Timer], None] | None = None,
    ) -> None:
        if period_ns <= 0:
            raise UsageError(f"timer period is '{period_ns}' ns: expected above 0")
        self.period_ns = period_ns
        self.name: str = name or getattr(callback, "__qualname__", repr(callback))
        self._callback = callback
        self._clock = clock.branch()
        self._on_error = on_error
        self._oneshot = oneshot
        self._reset = reset
        self._on_end = on_end
        self._thread = threading.Thread(
            target=self._run, name=f"rosz-timer {self.name}", daemon=True
        )
        self._thread.start()

    @property
    def alive(self) -> bool:
        """Whether the timer has calls to make, or is making its last one."""
        return self._thread.is_alive()

    def close(self) -> None:
        """Make no more calls; the callback may do this, too, and a second call has no effect.

        It does not wait for a call in progress; see `join`.
        """
        self._clock.close()

    shutdown = close

    def join(self, timeout: float | None = None) -> bool:
        """Wait until the timer has ended.

        Args:
            timeout: Time limit in seconds; none when not given.

        Returns:
            Whether it has ended; False, at once, in its own callback.

        Raises:
            UsageError: The timeout is not a number.
        """
        if threading.current_thread() is self._thread:
            return False
        self._thread.join(None if timeout is None else clamp_timeout(timeout))
        return not self._thread.is_alive()

    def __repr__(self) -> str:
        state = "" if self.alive else " ended"
        return f"<Timer {self.name} every {self.period_ns / 1e9:g} s{state}>"

    def _run(self) -> None:
        try:
            self._loop()
        finally:
            if self._on_end is not None:
                self._on_end(self)

    def _loop(self) -> None:
        clock = self._clock
        if not clock.wait_started():
            return
        pace = _Pace(self.period_ns, clock.steady())
        expected = clock.now() + self.period_ns
        last_expected: int | None = None
        last_real: int | None = None
        last_duration: int | None = None
        while True:
            now, simulated = clock.steady(), clock.simulated
            try:
                if not clock.sleep(pace.remaining(now)):
                    return
                pace.step(now)
                if clock.simulated is not simulated:
                    pace.last, expected = clock.steady(), clock.now()
            except TimeMovedBackwards as error:
                if not self._reset:
                    self._on_error(f"timer '{self.name}' stopped", error)
                    return
                pace.last = clock.steady()
                expected = clock.now()
            real = clock.now()
            began = time.monotonic_ns()
            self._call(TimerEvent(last_expected, last_real, expected, real, last_duration))
            if self._oneshot:
                return
            last_duration = time.monotonic_ns() - began
            last_expected, last_real = expected, real
            expected += self.period_ns

    def _call(self, event: TimerEvent) -> None:
        try:
            self._callback(event)
        except BaseException as error:  # noqa: BLE001  # the timer outlives what it raises
            # What a callback tries while its node is being shut down is not its fault.
            if not (isinstance(error, ClosedError) and self._clock.closed):
                self._on_error(f"callback of timer '{self.name}' failed", error)
