"""message_filters: callbacks for messages that belong together (ROS wiki, message_filters).

Sources are topics of rospy or, as in ROS 2, of a node of rclpy.
"""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Sequence
from typing import Any

from rosz.ros1.client import rospy

_ROS2_DEPTH = 10


class SimpleFilter:
    """A source of messages for callbacks.

    Attributes:
        node: Node of rclpy that the messages come from; None for rospy.
    """

    node: Any = None

    def __init__(self) -> None:
        self.callbacks: dict[int, tuple[Callable[..., Any], tuple[Any, ...]]] = {}

    def registerCallback(self, cb: Callable[..., Any], *args: Any) -> int:  # noqa: N802  # ROS 1's
        """Call a function with each message, followed by further arguments.

        Returns:
            Number of the registration.
        """
        number = len(self.callbacks)
        self.callbacks[number] = cb, args
        return number

    def signalMessage(self, *msg: Any) -> None:  # noqa: N802  # ROS 1's
        """Call all callbacks."""
        for callback, args in list(self.callbacks.values()):
            callback(*msg, *args)


class Subscriber(SimpleFilter):
    """A topic as a source.

    It takes the arguments of ``rospy.Subscriber``, or those of ROS 2: a node of rclpy, the class of
    the messages, the name of the topic, and keyword arguments of ``create_subscription``.

    Attributes:
        sub: The ``rospy.Subscriber``, or the subscription of rclpy.
        topic: Name of the topic, as given.
    """

    sub: Any

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__()
        if args and hasattr(args[0], "create_subscription"):
            self.node, message_type, self.topic = args
            kwargs.setdefault("qos_profile", _ROS2_DEPTH)
            self.sub = self.node.create_subscription(
                message_type, self.topic, callback=self.callback, **kwargs
            )
            return
        self.topic = args[0] if args else kwargs["name"]
        self.sub = rospy.Subscriber(*args, **(kwargs | {"callback": self.callback}))

    def callback(self, msg: Any) -> None:
        """Receive a message."""
        self.signalMessage(msg)

    def getTopic(self) -> str:  # noqa: N802  # ROS 1's
        """Return the name of the topic."""
        return str(self.topic)

    def __getattr__(self, key: str) -> Any:
        if key == "sub":  # not set yet
            raise AttributeError(key)
        return getattr(self.sub, key)


def _now(node: Any) -> Any:
    return rospy.Time.now() if node is None else node.get_clock().now()


def _nanoseconds(node: Any) -> int:
    now = _now(node)
    nanoseconds: int = now.to_nsec() if node is None else now.nanoseconds
    return nanoseconds


def _stamp_of(msg: Any, allow_headerless: bool, node: Any) -> Any:
    """Return the stamp of a message; without one, the current time if allowed, else None."""
    header = getattr(msg, "header", None)
    stamp = getattr(header, "stamp", None)
    if stamp is not None:
        return stamp if node is None else type(_now(node)).from_msg(stamp)
    if allow_headerless:
        return _now(node)
    text = (
        "Cannot use message filters with non-stamped messages. Use the 'allow_headerless'"
        " constructor option to auto-assign ROS time to headerless messages."
    )
    (rospy.logwarn if node is None else node.get_logger().warning)(text)
    return None


Queue = dict[int, Any]
"""Messages by their stamps in nanoseconds."""


class TimeSynchronizer(SimpleFilter):
    """Call functions with one message of each source when all have the same stamp.

    Args:
        fs: The sources.
        queue_size: Number of messages of each source that wait for the others.
        reset: Whether the messages of a source are dropped when simulated time jumps back.
    """

    def __init__(self, fs: Sequence[SimpleFilter], queue_size: int, reset: bool = False) -> None:
        super().__init__()
        self.queue_size: int = queue_size
        self.enable_reset: bool = reset
        self.lock: threading.Lock = threading.Lock()
        self.queues: list[Queue] = []
        self._latest: dict[int, int] = {}
        self.connectInput(fs)

    def connectInput(self, fs: Sequence[SimpleFilter]) -> None:  # noqa: N802  # ROS 1's
        """Receive messages from sources."""
        self.node = next((source.node for source in fs if source.node is not None), None)
        self.queues = [{} for _ in fs]
        self.input_connections = [
            source.registerCallback(self.add, queue, index)
            for index, (source, queue) in enumerate(zip(fs, self.queues, strict=True))
        ]

    def add(self, msg: Any, my_queue: Queue, my_queue_index: int | None = None) -> None:
        """Receive a message, and call the functions with all sets that are complete.

        Args:
            msg: The message.
            my_queue: Queue of its source.
            my_queue_index: Number of its source.
        """
        with self.lock:
            self._reset_after_jump(my_queue, my_queue_index)
            self._put(my_queue, msg.header.stamp.to_nsec(), msg)
            complete = set(self.queues[0]).intersection(*self.queues[1:])
            for stamp in sorted(complete):
                self._signal([stamp] * len(self.queues))

    def _put(self, queue: Queue, stamp: int, msg: Any) -> None:
        queue[stamp] = msg
        while len(queue) > self.queue_size:
            del queue[min(queue)]

    def _signal(self, stamps: Sequence[int]) -> None:
        """Call the functions with the messages of these stamps, one of each source."""
        pairs = list(zip(self.queues, stamps, strict=True))
        self.signalMessage(*[queue[stamp] for queue, stamp in pairs])
        for queue, stamp in pairs:
            queue.pop(stamp, None)

    def _reset_after_jump(self, queue: Queue, index: int | None) -> None:
        if not self.enable_reset or index is None:
            return
        moment = _nanoseconds(self.node)
        if moment < self._latest.get(index, 0):
            queue.clear()
        self._latest[index] = moment


class ApproximateTimeSynchronizer(TimeSynchronizer):
    """Call functions with one message of each source when their stamps are close.

    Args:
        fs: As for `TimeSynchronizer`, as are ``queue_size`` and ``reset``.
        slop: Longest time between the stamps of a set, in seconds.
        allow_headerless: Whether messages without a stamp get the time of their arrival.
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
        self.slop: float = slop
        self.allow_headerless: bool = allow_headerless
        self._last_added = 0

    def add(self, msg: Any, my_queue: Queue, my_queue_index: int | None = None) -> None:
        """Receive a message, and call the functions if it completes a set."""
        stamp = _stamp_of(msg, self.allow_headerless, self.node)
        if stamp is None:
            return
        with self.lock:
            self._reset_after_jump(my_queue, my_queue_index)
            own = stamp.to_nsec() if self.node is None else stamp.nanoseconds
            self._put(my_queue, own, msg)
            self._reset_all_after_jump()  # as in ROS 1, with the message that shows the jump
            if own not in my_queue:  # older than all that wait, or before a jump
                return
            index = next(i for i, queue in enumerate(self.queues) if queue is my_queue)
            stamps = self._match(own, index)
            if stamps is not None:
                self._signal(stamps)

    def _reset_all_after_jump(self) -> None:
        moment = _nanoseconds(self.node)
        if moment < self._last_added:
            for queue in self.queues:
                queue.clear()
        self._last_added = moment

    def _match(self, own: int, index: int) -> tuple[int, ...] | None:
        """Return the stamps of a set with a new message, preferring the nearest ones."""
        slop = int(self.slop * 1e9)
        distance: Callable[[int], int] = lambda stamp: abs(stamp - own)  # noqa: E731  # a key
        near = [
            [own]
            if number == index
            else sorted((stamp for stamp in queue if distance(stamp) <= slop), key=distance)
            for number, queue in enumerate(self.queues)
        ]
        sets = itertools.product(*near)
        return next((stamps for stamps in sets if max(stamps) - min(stamps) < slop), None)


class Cache(SimpleFilter):
    """Keep the newest messages of a source, and pass all on.

    Args:
        f: The source.
        cache_size: Number of messages that are kept.
        allow_headerless: Whether messages without a stamp get the time of their arrival.
    """

    def __init__(
        self, f: SimpleFilter, cache_size: int = 1, allow_headerless: bool = False
    ) -> None:
        super().__init__()
        self.cache_size: int = cache_size
        self.cache_msgs: list[Any] = []
        self.cache_times: list[Any] = []
        self.allow_headerless: bool = allow_headerless
        self.connectInput(f)

    def connectInput(self, f: SimpleFilter) -> None:  # noqa: N802  # ROS 1's
        """Receive messages from a source."""
        self.node = f.node
        self.incoming_connection = f.registerCallback(self.add)

    def add(self, msg: Any) -> None:
        """Receive a message; a full cache drops the one that came first."""
        stamp = _stamp_of(msg, self.allow_headerless, self.node)
        if stamp is None:
            return
        if len(self.cache_msgs) >= self.cache_size:
            del self.cache_msgs[0], self.cache_times[0]
        self.cache_msgs.append(msg)
        self.cache_times.append(stamp)
        self.signalMessage(msg)

    def _pairs(self) -> list[tuple[Any, Any]]:
        return list(zip(self.cache_times, self.cache_msgs, strict=True))

    def getInterval(self, from_stamp: Any, to_stamp: Any) -> list[Any]:  # noqa: N802  # ROS 1's
        """Return the messages of an interval, including its ends."""
        return [msg for stamp, msg in self._pairs() if from_stamp <= stamp <= to_stamp]

    def getElemAfterTime(self, stamp: Any) -> Any:  # noqa: N802  # ROS 1's
        """Return the first message that is not older; None if all are."""
        return next((msg for when, msg in self._pairs() if when >= stamp), None)

    def getElemBeforeTime(self, stamp: Any) -> Any:  # noqa: N802  # ROS 1's
        """Return the last message that is not newer; None if all are."""
        return next((msg for when, msg in reversed(self._pairs()) if when <= stamp), None)

    def getLatestTime(self) -> Any:  # noqa: N802  # ROS 1's
        """Return the stamp of the message that came last; None if the cache is empty."""
        return self.cache_times[-1] if self.cache_times else None

    def getLastestTime(self) -> Any:  # noqa: N802  # ROS 1's
        """Return the same as `getLatestTime`."""
        return self.getLatestTime()

    def getOldestTime(self) -> Any:  # noqa: N802  # ROS 1's
        """Return the stamp of the message that came first; None if the cache is empty."""
        return self.cache_times[0] if self.cache_times else None

    def getLast(self) -> Any:  # noqa: N802  # ROS 1's
        """Return the first message that is not older than the one that came last; None if empty."""
        return self.getElemAfterTime(self.cache_times[-1]) if self.cache_times else None
