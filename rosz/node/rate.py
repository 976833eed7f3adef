"""Loops at a steady rate, by the rules of ROS 1."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

from rosz.errors import ClosedError, TimeMovedBackwards, UsageError
from rosz.node.clock import Clock

__all__ = ("Pace", "Rate")

_HIGHEST_HZ = 1_000_000_000
_MISSED_PERIODS = 2


class Pace:
    """When the next turn of a loop is due: arithmetic only, no clock.

    A turn that starts late shortens the wait for the next, so that the mean rate holds. More than
    two periods late, the loop gives up what it missed and starts anew from where it is.

    Args:
        period_ns: Nanoseconds from turn to turn.
        now: Time at the start, in nanoseconds.

    Attributes:
        period_ns: As given.
        last: Time that the current period is counted from, in nanoseconds.
    """

    __slots__ = ("last", "period_ns")

    def __init__(self, period_ns: int, now: int) -> None:
        self.period_ns = period_ns
        self.last = now

    def remaining(self, now: int) -> int:
        """Return nanoseconds until the next turn; not above 0 if it is due."""
        self.last = min(self.last, now)
        return self.period_ns - (now - self.last)

    def step(self, now: int) -> None:
        """Go on to the next period.

        Args:
            now: Time before the wait that led here.
        """
        self.last += self.period_ns
        if now - self.last > _MISSED_PERIODS * self.period_ns:
            self.last = now

    def restart(self, now: int) -> None:
        """Count from here, as if the loop had just begun."""
        self.last = now


class Rate:
    """Hold a loop at a rate.

    Either sleep at the end of each turn, or loop over it::

        for tick in node.rate(10):
            ...

    which gives 0 at once, then 1, 2, … at the rate, until the node shuts down.

    Args:
        hz: Turns per second.
        clock: Whose time to go by; the loop ends when it is closed.
        reset: Whether `sleep` goes on, with a new period, when ROS time moves back.

    Raises:
        UsageError: `hz` is not above 0, or beyond nanoseconds.
    """

    def __init__(self, hz: float, clock: Clock, *, reset: bool = False) -> None:
        if not 0 < hz <= _HIGHEST_HZ or math.isinf(1e9 / hz):
            raise UsageError(f"rate is '{hz}' Hz: expected above 0 and at most {_HIGHEST_HZ}")
        self._clock = clock
        self._reset = reset
        self._pace = Pace(int(1e9 / hz), clock.steady())

    @property
    def period_ns(self) -> int:
        """Nanoseconds from turn to turn."""
        return self._pace.period_ns

    def remaining(self) -> int:
        """Return nanoseconds until the next turn; not above 0 if it is due."""
        return self._pace.remaining(self._clock.steady())

    def restart(self) -> None:
        """Count the period from now."""
        self._pace.restart(self._clock.steady())

    def sleep(self) -> None:
        """Sleep until the next turn is due; not at all if it already is.

        Raises:
            ClosedError: The clock's node or context was shut down, before or during the sleep.
            TimeMovedBackwards: ROS time moved back during the sleep, and `reset` is off.
        """
        if not self._pause(reset=self._reset):
            raise ClosedError("shut down during the sleep of a rate")

    def __iter__(self) -> Iterator[int]:
        """Count turns, sleeping between them, until shutdown; time that moves back is no end."""
        self.restart()
        for tick in itertools.count():
            if self._clock.closed:
                return
            yield tick
            if not self._pause(reset=True):
                return

    def _pause(self, *, reset: bool) -> bool:
        now = self._clock.steady()
        try:
            ended = self._clock.sleep(self._pace.remaining(now))
        except TimeMovedBackwards:
            if not reset:
                raise
            self.restart()
            return not self._clock.closed
        self._pace.step(now)
        return ended
