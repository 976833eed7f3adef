"""The time of a bag that plays: how it runs with wall time, and when a message is due."""

from __future__ import annotations

import time

__all__ = ("Pace",)

_NS = 1_000_000_000


class Pace:
    """Runs through the time of a bag at a rate, with pauses.

    Args:
        start: Stamp that it begins at, in nanoseconds.
        rate: Seconds of the bag per second.
        paused: Whether it stands still at first.
    """

    def __init__(self, start: int, rate: float, *, paused: bool) -> None:
        self._stamp = start
        self._since = time.monotonic_ns()
        self._rate = rate
        self._paused = paused
        self._held = False

    @property
    def rate(self) -> float:
        """Seconds of the bag per second."""
        return self._rate

    @rate.setter
    def rate(self, rate: float) -> None:
        self.jump(self.now())
        self._rate = rate

    @property
    def paused(self) -> bool:
        """Whether it stands still."""
        return self._paused

    @paused.setter
    def paused(self, paused: bool) -> None:
        self.jump(self.now())
        self._paused = paused

    @property
    def held(self) -> bool:
        """Whether it waits for something else, and so stands still whether paused or not."""
        return self._held

    @held.setter
    def held(self, held: bool) -> None:
        self.jump(self.now())
        self._held = held

    def now(self) -> int:
        """Return the time of the bag, as a stamp."""
        if self._paused or self._held:
            return self._stamp
        return self._stamp + int((time.monotonic_ns() - self._since) * self._rate)

    def jump(self, stamp: int) -> None:
        """Go on from a stamp."""
        self._stamp, self._since = stamp, time.monotonic_ns()

    def left(self, stamp: int) -> float:
        """Return the seconds until a stamp is due; 0 or less if it is."""
        due = self._since + (stamp - self._stamp) / self._rate
        return (due - time.monotonic_ns()) / _NS
