"""Messages of several sources that have the same stamp, or nearly so."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Sequence
from typing import Any

from rosz.ros1.message_filters.filters import SimpleFilter, now, stamp_of

__all__ = ("ApproximateTimeSynchronizer", "TimeSynchronizer")

Queue = dict[int, Any]
"""Messages by their stamps in nanoseconds."""


class TimeSynchronizer(SimpleFilter):
    """Calls back with one message of each source when all have the same stamp.

    Args:
        fs: The sources.
        queue_size: How many messages of each source wait for the others.
        reset: Whether the messages of a source are dropped when simulated time jumps back.
    """

    def __init__(self, fs: Sequence[SimpleFilter], queue_size: int, reset: bool = False) -> None:
        super().__init__()
        self.queue_size = queue_size
        self.enable_reset = reset
        self.lock = threading.Lock()
        self.queues: list[Queue] = []
        self._latest: dict[int, int] = {}
        self.connectInput(fs)

    def connectInput(self, fs: Sequence[SimpleFilter]) -> None:  # noqa: N802  # ROS 1's
        """Take messages from these sources."""
        self.queues = [{} for _ in fs]
        self.input_connections = [
            source.registerCallback(self.add, queue, index)
            for index, (source, queue) in enumerate(zip(fs, self.queues, strict=True))
        ]

    def add(self, msg: Any, my_queue: Queue, my_queue_index: int | None = None) -> None:
        """Take a message in, and call back for all that is complete now.

        Args:
            msg: It.
            my_queue: Where it waits.
            my_queue_index: Number of its source.
        """
        with self.lock:
            self._forget_after_jump(my_queue, my_queue_index)
            self._put(my_queue, msg.header.stamp.to_nsec(), msg)
            complete = set(self.queues[0]).intersection(*self.queues[1:])
            for stamp in sorted(complete):
                self._tell([stamp] * len(self.queues))

    def _put(self, queue: Queue, stamp: int, msg: Any) -> None:
        queue[stamp] = msg
        while len(queue) > self.queue_size:
            del queue[min(queue)]

    def _tell(self, stamps: Sequence[int]) -> None:
        """Call back with the messages of these stamps, one of each source."""
        pairs = list(zip(self.queues, stamps, strict=True))
        self.signalMessage(*[queue[stamp] for queue, stamp in pairs])
        for queue, stamp in pairs:
            queue.pop(stamp, None)

    def _forget_after_jump(self, queue: Queue, index: int | None) -> None:
        if not self.enable_reset or index is None:
            return
        moment = now().to_nsec()
        if moment < self._latest.get(index, 0):
            queue.clear()
        self._latest[index] = moment


class ApproximateTimeSynchronizer(TimeSynchronizer):
    """Calls back with one message of each source when their stamps are near each other.

    Args:
        fs: The sources.
        queue_size: How many messages of each source wait for the others.
        slop: Seconds between the oldest and the newest of them, at most.
        allow_headerless: Whether messages without a stamp count as stamped when they come.
        reset: Whether the messages of a source are dropped when simulated time jumps back.
    """

    def __init__(
        self,
        fs: Sequence[SimpleFilter],
        queue_size: int,
        slop: float,
        allow_headerless: bool = False,
        reset: bool = False,
    ) -> None:
        super().__init__(fs, queue_size, reset)
        self.slop = slop
        self.allow_headerless = allow_headerless
        self._last_added = 0

    def add(self, msg: Any, my_queue: Queue, my_queue_index: int | None = None) -> None:
        """Take a message in, and call back if it completes a set.

        Args:
            msg: It.
            my_queue: Where it waits.
            my_queue_index: Number of its source.
        """
        stamp = stamp_of(msg, self.allow_headerless)
        if stamp is None:
            return
        with self.lock:
            self._forget_after_jump(my_queue, my_queue_index)
            self._forget_all_after_jump()
            own = stamp.to_nsec()
            self._put(my_queue, own, msg)
            if own not in my_queue:  # too old to wait
                return
            index = next(i for i, queue in enumerate(self.queues) if queue is my_queue)
            found = self._match(own, index)
            if found is not None:
                self._tell(found)

    def _forget_all_after_jump(self) -> None:
        moment = now().to_nsec()
        if moment < self._last_added:
            for queue in self.queues:
                queue.clear()
        self._last_added = moment

    def _match(self, own: int, index: int) -> tuple[int, ...] | None:
        """Return the stamps of a set with a new message, those nearest to it first."""
        slop = int(self.slop * 1e9)
        distance: Callable[[int], int] = lambda stamp: abs(stamp - own)  # noqa: E731  # a key
        near = [
            [own]
            if number == index
            else sorted((stamp for stamp in queue if distance(stamp) <= slop), key=distance)
            for number, queue in enumerate(self.queues)
        ]
        sets = itertools.product(*near)
        return next((one for one in sets if max(one) - min(one) < slop), None)
