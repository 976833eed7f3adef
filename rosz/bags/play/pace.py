"""The time of a bag that plays: how it runs with wall time, and who follows it, or is followed."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

from rosz.node import Node
from rosz.qos import QoS

_NS = 1_000_000_000


class Pace:
    """Runs through the time of a bag from a stamp on, with pauses.

    Attributes:
        rate: Seconds of the bag per second; `change` changes it, and the others.
        paused: Whether it stands still.
        delayed: Whether it waits for something else, and so stands still whether paused or not.
    """

    def __init__(self, start: int, rate: float, *, paused: bool) -> None:
        self._stamp = start
        self._since = time.monotonic_ns()
        self.rate = rate
        self.paused = paused
        self.delayed = False

    def change(
        self, rate: float | None = None, paused: bool | None = None, delayed: bool | None = None
    ) -> None:
        """Change attributes from now on."""
        self.jump(self.now())
        self.rate = self.rate if rate is None else rate
        self.paused = self.paused if paused is None else paused
        self.delayed = self.delayed if delayed is None else delayed

    def now(self) -> int:
        """Return the time of the bag, as a stamp."""
        if self.paused or self.delayed:
            return self._stamp
        return self._stamp + int((time.monotonic_ns() - self._since) * self.rate)

    def jump(self, stamp: int) -> None:
        """Go on from a stamp."""
        self._stamp, self._since = stamp, time.monotonic_ns()

    def left(self, stamp: int) -> float:
        """Return the seconds until a stamp is due; 0 or less if it is."""
        due = self._since + (stamp - self._stamp) / self.rate
        return (due - time.monotonic_ns()) / _NS


class BagClock:
    """Publishes the time of the bags on ``/clock``, ``rate`` times per second.

    Args:
        immediate: Whether it is published with every message.
    """

    def __init__(self, node: Node, rate: float, *, immediate: bool) -> None:
        from rosz.msgs.builtin_interfaces.msg import Time
        from rosz.msgs.rosgraph_msgs.msg import Clock

        publisher = node.publisher("/clock", Clock, qos=QoS(depth=1))

        def publish(stamp: int) -> None:
            publisher.publish(Clock(clock=Time.from_nsec(stamp)))

        self._publish = publish
        self._period = 1 / rate
        self._immediate = immediate
        self._due = 0.0

    def tick(self, pace: Pace, left: float, stamp: int) -> float:
        """Publish the time if its turn has come; return the seconds until the next turn.

        The next message, of the given stamp, is due in ``left`` seconds.
        """
        now = time.monotonic()
        if now >= self._due or self._immediate:
            self._publish(min(pace.now(), stamp) if left > 0 else stamp)
            self._due = max(self._due + self._period, now)
        return max(self._due - now, 0.0001) if left > 0 else 0.0


class RateControl:
    """Holds the time of the bags near the stamps of a topic whose messages begin with a header.

    Args:
        max_delay: Seconds of the bags by which their time may be later.
        stamp: Its stamp before the first message; then the latest stamp of the topic.
        changed: Condition that is notified of each message.
        warn: Function called once if the messages have no header.
    """

    def __init__(
        self,
        node: Node,
        topic: str,
        max_delay: float,
        stamp: int,
        changed: threading.Condition,
        warn: Callable[[str], object],
    ) -> None:
        self._topic = topic
        self._max_delay = int(max_delay * _NS)
        self._changed = changed
        self._warn = warn
        self._warned = False
        self.stamp: int = stamp
        node.subscription(topic, callback=self._receive)

    def _receive(self, message: Any) -> None:
        if message._has_header:
            with self._changed:
                self.stamp = message.header.stamp.to_nsec()
                self._changed.notify_all()
        elif not self._warned:
            self._warned = True
            self._warn(
                f"'{self._topic}' controls nothing: '{message._type}' does not begin with a header"
            )

    def hold(self, pace: Pace) -> bool:
        """Stop the time of the bags if it is too late; return whether it is."""
        late = pace.now() - self.stamp > self._max_delay
        if late != pace.delayed:
            pace.change(delayed=late)
        return late
