"""Stamps that order writes across machines: a hybrid logical clock.

Zenoh's own timestamps are such a clock, but a router may re-stamp what lies in its future, and they
cannot be made again from their number. So rosz keeps the clock itself, in whole nanoseconds, which
Zenoh's 64-bit NTP times carry without loss; who needs a stamp to arrive unchanged under any clock
puts it into the payload or attachment as well.
"""

from __future__ import annotations

import threading
import time

import msgspec

__all__ = ("HybridClock", "Stamp")


class Stamp(msgspec.Struct, frozen=True, order=True):
    """A moment that no two writes share; ordered by time, then by clock.

    Attributes:
        time: Nanoseconds since the Unix epoch, moved forward where that keeps the order.
        id: The clock it was taken from: a session id, lower-case hex.
    """

    time: int
    id: str


class HybridClock:
    """Gives stamps that grow, and are later than every stamp it has been shown.

    Args:
        clock_id: Name of this clock: the session id.
    """

    def __init__(self, clock_id: str) -> None:
        self._id = clock_id
        self._last = 0
        self._lock = threading.Lock()

    def now(self) -> Stamp:
        """Return a new stamp."""
        with self._lock:
            self._last = max(self._last + 1, time.time_ns())
            return Stamp(self._last, self._id)

    def observe(self, stamp: Stamp) -> None:
        """Make all further stamps later than this one."""
        with self._lock:
            self._last = max(self._last, stamp.time)
