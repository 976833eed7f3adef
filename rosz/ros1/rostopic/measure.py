"""rostopic: rates, delays and bandwidths of topics."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable
from typing import Any

from rosz.introspect.measure import (
    BandwidthMeter,
    DelayMeter,
    RateMeter,
    format_bandwidth,
    format_delay,
    format_rate,
    format_rates,
)
from rosz.ros1 import rospy
from rosz.ros1.state import ready_context

__all__ = ("ROSTopicBandwidth", "ROSTopicDelay", "ROSTopicHz")

Stats = tuple[float, float, float, float, int]
"""Rate in Hz or delay in seconds; least, largest and standard deviation in seconds; count."""


class ROSTopicHz:
    """Measures rates of topics: `callback_hz` is a callback for subscribers.

    Args:
        window_size: Number of messages to average; 50 000 if negative.
        filter_expr: Function of a message that returns whether to count it.
        use_wtime: Whether to use wall time even in simulation.
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
            m: The message.
            topic: Name of the topic.
        """
        if self.filter_expr is not None and not self.filter_expr(m):
            return
        now = time.time_ns() if self.use_wtime else ready_context().clock.now()
        self._meter(topic).tick(now)

    def get_hz(self, topic: str | None = None) -> Stats | None:
        """Return the measured rate, or None if there are no new messages since the last call."""
        stats = self._meter(topic).stats()
        if stats is None:
            return None
        return stats.rate, stats.min_delta, stats.max_delta, stats.std_dev, stats.window

    def print_hz(self, topics: Iterable[str | None] = (None,)) -> None:
        """Write the measured rates to stdout."""
        names = list(topics)
        if len(names) == 1:
            text = format_rate(self._meter(names[0]).stats())
        else:
            text = format_rates({str(name): self._meter(name).stats() for name in names})
        sys.stdout.write(f"{text}\n")


class ROSTopicDelay:
    """Measures how old messages are when they arrive: `callback_delay` is a callback.

    Args:
        window_size: Number of messages to average; 50 000 if negative.
    """

    def __init__(self, window_size: int) -> None:
        self.window_size = window_size
        self._meter = DelayMeter(None if window_size < 0 else window_size)

    def callback_delay(self, msg: Any) -> None:
        """Count a message; one without a header is an error of the log."""
        if not msg._has_header:
            rospy.logerr("msg does not have header")
            return
        self._meter.add(msg.header.stamp.to_nsec(), ready_context().clock.now())

    def get_delay(self) -> Stats | None:
        """Return the measured delay, or None if there are no new messages since the last call."""
        stats = self._meter.stats()
        if stats is None:
            return None
        return stats.mean, stats.min_delay, stats.max_delay, stats.std_dev, stats.window

    def print_delay(self) -> None:
        """Write the measured delay to stdout, once there is one."""
        if self._meter.begun:
            sys.stdout.write(f"{format_delay(self._meter.stats())}\n")


class ROSTopicBandwidth:
    """Measures bytes per second: `callback` is a callback for subscribers to ``rospy.AnyMsg``.

    Args:
        window_size: Number of messages to average.
    """

    def __init__(self, window_size: int = 100) -> None:
        self.window_size = window_size or 100
        self._meter = BandwidthMeter(self.window_size)

    def callback(self, data: Any) -> None:
        """Count a message."""
        self._meter.add(len(data._buff), time.monotonic_ns())  # noqa: SLF001  # ROS 1's

    def print_bw(self) -> None:
        """Write the measured bandwidth to stdout, once there are two messages."""
        stats = self._meter.stats(time.monotonic_ns())
        if stats is not None:
            sys.stdout.write(f"{format_bandwidth(stats)}\n")
