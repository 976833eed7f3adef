"""What all subscribers of one topic in a process share: one subscription, one thread."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from rosz.node import GenericSubscription, MessageInfo, Node, Subscription
from rosz.qos import QoS
from rosz.ros1.rospy.msg import AnyMsg
from rosz.ros1.rospy.state import is_shutdown, state, when_ready

__all__ = ("Sink", "acquire_sink")

_Member = tuple[object, Callable[..., object] | None, Any]


class Sink:
    """The one subscription of a topic in this process.

    Args:
        name: Global name of the topic.
        data_class: Class of its messages.
        queue_size: Of the first subscriber.

    Attributes:
        closed: Whether it takes messages no more.
    """

    def __init__(self, name: str, data_class: type[Any], queue_size: int | None) -> None:
        self.name = self.resolved_name = name
        self.data_class = data_class
        self.type: str = data_class._type
        self.queue_size = queue_size
        self.closed = False
        self._lock = threading.RLock()
        self._members: tuple[_Member, ...] = ()
        self._subscription: Subscription[Any] | GenericSubscription | None = None

    def open(self, node: Node) -> None:
        """Begin to listen, now that there is a node."""
        with self._lock:
            if self.closed:
                return
            depth = self.queue_size or 0
            qos = QoS(depth=depth) if depth > 0 else QoS(history="keep_all")
            if self.data_class is AnyMsg:
                self._subscription = GenericSubscription(
                    node, self.name, self._take_any, qos, raw=True, with_info=True
                )
            else:
                self._subscription = Subscription(
                    node, self.name, self.data_class, self._take, qos, with_info=True
                )
            node.keep(self._subscription)

    def join(
        self, member: object, callback: Callable[..., object] | None, callback_args: Any
    ) -> None:
        """Count one more subscriber in, and begin to listen with the first one."""
        with self._lock:
            first = not self._members
            self._members = (*self._members, (member, callback, callback_args))
        if first:
            when_ready(self.open)

    def release(self, member: object) -> None:
        """Count a subscriber out; the last one closes this."""
        with state.lock:
            self._members = tuple(one for one in self._members if one[0] is not member)
            if self._members:
                return
            self.closed = True
            state.sinks.pop(self.name, None)
        if self._subscription is not None:
            self._subscription.close()

    def get_num_connections(self) -> int:
        """Return how many publishers there are."""
        subscription = self._subscription
        if subscription is None or subscription.closed:
            return 0
        return len(subscription.publishers())

    def _take(self, message: Any, info: MessageInfo) -> None:
        del info
        for _, callback, extra in self._members:
            if callback is not None:
                self._call(callback, message, extra)

    def _take_any(self, payload: bytes, info: MessageInfo) -> None:
        message = AnyMsg()
        message._buff = payload  # noqa: SLF001  # rospy's name for it
        package, _, name = info.type_name.replace("/msg/", "/").partition("/")
        message._connection_header = {  # noqa: SLF001
            "topic": self.name,
            "type": f"{package}/{name}",
        }
        self._take(message, info)

    def _call(self, callback: Callable[..., object], message: Any, extra: Any) -> None:
        try:
            if extra is None:
                callback(message)
            else:
                callback(message, extra)
        except Exception as error:  # noqa: BLE001  # the callback boundary
            if state.node is not None and not is_shutdown():
                state.node.log.report(f"bad callback: {callback}", error)


def acquire_sink(name: str, data_class: type[Any], queue_size: int | None) -> Sink:
    """Return what listens to a topic, made at the first asking."""
    with state.lock:
        sink: Sink | None = state.sinks.get(name)
        if sink is None:
            sink = state.sinks[name] = Sink(name, data_class, queue_size)
    return sink


