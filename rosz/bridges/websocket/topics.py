"""Topics that clients publish and subscribe to; what several clients use is shared."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from rosz.bridges.logs import GATHERED, LOGS
from rosz.bridges.websocket.outbox import Encodings, Feed, Message
from rosz.errors import NotFoundError, RoszError, UsageError, near_miss
from rosz.msgs.rcl_interfaces.msg import Log as Ros2Log
from rosz.msgs.rosgraph_msgs.msg import Log as Ros1Log
from rosz.names import short_type
from rosz.node import MessageInfo
from rosz.node.type_description import request_type
from rosz.wire import format_token, gid

if TYPE_CHECKING:
    from rosz.node import Node, Publisher, Subscription

__all__ = ("Offer", "Topics")

Offer = Callable[[Feed, Message], object]
"""Function of a client that takes a message for one of its feeds."""


class Topics:
    """The publishers and subscriptions of a bridge.

    Args:
        node: Node that has them.
        encodings: Encodings of their messages.
    """

    def __init__(self, node: Node, encodings: Encodings) -> None:
        self._node = node
        self._encodings = encodings
        self._lock = threading.RLock()
        self._sources: dict[tuple[str, str], _Source] = {}
        self._outlets: dict[tuple[str, str, bool], _Outlet] = {}

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
        known = self._node.context.graph.refresh().topics()
        if topic not in known:
            raise NotFoundError(f"topic '{topic}' does not exist{near_miss(topic, known)}")
        return known[topic][0]

    def subscribe(self, topic: str, cls: type[Any] | None, feed: Feed, offer: Offer) -> None:
        """Give the messages of a topic to a feed; one that has them gets what is latched again.

        Args:
            topic: Full name of the topic.
            cls: Class of its messages; None for any.
            feed: The feed.
            offer: Function that takes each message, on threads of the node.
        """
        key = (topic, cls._type_hash if cls else "")
        with self._lock:
            source = next((one for one in self._sources.values() if one.has(feed)), None)
            source = source or self._sources.get(key)
            if source is None:
                source = _Source(self._node, self._encodings, topic, cls)
                self._sources[key] = source
            source.add(feed, offer)

    def unsubscribe(self, feed: Feed) -> None:
        """Give a feed no more messages; the last feed of a topic ends the subscription."""
        with self._lock:
            ended = [key for key, one in self._sources.items() if one.remove(feed)]
            sources = [self._sources.pop(key) for key in ended]
        for source in sources:
            source.close()

    def advertise(
        self, topic: str, cls: type[Any], *, latch: bool, client: object
    ) -> Publisher[Any]:
        """Return the publisher of a topic for a client."""
        key = (topic, cls._type_name, latch)
        with self._lock:
            outlet = self._outlets.get(key)
            if outlet is None:
                publisher = self._node.publisher(topic, cls, queue_size=100, latch=latch)
                outlet = self._outlets[key] = _Outlet(publisher)
            outlet.clients.add(client)
            return outlet.publisher

    def unadvertise(self, client: object, topic: str = "") -> bool:
        """End what a client publishes on a topic, or on all; return whether there was anything."""
        ended = []
        found = False
        with self._lock:
            for key, outlet in list(self._outlets.items()):
                if client not in outlet.clients or (topic and key[0] != topic):
                    continue
                found = True
                outlet.clients.discard(client)
                if not outlet.clients:
                    ended.append(self._outlets.pop(key))
        for outlet in ended:
            outlet.publisher.close()
        return found


class _Outlet:
    """A publisher, and the clients that use it."""

    def __init__(self, publisher: Publisher[Any]) -> None:
        self.publisher = publisher
        self.clients: set[object] = set()


class _Source:
    """A subscription, and the feeds that get its messages."""

    def __init__(self, node: Node, encodings: Encodings, topic: str, cls: type[Any] | None) -> None:
        self._node = node
        self._encodings = encodings
        self._topic = topic
        self._cls = cls
        self._classes: dict[tuple[str, str], type[Any] | None] = {}
        self._feeds: dict[Feed, Offer] = {}
        self._latching: dict[bytes, bool] = {}
        self._kept: dict[bytes, Message] = {}
        self._lock = threading.RLock()
        with self._lock:  # a message may come before the subscription is assigned
            self._subscription: Subscription[Any] = node.subscription(
                LOGS if topic == GATHERED else topic,
                cls,
                self._receive,
                queue_size=100,
                raw=True,
                with_info=True,
            )

    def add(self, feed: Feed, offer: Offer) -> None:
        """Add a feed; it gets the last message of each latching publisher."""
        with self._lock:
            alive = {gid(format_token(token)) for token in self._subscription.publishers()}
            self._kept = {
                key: kept
                for key, kept in self._kept.items()
                if key in alive and self._is_latching(key)
            }
            self._feeds[feed] = offer
            for kept in self._kept.values():
                offer(feed, kept)

    def has(self, feed: Feed) -> bool:
        """Return whether a feed gets the messages."""
        return feed in self._feeds

    def remove(self, feed: Feed) -> bool:
        """Remove a feed; return whether it was the last one."""
        with self._lock:
            return self._feeds.pop(feed, None) is not None and not self._feeds

    def close(self) -> None:
        """End the subscription."""
        self._subscription.close()

    def _receive(self, data: bytes, info: MessageInfo) -> None:
        cls = self._cls or self._class_of(info.type_name, info.type_hash)
        if cls is None:
            return
        message = Message(self._encodings, self._topic, cls, bytes(data), self._node.now())
        with self._lock:
            if self._is_latching(info.gid):
                self._kept[info.gid] = message
            feeds = list(self._feeds.items())
        for feed, offer in feeds:
            offer(feed, message)

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
                    self._classes[kind] = self._request(partial(request_type, self._node, token))
        return self._classes[kind]

    def _request(self, request: Callable[[], type[Any]]) -> type[Any] | None:
        try:
            return request()
        except RoszError as error:
            self._node.log.warning("cannot decode what comes on '%s': %s", self._topic, error)
            return None
