"""Topics that clients publish and subscribe to; clients share publishers and subscriptions."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from typing import Any, Generic, TypeAlias

from rosz.bridges.clients.queues import M, TopicQueue
from rosz.errors import NotFoundError, RoszError, UsageError, near_miss
from rosz.introspect import GATHERED, LOGS
from rosz.message import from_plain
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.rcl_interfaces.msg import Log as Ros2Log
from rosz.msgs.rosgraph_msgs.msg import Log as Ros1Log
from rosz.names import short_type
from rosz.node import MessageInfo, Node, Publisher, Subscription
from rosz.node.ros2 import request_type
from rosz.wire import format_token, gid

_QUEUE = 100
"""Messages of a topic that wait: the default of the rosbridge protocol ("Advertise")."""

Offer: TypeAlias = Callable[[TopicQueue[M], M], object]
"""Function of a client that takes a message for one of its queues."""

MakeMessage: TypeAlias = Callable[[str, type[Any], bytes, int], M]
"""Function that makes a message of a topic, a class, CDR and the time at which it came."""


class ClientTopics(Generic[M]):
    """The publishers and subscriptions of a bridge."""

    def __init__(self, node: Node, make: MakeMessage[M]) -> None:
        self._node = node
        self._make = make
        self._lock = threading.RLock()
        self._subscriptions: dict[tuple[str, str], _SharedSubscription[M]] = {}
        self._publishers: dict[tuple[str, str, bool], tuple[Publisher[Any], set[object]]] = {}
        """The publishers, and the clients that use each."""

    def message_class(self, topic: str, type_name: str) -> type[Any]:
        """Return the class of a type that a client names for a topic.

        A type that is not known here is asked of a node that has it.

        Raises:
            UsageError: The topic has another type.
            TypeNotFound: No such type is known here or at another node.
            DefinitionError: Its definition is not well-formed.
        """
        wanted = short_type(type_name)
        if topic in (LOGS, GATHERED) and wanted == Ros1Log._type:
            wanted = Ros2Log._type
        view = self._node.context.graph.refresh()
        tokens = [*view.publishers(topic), *view.subscriptions(topic)]
        types = sorted({short_type(token.type_name) for token in tokens})
        if types and wanted not in types:
            raise UsageError(f"topic '{topic}' has the type {' and '.join(types)}, not {wanted}")
        for token in tokens:
            if short_type(token.type_name) == wanted:
                return request_type(self._node, token)
        return self._node.context.types.message(wanted)

    def type_of(self, topic: str) -> str:
        """Return the type of a topic.

        Raises:
            NotFoundError: No node publishes it or subscribes to it.
        """
        topics = self._node.context.graph.refresh().topics()
        if topic not in topics:
            raise NotFoundError(f"topic '{topic}' does not exist{near_miss(topic, topics)}")
        return topics[topic][0]

    def subscribe(
        self, topic: str, cls: type[Any] | None, queue: TopicQueue[M], offer: Offer[M]
    ) -> None:
        """Give the messages of a topic to a queue; one that has them gets latched ones again.

        Args:
            topic: Full name of the topic.
            cls: Class of its messages; None for any.
            queue: The queue.
            offer: Function that takes each message, on threads of the node.
        """
        key = (topic, cls._type_hash if cls else "")
        with self._lock:
            shared = next((s for s in self._subscriptions.values() if queue in s.queues), None)
            shared = shared or self._subscriptions.get(key)
            if shared is None:
                self._subscriptions[key] = _SharedSubscription(
                    self._node, self._make, topic, cls, {queue: offer}
                )
            else:
                shared.add(queue, offer)

    def unsubscribe(self, queue: TopicQueue[M]) -> None:
        """Give a queue no more messages; the last queue of a topic ends the subscription."""
        with self._lock:
            ended = [key for key, shared in self._subscriptions.items() if shared.remove(queue)]
            subscriptions = [self._subscriptions.pop(key) for key in ended]
        for shared in subscriptions:
            shared.close()

    def advertise(
        self, topic: str, cls: type[Any], *, latch: bool, client: object
    ) -> Publisher[Any]:
        """Return the publisher of a topic for a client."""
        key = (topic, cls._type_name, latch)
        with self._lock:
            if key not in self._publishers:
                made = self._node.publisher(topic, cls, queue_size=_QUEUE, latch=latch)
                self._publishers[key] = made, set()
            publisher, clients = self._publishers[key]
            clients.add(client)
            return publisher

    def unadvertise(self, client: object, topic: str = "") -> bool:
        """End the publishers of a client on a topic, or on all; return whether there was any."""
        with self._lock:
            used = [
                key
                for key, (_, clients) in self._publishers.items()
                if client in clients and topic in ("", key[0])
            ]
            for key in used:
                self._publishers[key][1].discard(client)
            ended = [self._publishers.pop(key) for key in used if not self._publishers[key][1]]
        for publisher, _ in ended:
            publisher.close()
        return bool(used)


class _SharedSubscription(Generic[M]):
    """A subscription, and the queues that get its messages.

    Attributes:
        queues: The queues, with the functions that take their messages.
    """

    def __init__(
        self,
        node: Node,
        make: MakeMessage[M],
        topic: str,
        cls: type[Any] | None,
        queues: dict[TopicQueue[M], Offer[M]],
    ) -> None:
        self._node = node
        self._make = make
        self._topic = topic
        self._cls = cls
        self._classes: dict[tuple[str, str], type[Any] | None] = {}
        self.queues = queues  # publishers may send once they see the subscription
        self._latching: dict[bytes, bool] = {}
        self._kept: dict[bytes, M] = {}
        self._lock = threading.RLock()
        with self._lock:  # a message may come before the subscription is assigned
            self._subscription: Subscription[Any] = node.subscription(
                LOGS if topic == GATHERED else topic,
                cls,
                self._receive,
                queue_size=_QUEUE,
                raw=True,
                with_info=True,
            )

    def add(self, queue: TopicQueue[M], offer: Offer[M]) -> None:
        """Add a queue; it gets the last message of each latching publisher."""
        with self._lock:
            alive = {gid(format_token(token)) for token in self._subscription.publishers()}
            self._kept = {
                key: kept
                for key, kept in self._kept.items()
                if key in alive and self._is_latching(key)
            }
            self.queues[queue] = offer
            for kept in self._kept.values():
                offer(queue, kept)

    def remove(self, queue: TopicQueue[M]) -> bool:
        """Remove a queue; return whether it was the last one."""
        with self._lock:
            return self.queues.pop(queue, None) is not None and not self.queues

    def close(self) -> None:
        """End the subscription."""
        self._subscription.close()

    def _receive(self, data: bytes, info: MessageInfo) -> None:
        cls = self._cls or self._class_of(info.type_name, info.type_hash)
        if cls is None:
            return
        message = self._make(self._topic, cls, bytes(data), self._node.now())
        with self._lock:
            if self._is_latching(info.gid):
                self._kept[info.gid] = message
            queues = list(self.queues.items())
        for queue, offer in queues:
            offer(queue, message)

    def _is_latching(self, publisher: bytes) -> bool:
        """Return whether a publisher latches, or may, as its token has not come."""
        if publisher not in self._latching:
            for token in self._subscription.publishers():
                if gid(format_token(token)) == publisher and token.qos is not None:
                    self._latching[publisher] = token.qos.latched
        return self._latching.get(publisher, True)

    def _class_of(self, type_name: str, type_hash: str) -> type[Any] | None:
        kind = (type_name, type_hash)
        if kind not in self._classes:
            self._classes[kind] = None
            view = self._node.context.graph.refresh()
            for token in view.publishers(self._topic):
                if (token.type_name, token.type_hash) == kind:
                    try:
                        self._classes[kind] = request_type(self._node, token)
                    except RoszError as error:
                        self._node.log.warning(
                            "cannot decode what comes on '%s': %s", self._topic, error
                        )
        return self._classes[kind]


def build(cls: type[Any], value: Any, now: int) -> Any:
    """Return the message in plain values of a client.

    A header without a stamp gets the time (rosbridge protocol, "Publish").

    Args:
        cls: Class of the message.
        value: A dict of fields, a list of all, or None.
        now: Time in nanoseconds, also the meaning of ``now``.

    Raises:
        EncodeError: A name is not a field, or a value does not fit its field.
    """
    message = from_plain(cls, value, partial(Time.from_nsec, now), null_is_nan=True)
    if cls._has_header and isinstance(value, dict):
        header = value.get("header")
        if not isinstance(header, dict) or "stamp" not in header:
            message.header.stamp = Time.from_nsec(now)
    return message
