"""How many bytes come: ``rostopic bw``."""

from __future__ import annotations

from collections import deque

import msgspec

__all__ = ("BandwidthMeter", "BandwidthStats", "report")

DEFAULT_WINDOW = 100
_SECOND = 1_000_000_000
_FEWEST = 2
_KILO, _MEGA = 1e3, 1e6


class BandwidthStats(msgspec.Struct, frozen=True):
    """What was measured; sizes are in bytes.

    Attributes:
        bytes_per_second: From the oldest message of the window until now.
        mean: Mean size of a message.
        min_size: Size of the smallest.
        max_size: Size of the largest.
        window: Messages that this is calculated from.
    """

    bytes_per_second: float
    mean: float
    min_size: int
    max_size: int
    window: int


class BandwidthMeter:
    """Adds sizes up; one thread adds, another one asks.

    Args:
        window: Messages to calculate from, the newest. When not given, the newest 100, and more
            where that many come within a second, so that high rates are told as truly as low ones.
    """

    def __init__(self, window: int | None = None) -> None:
        self._window = DEFAULT_WINDOW if window is None else max(window, 1)
        self._span = _SECOND if window is None else 0
        self._seen: deque[tuple[int, int]] = deque()

    def add(self, size: int, now: int) -> None:
        """Count a message.

        Args:
            size: Its bytes.
            now: Nanoseconds, of a clock that never goes back.
        """
        seen = self._seen
        seen.append((now, size))
        while len(seen) > self._window and now - seen[0][0] >= self._span:
            seen.popleft()

    def stats(self, now: int) -> BandwidthStats | None:
        """Return what was measured; ``None`` before the second message."""
        seen = self._seen.copy()
        if len(seen) < _FEWEST:
            return None
        sizes = [size for _, size in seen]
        total = sum(sizes)
        seconds = max(now - seen[0][0], 1) / _SECOND
        return BandwidthStats(
            total / seconds, total / len(sizes), min(sizes), max(sizes), len(sizes)
        )


def report(stats: BandwidthStats) -> str:
    """Return what ``rostopic bw`` prints: all numbers in the unit that suits the first."""
    scale, unit = 1.0, "B"
    if stats.bytes_per_second >= _MEGA:
        scale, unit = _MEGA, "MB"
    elif stats.bytes_per_second >= _KILO:
        scale, unit = _KILO, "KB"
    per_second, mean, low, high = (
        f"{value / scale:.2f}{unit}"
        for value in (stats.bytes_per_second, stats.mean, stats.min_size, stats.max_size)
    )
    return f"average: {per_second}/s\n\tmean: {mean} min: {low} max: {high} window: {stats.window}"
