"""Topics of any type: an input that is received as bytes, and an output that sends such bytes.

The first message that an output sends decides its type and whether it latches, as in ROS 1.
No definition of the type is needed.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from typing import Any

from rosz import names
from rosz.errors import InvalidName
from rosz.message import Message
from rosz.node import GenericSubscription, MessageInfo, Node, Publisher, Subscription
from rosz.qos import QoS

NONE = "__none"
"""The name that stands for no topic in a mux and a demux."""

_DEPTH = 10  # as in ROS 1's topic_tools

Receive = Callable[[bytes, MessageInfo, "RawInput"], object]


def base_name(topic: str) -> str:
    """Return the last part of a topic's name, for the name of a node.

    Ends the program if the text is not the name of a topic.
    """
    try:
        names.check(topic)
    except InvalidName as error:
        sys.exit(f"{sys.argv[0].rpartition('/')[2]}: {error}")
    return names.basename(topic).strip("~/") or "root"


class RawInput:
    """A topic that is received while it is open.

    Args:
        receive: Function that gets the bytes of a message, its info, and this input.
        unreliable: Whether samples may be lost, which a slow link then does not delay.
    """

    def __init__(
        self, node: Node, topic: str, receive: Receive, *, unreliable: bool = False
    ) -> None:
        self.name: str = node.resolve(topic)
        self._node = node
        self._receive = receive
        self._qos = QoS(_DEPTH, "best_effort" if unreliable else "reliable")
        self._lock = threading.Lock()
        self._subscription: Subscription[Any] | None = None

    def is_latched(self, info: MessageInfo) -> bool:
        """Return whether the publishers of a type latch their messages."""
        subscription = self._subscription
        publishers = [] if subscription is None else subscription.publishers()
        return any(
            token.qos is not None and token.qos.latched
            for token in publishers
            if token.type_hash == info.type_hash
        )

    def open(self) -> None:
        """Subscribe; a second call has no effect."""
        with self._lock:
            if self._subscription is None:
                # Not by `Node.subscription`, where this QoS would ask for no latched messages.
                self._subscription = self._node.keep(
                    GenericSubscription(
                        self._node,
                        self.name,
                        lambda data, info: self._receive(data, info, self),
                        self._qos,
                        raw=True,
                        with_info=True,
                    )
                )

    def close(self) -> None:
        """Unsubscribe; a second call has no effect."""
        with self._lock:
            closing, self._subscription = self._subscription, None
        if closing is not None:
            closing.close()


class RawOutput:
    """A topic to send to.

    Args:
        latch: Whether late subscribers get the last message; as the input does when None.
        changed: Function called whenever a subscriber has come or gone.
    """

    def __init__(
        self,
        node: Node,
        topic: str,
        *,
        latch: bool | None = None,
        changed: Callable[[], object] | None = None,
    ) -> None:
        self.name: str = node.resolve(topic)
        self._node = node
        self._latch = latch
        self._changed = changed
        self._lock = threading.Lock()
        self._publisher: Publisher[Any] | None = None
        self._refused: set[str] = set()

    @property
    def advertised(self) -> bool:
        """Whether the topic is announced, which the first message does."""
        return self._publisher is not None

    @property
    def subscribed(self) -> bool:
        """Whether anybody subscribes to it."""
        return self._publisher is not None and bool(self._publisher.subscribers())

    def advertise(self, info: MessageInfo, source: RawInput) -> None:
        """Announce the topic with the type of a message; a second call has no effect."""
        with self._lock:
            if self._publisher is not None:
                return
            latch = source.is_latched(info) if self._latch is None else self._latch
            kind = _message_type(info)
            self._publisher = made = self._node.publisher(
                self.name, kind, queue_size=_DEPTH, latch=latch
            )
        self._node.log.info("advertised as %s", self.name)
        if self._changed is not None:
            changed = self._changed
            made.on_connection(lambda _: changed(), lambda _: changed())

    def close(self) -> None:
        """Take the topic back; a second call has no effect."""
        with self._lock:
            closing, self._publisher = self._publisher, None
        if closing is not None:
            closing.close()

    def publish(self, data: bytes, info: MessageInfo, source: RawInput) -> None:
        """Send a message; one of another type than the first is reported once and dropped."""
        self.advertise(info, source)
        publisher = self._publisher
        if publisher is None:
            return
        if publisher.token.type_hash == info.type_hash:
            publisher.publish_raw(data)
        elif info.type_hash not in self._refused:
            self._refused.add(info.type_hash)
            self._node.log.warning(
                "dropping what '%s' brings of type %s: '%s' has type %s",
                source.name,
                info.type_name,
                self.name,
                publisher.token.type_name,
            )


def _message_type(info: MessageInfo) -> type[Message]:
    """Return a class with the names of a type for a publisher; it needs no definition."""
    package, _, name = info.type_name.split("/")
    fields = {
        "_type": f"{package}/{name}",
        "_type_name": info.type_name,
        "_type_hash": info.type_hash,
    }
    made: type[Message] = type(name, (Message,), fields)
    return made
