"""Rates and bandwidths of topics, measured while a page shows them."""

from __future__ import annotations

import threading
import time
from collections import deque

import msgspec

from rosz.access import PagePolicy
from rosz.errors import DecodeError
from rosz.introspect import BandwidthMeter, BandwidthStats, Survey, subscribe_samples
from rosz.names import is_of_action, short_type
from rosz.node import Entity, Node
from rosz.session import Sample
from rosz.wire import Kind, Token, read_attachment

_HEAVY = frozenset(
    {
        "nav_msgs/OccupancyGrid",
        "sensor_msgs/CompressedImage",
        "sensor_msgs/Image",
        "sensor_msgs/PointCloud",
        "sensor_msgs/PointCloud2",
        "stereo_msgs/DisparityImage",
    }
)
"""Types that are measured only on request, since measuring a topic means to receive it."""


_AGES = 50
"""Number of newest messages whose latency counts."""


class Flow(msgspec.Struct, frozen=True):
    """Rate and bandwidth of a topic.

    Attributes:
        rate: Messages per second.
        bandwidth: Bytes per second.
        size: Mean size of a message in bytes.
        latency: Mean time in seconds from sending to receiving, by the clocks of both machines;
            None if it is not known.
    """

    rate: float
    bandwidth: float
    size: float
    latency: float | None = None


def flow_of(stats: BandwidthStats | None) -> Flow | None:
    """Return the flow that a meter measured; None if too few messages have come."""
    if stats is None:
        return None
    rate = stats.bytes_per_second / stats.mean if stats.mean else 0.0
    return Flow(rate, stats.bytes_per_second, stats.mean)


class _Tap:
    """The subscription of one topic, and its meter."""

    def __init__(self, node: Node, token: Token) -> None:
        self._meter = BandwidthMeter()
        self._ages: deque[int] = deque(maxlen=_AGES)
        self._entity: Entity = subscribe_samples(
            node, token.name, token.type_name, token.type_hash, self._receive
        )

    def _receive(self, sample: Sample) -> None:
        self._meter.add(sample.size, time.monotonic_ns())
        try:
            _, sent, _ = read_attachment(sample.attachment)
        except DecodeError:  # the sender does not say when it sent it
            return
        self._ages.append(time.time_ns() - sent)

    def flow(self) -> Flow | None:
        flow = flow_of(self._meter.stats(time.monotonic_ns()))
        ages = self._ages.copy()
        if flow is None or not ages:
            return flow
        return msgspec.structs.replace(flow, latency=sum(ages) / len(ages) / 1e9)

    def close(self) -> None:
        self._entity.close()


class Traffic:
    """Measures topics until it is closed: those of small messages, and others on request.

    Args:
        node: The node that subscribes to them.
        permission: The rights of the page; without it, all.

    Attributes:
        everything: Whether to measure topics of large messages, and those of other machines.
    """

    def __init__(self, node: Node, permission: PagePolicy | None = None) -> None:
        self.everything: bool = False
        self._node = node
        self._permission = permission or PagePolicy()
        self._lock = threading.Lock()
        self._taps: dict[str, _Tap] = {}
        self._seen: tuple[Survey, bool] | None = None

    def update(self, survey: Survey) -> None:
        """Measure the topics that there are now.

        Raises:
            ClosedError: The node is closed.
        """
        with self._lock:
            if self._seen is not None and self._seen == (survey, self.everything):
                return
            self._seen = survey, self.everything
            wanted = self._wanted(survey)
            for name in self._taps.keys() - wanted:
                self._taps.pop(name).close()
            for name in wanted.keys() - self._taps:
                self._taps[name] = _Tap(self._node, wanted[name])

    def _wanted(self, survey: Survey) -> dict[str, Token]:
        tokens: dict[str, Token] = {}
        for token in survey.view.entities(Kind.PUBLISHER):
            if token.zid == self._node.context.session.zid or is_of_action(token.name):
                continue
            if self._permission.objection("subscribe", token.name):
                continue
            is_heavy = short_type(token.type_name) in _HEAVY
            is_here = survey.host(token) == self._node.process.host
            if self.everything or (is_here and not is_heavy):
                tokens.setdefault(token.name, token)
        return tokens

    def flow(self, topic: str) -> Flow | None:
        """Return what flows on a topic; None if it is not measured, or too little has come."""
        tap = self._taps.get(topic)
        return None if tap is None else tap.flow()

    def close(self) -> None:
        """Measure nothing any more."""
        with self._lock:
            taps, self._taps = self._taps, {}
            self._seen = None
        for tap in taps.values():
            tap.close()
