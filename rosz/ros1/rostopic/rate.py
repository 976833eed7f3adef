"""How often messages come."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable
from typing import Any

from rosz.introspect.measure import RateMeter, format_rate, format_rates
from rosz.ros1.rosgraph import live

__all__ = ("ROSTopicHz",)

Stats = tuple[float, float, float, float, int]
"""Rate, least and largest seconds between two, standard deviation, number of messages."""


class ROSTopicHz:
    """Counts messages: its `callback_hz` is a callback of subscribers.

    Args:
        window_size: Messages to calculate from; 50 000 if negative.
        filter_expr: Tells of a message whether it counts.
        use_wtime: Whether to go by wall time though there is a simulation.
    """

    def __init__(
        self,
        window_size: int,
        filter_expr: Callable[[Any], bool] | None = None,
        use_wtime: bool = False,
    ) -> None:
        self.window_size = window_size
        self.filter_expr = filter_expr
        self.use_wtime = use_wtime
        self._meters: dict[str | None, RateMeter] = {}

    def _meter(self, topic: str | None) -> RateMeter:
        meter = self._meters.get(topic)
        if meter is None:
            window = None if self.window_size < 0 else self.window_size
            meter = self._meters.setdefault(topic, RateMeter(window))
        return meter

    def callback_hz(self, m: Any, topic: str | None = None) -> None:
        """Count a message.

        Args:
            m: It.
            topic: What to count it for.
        """
        if self.filter_expr is not None and not self.filter_expr(m):
            return
        now = time.time_ns() if self.use_wtime else live.context().clock.now()
        self._meter(topic).tick(now)

    def get_hz(self, topic: str | None = None) -> Stats | None:
        """Return what was measured; None if nothing new has come since the last time."""
        stats = self._meter(topic).stats()
        if stats is None:
            return None
        return stats.rate, stats.min_delta, stats.max_delta, stats.std_dev, stats.window

    def print_hz(self, topics: Iterable[str | None] = (None,)) -> None:
        """Write what was measured to stdout."""
        names = list(topics)
        if len(names) == 1:
            text = format_rate(self._meter(names[0]).stats())
        else:
            text = format_rates({str(name): self._meter(name).stats() for name in names})
        sys.stdout.write(f"{text}\n")
