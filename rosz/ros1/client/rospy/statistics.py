"""Statistics of the topics that a node receives (ROS wiki, Topics, topic statistics).

A subscription measures each connection if the parameter ``/enable_statistics`` is true as it opens.
A window is as long as it takes for a fair number of messages to arrive.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import pairwise
from math import sqrt
from typing import Any

import msgspec

from rosz.msgs.builtin_interfaces.msg import Duration, Time
from rosz.msgs.rosgraph_msgs.msg import TopicStatistics
from rosz.node import MessageInfo
from rosz.params.replica import Params

_SECOND = 1_000_000_000


class Statistics:
    """Measures the connections of one subscription.

    Args:
        topic: Full name of the topic.
        node: Full name of the node that receives it.
        params: Parameters: ``/statistics_window_min_elements``, ``_max_elements``, and in seconds
            ``_min_size`` and ``_max_size``.
        publish: Function called with a TopicStatistics at the end of each window.

    Raises:
        ParamError: A parameter is not a number.
    """

    def __init__(
        self, topic: str, node: str, params: Params, publish: Callable[[TopicStatistics], object]
    ) -> None:
        def limit(name: str, default: float) -> float:
            return params.get(f"/statistics_window_{name}", default, type=float)

        self._topic = topic
        self._node = node
        self._publish = publish
        self._elements = limit("min_elements", 10), limit("max_elements", 100)
        self._seconds = limit("min_size", 4), limit("max_size", 64)
        self._windows: dict[str, _Window] = {}

    def record(self, message: Any, info: MessageInfo, publisher: str, now: int) -> None:
        """Count a message of a node, and publish the statistics of a window that ends with it.

        ``now`` is the ROS time in nanoseconds.
        """
        window = self._windows.get(publisher)
        if window is None:
            window = self._windows[publisher] = _Window(now)
        window.arrivals.append(now)
        window.size += info.size
        window.lost += info.lost
        if message._has_header:
            window.ages.append(now - message.header.stamp.to_nsec())
        if now - window.published > window.period * _SECOND:
            window.published = now
            self._publish(self._summary(window, publisher, now))
            self._windows[publisher] = self._next(window, now)

    def _summary(self, window: _Window, publisher: str, now: int) -> TopicStatistics:
        periods = [after - before for before, after in pairwise(window.arrivals)]
        return TopicStatistics(
            self._topic,
            publisher,
            self._node,
            Time.from_nsec(window.start),
            Time.from_nsec(now),
            len(window.arrivals),
            window.lost,
            window.size,
            *_spread(periods),
            *_spread(window.ages),
        )

    def _next(self, window: _Window, now: int) -> _Window:
        """Return the next window: longer after one with few messages, shorter after a full one."""
        fewest, most = self._elements
        shortest, longest = self._seconds
        count, period = len(window.arrivals), window.period
        if count > most and period / 2 >= shortest:
            period /= 2
        if count < fewest and period * 2 <= longest:
            period *= 2
        return _Window(now, now, period)


class _Window(msgspec.Struct):
    """Messages of one publisher since a time; times in nanoseconds, the period in seconds."""

    start: int
    published: int = 0
    period: float = 1.0
    arrivals: list[int] = []
    ages: list[int] = []
    size: int = 0
    lost: int = 0


def _spread(values: Iterable[int]) -> tuple[Duration, Duration, Duration]:
    """Return the mean, the standard deviation and the largest of durations in nanoseconds."""
    durations = list(values) or [0]
    mean = sum(durations) / len(durations)
    deviation = sqrt(sum((mean - value) ** 2 for value in durations) / len(durations))
    return (
        Duration.from_nsec(round(mean)),
        Duration.from_nsec(round(deviation)),
        Duration.from_nsec(max(durations)),
    )
