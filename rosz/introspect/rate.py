"""How often messages come: ``rostopic hz``."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from math import sqrt

import msgspec

__all__ = ("RateMeter", "RateStats", "report", "report_all")

LONGEST_WINDOW = 50_000
_SECOND = 1e9
_COLUMNS = ("topic", "rate", "min_delta", "max_delta", "std_dev", "window")


class RateStats(msgspec.Struct, frozen=True):
    """What was measured; times are in seconds.

    Attributes:
        rate: Messages per second.
        min_delta: Shortest time between two messages.
        max_delta: Longest time between two messages.
        std_dev: Standard deviation of these times.
        window: Messages that this is calculated from.
    """

    rate: float
    min_delta: float
    max_delta: float
    std_dev: float
    window: int


class RateMeter:
    """Counts messages; one thread ticks, another one asks.

    Args:
        window: Messages to calculate from, the newest; 50 000 when not given.
    """

    def __init__(self, window: int | None = None) -> None:
        size = LONGEST_WINDOW if window is None else window
        self._deltas: deque[int] = deque(maxlen=max(size - 1, 0))
        self._last = -1
        self._told = -1

    def tick(self, now: int) -> None:
        """Count a message.

        Args:
            now: Nanoseconds, of whatever clock; when it goes back, counting begins anew.
        """
        last, self._last = self._last, now
        if 0 <= last <= now:
            self._deltas.append(now - last)
        else:
            self._deltas.clear()

    def stats(self) -> RateStats | None:
        """Return what was measured; ``None`` if nothing new has come since the last time."""
        last = self._last
        deltas = self._deltas.copy()
        if not deltas or last == self._told:
            return None
        self._told = last
        count = len(deltas)
        mean = sum(deltas) / count
        variance = sum((delta - mean) ** 2 for delta in deltas) / count
        return RateStats(
            rate=_SECOND / mean if mean > 0 else 0.0,
            min_delta=min(deltas) / _SECOND,
            max_delta=max(deltas) / _SECOND,
            std_dev=sqrt(variance) / _SECOND,
            window=count + 1,
        )


def report(stats: RateStats | None) -> str:
    """Return what ``rostopic hz`` prints about one topic."""
    if stats is None:
        return "no new messages"
    return (
        f"average rate: {stats.rate:.3f}\n\tmin: {stats.min_delta:.3f}s"
        f" max: {stats.max_delta:.3f}s std dev: {stats.std_dev:.5f}s window: {stats.window}"
    )


def report_all(found: Mapping[str, RateStats | None]) -> str:
    """Return what ``rostopic hz`` prints about several topics: a table."""
    rows = [
        (name, *(f"{value:.4}" for value in msgspec.structs.astuple(s)[:-1]), str(s.window))
        for name, s in found.items()
        if s is not None
    ]
    if not rows:
        return "no new messages"
    widths = [max(map(len, column)) for column in zip(_COLUMNS, *rows, strict=True)]
    head = "   ".join(map(str.center, _COLUMNS, widths))
    body = ["   ".join(map(str.ljust, row, widths)) for row in rows]
    return "\n".join([head, "=" * len(head), *body, ""])
