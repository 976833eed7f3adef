"""How old messages are when they come, by the stamp in their header: ``rostopic delay``."""

from __future__ import annotations

from collections import deque
from math import sqrt
from struct import Struct

import msgspec

from rosz.errors import DecodeError

__all__ = ("DelayMeter", "DelayStats", "read_stamp", "report")

LONGEST_WINDOW = 50_000
_SECOND = 1_000_000_000
_STAMPS = {b"\0\1": Struct("<4xiI").unpack_from, b"\0\0": Struct(">4xiI").unpack_from}
_SIZE = 12


def read_stamp(payload: bytes, type_name: str) -> int:
    """Return the stamp of an encoded message that begins with a header, in nanoseconds.

    Args:
        payload: The message; no more of it is read than needed.
        type_name: Its type, for errors.

    Raises:
        DecodeError: It is too short, or no CDR.
    """
    unpack = _STAMPS.get(payload[:2])
    if unpack is None or len(payload) < _SIZE:
        raise DecodeError(type_name, 0, f"expected a header, got {payload[:_SIZE].hex(' ')}")
    seconds, nanoseconds = unpack(payload)
    return int(seconds) * _SECOND + int(nanoseconds)


class DelayStats(msgspec.Struct, frozen=True):
    """What was measured; times are in seconds.

    Attributes:
        mean: Mean age.
        min_delay: Lowest age; negative where the sender's clock is ahead.
        max_delay: Highest age.
        std_dev: Standard deviation.
        window: Messages that this is calculated from.
    """

    mean: float
    min_delay: float
    max_delay: float
    std_dev: float
    window: int


class DelayMeter:
    """Collects ages; one thread adds, another one asks.

    Args:
        window: Messages to calculate from, the newest; 50 000 when not given.
    """

    def __init__(self, window: int | None = None) -> None:
        size = LONGEST_WINDOW if window is None else window
        self._delays: deque[int] = deque(maxlen=max(size - 1, 0))
        self._last = -1
        self._told = -1

    @property
    def begun(self) -> bool:
        """Whether there is anything to tell."""
        return bool(self._delays)

    def add(self, stamp: int, now: int) -> None:
        """Count a message.

        Args:
            stamp: Nanoseconds, from its header.
            now: ROS time in nanoseconds; when it goes back, counting begins anew.
        """
        last, self._last = self._last, now
        if 0 <= last <= now:
            self._delays.append(now - stamp)
        else:
            self._delays.clear()

    def stats(self) -> DelayStats | None:
        """Return what was measured; ``None`` if nothing new has come since the last time."""
        last = self._last
        delays = self._delays.copy()
        if not delays or last == self._told:
            return None
        self._told = last
        count = len(delays)
        mean = sum(delays) / count
        deviation = sqrt(sum((delay - mean) ** 2 for delay in delays) / count)
        return DelayStats(
            mean / _SECOND,
            min(delays) / _SECOND,
            max(delays) / _SECOND,
            deviation / _SECOND,
            count + 1,
        )


def report(stats: DelayStats | None) -> str:
    """Return what ``rostopic delay`` prints."""
    if stats is None:
        return "no new messages"
    return (
        f"average delay: {stats.mean:.3f}\n\tmin: {stats.min_delay:.3f}s"
        f" max: {stats.max_delay:.3f}s std dev: {stats.std_dev:.5f}s window: {stats.window}"
    )
