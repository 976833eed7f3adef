"""Topics that ROS 1's nodes subscribe to, from the network.

A subscriber of ROS 1 connects to the bridge itself, as the master tells it to; then the bridge
subscribes for it. Publishers on the network see the subscriber before that, so the bridge keeps
what they publish. All of this runs on the thread for changes, but for the bytes of messages.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import partial
from struct import Struct
from typing import Any

from rosz.bridges.ros1.codec import Codec
from rosz.bridges.ros1.frames import encode_header
from rosz.bridges.ros1.registry import ANY_TYPE, RegistryEntry
from rosz.bridges.ros1.server import Incoming
from rosz.bridges.ros1.shared import QUEUE, BridgeResources, TopicConnection
from rosz.bridges.ros1.sockets import Handler, Stream, log
from rosz.errors import ClosedError, DecodeError, MessageError, RoszError
from rosz.node import BridgedNode, Entity, MessageInfo, Subscription
from rosz.qos import for_queue
from rosz.session import PullSubscriber, Sample
from rosz.wire import Kind, Token, read_attachment

_LENGTH = Struct("<I")
_ALL = 1 << 17
"""Messages that wait where none is to be dropped; their bytes are limited, too."""
_PIECE = 1 << 10
_MANY_PARTS = 32
"""Parts of a message that are not worth a copy; a socket takes 1024 at once."""


class SubscribedTopic:
    """A topic that a node of ROS 1 subscribes to."""

    def __init__(self, shared: BridgeResources, node: BridgedNode, entry: RegistryEntry) -> None:
        self.entry = entry
        self._topic = shared.here(entry.name)
        self._shared = shared
        self._node = node
        self._shown: _ShownSubscription | None = None
        self._links: list[_Link] = []
        self._waiting: tuple[Incoming, dict[str, str]] | None = None
        self._published = False
        self._closed = False
        self.update()

    def connections(self) -> list[TopicConnection]:
        """Return the connections of the node to the bridge."""
        return [
            TopicConnection(self.entry.node, False, link.stream.sent_bytes, link.sent)
            for link in list(self._links)
        ]

    def update(self) -> None:
        """Show the node as a subscriber while it is not connected; then adapt the queues."""
        if self._closed:
            return
        publishers = self._shared.entities(Kind.PUBLISHER, name=self._topic)
        if self._waiting is not None and publishers:
            waiting, self._waiting = self._waiting, None
            self.accept(*waiting)
        if self._links:
            depth = _depth(publishers)
            for link in self._links:
                link.stream.depth = depth
            return
        before, self._published = self._published, bool(publishers)
        if self._shown is None:
            self._show()
        elif before and not self._published:
            self._shown.take()  # nobody expects it with the messages of later publishers

    def _show(self) -> None:
        if self.entry.type_name == ANY_TYPE:
            return
        try:
            codec = self._shared.codecs.of_ros1(self.entry.name, self.entry.type_name)
        except RoszError as error:
            log.info("cannot show a subscriber of '%s': %s", self.entry.name, error)
            return
        entry = self.entry
        number = self._shared.identity(entry.node, Kind.SUBSCRIPTION, entry.name).number
        with suppress(ClosedError):
            self._shown = self._node.keep(
                _ShownSubscription(self._node, self._topic, codec, number)
            )

    def accept(self, incoming: Incoming, header: dict[str, str]) -> None:
        """Send the messages of the network to a connection of the node."""
        shared = self._shared
        source = shared.source(self.entry.name)
        publishers = shared.entities(Kind.PUBLISHER, name=self._topic)
        if not publishers:
            # The last has just gone, and the next may come at once. A subscriber that
            # is refused now may not try again: roscpp takes it for the connection to the next.
            before, self._waiting = self._waiting, (incoming, header)
            if before is not None:  # the node has made another connection
                before[0].stream.end()
            return
        try:
            codec = _choose(shared, source, publishers, header)
        except RoszError as error:
            incoming.stream.send([encode_header({"error": str(error)})])
            incoming.refuse(str(error))
            return
        own = set() if source != self.entry.name else shared.gids
        link = _Link(shared, self._node, incoming.stream, codec, own, self._drop)
        kept = f"{self.entry.name} connected"  # not that of the subscription shown until then
        identity = shared.identity(self.entry.node, Kind.SUBSCRIPTION, kept)
        number = None if self._links else identity.number
        self._links.append(link)
        shown, self._shown = self._shown, None
        link.open(self.entry.name, shared.here(source), publishers, shown, number)
        if shown is not None:
            shown.close()  # later than the link subscribes, so that publishers see no gap

    def close(self) -> None:
        """Take the topic from the network, and end the connections."""
        self._closed = True
        if self._waiting is not None:
            self._waiting[0].stream.end()
        if self._shown is not None:
            self._shown.close()
        for link in list(self._links):
            link.close()

    def _drop(self, link: _Link) -> None:
        if link in self._links:
            self._links.remove(link)
            self.update()
            link.close()


class _ShownSubscription(Entity):
    """A subscription that others see, and that keeps the newest messages for the first link.

    It has no thread, so that many of them cost little.
    """

    def __init__(self, node: BridgedNode, topic: str, codec: Codec, number: int) -> None:
        cls, qos = codec.cls, for_queue(QUEUE)
        super().__init__(
            node, Kind.SUBSCRIPTION, topic, cls._type_name, cls._type_hash, qos, number=number
        )
        # The node receives messages of ROS 1's publishers without the bridge.
        self._samples: PullSubscriber = self.keep(
            node.context.session.pull_subscriber(self.key, QUEUE, remote_only=True)
        )
        self.announce(watch=False)

    def take(self) -> list[Sample]:
        """Return the messages that it keeps, oldest first, and forget them."""
        return self._samples.take()


def _choose(
    shared: BridgeResources, topic: str, publishers: list[Token], header: dict[str, str]
) -> Codec:
    """Return the codec for a connection of a subscriber."""
    wanted = header.get("md5sum", ANY_TYPE)
    reasons: dict[str, str] = {}
    for token in publishers:
        try:
            codec = shared.codecs.of_network(topic, token.type_name, token.type_hash)
        except RoszError as error:
            reasons[token.type_name] = str(error)
            continue
        if codec.fits(wanted):
            return codec
        reasons[token.type_name] = f"topic '{topic}' is {codec.ros1_type} (md5 {codec.md5sum})"
    there = "; ".join(reasons.values())
    raise RoszError(f"{there}; expected {header.get('type', '')} (md5 {wanted})")


def _depth(publishers: Iterable[Token]) -> int:
    """Return how many messages wait for a slow subscriber: as many as for each publisher alone."""
    profiles = [token.qos for token in publishers if token.qos is not None]
    return sum(_ALL if qos.history == "keep_all" else qos.depth for qos in profiles) or QUEUE


class _Link(Handler):
    """One connection of a subscriber, and the subscription that feeds it.

    Args:
        own: Ids of the publishers whose messages are left out.
        ended: Function called with the link when the connection has ended.
    """

    def __init__(
        self,
        shared: BridgeResources,
        node: BridgedNode,
        stream: Stream,
        codec: Codec,
        own: set[bytes],
        ended: Callable[[_Link], object],
    ) -> None:
        self._shared = shared
        self._node = node
        self.stream = stream
        self.sent = 0
        self._codec = codec
        self._own = own
        self._ended = ended
        self._subscription: Subscription[Any] | None = None
        self._piece = memoryview(bytearray(_PIECE))
        self._reported = False
        self._turn = threading.Lock()
        self._early: set[tuple[bytes, int]] = set()

    def open(
        self,
        name: str,
        topic: str,
        publishers: list[Token],
        shown: _ShownSubscription | None = None,
        number: int | None = None,
    ) -> None:
        """Answer the header, subscribe, and send earlier messages.

        Args:
            name: Name of the topic in ROS 1.
            topic: Name of the topic on the network.
            publishers: Its publishers there.
            shown: The subscription that has kept messages until now, if there was one.
            number: Number of the subscription within the session; None for a new one.
        """
        codec, stream = self._codec, self.stream
        latched = any(token.qos is not None and token.qos.latched for token in publishers)
        fields = {
            "callerid": self._shared.standing_for(Kind.PUBLISHER, topic),
            "latching": "1" if latched else "0",
            "md5sum": codec.md5sum,
            "message_definition": codec.definition,
            "topic": name,
            "type": codec.ros1_type,
        }
        stream.send([encode_header(fields)])
        stream.depth = depth = _depth(publishers)
        self._shared.loop.call(self._follow)
        with suppress(ClosedError), self._turn:
            subscription: Subscription[Any] = Subscription(
                self._node,
                topic,
                codec.cls,
                self._receive,
                for_queue(max(QUEUE, depth)),
                raw=True,
                with_info=True,
                number=number,
            )
            self._subscription = self._node.keep(subscription)
            if shown is not None and shown.key == subscription.key:
                self._send_early(shown.take())

    def close(self) -> None:
        """Unsubscribe, and end the connection."""
        if self._subscription is not None:
            self._subscription.close()
        self._shared.loop.call(self.stream.close)

    def _follow(self) -> None:
        """Notice the end of the connection."""
        if self.stream.is_closed:
            self.closed()
        else:
            self.stream.handler = self
            self.stream.pause(reading=True)

    def _send_early(self, samples: Iterable[Sample]) -> None:
        """Send messages from before this link subscribed; some of them come again afterwards."""
        for sample in samples:
            try:
                number, _, publisher = read_attachment(sample.attachment)
            except DecodeError:
                continue  # as the subscription, which says what is wrong
            self._early.add((publisher, number))
            self._send(sample.payload, publisher, number)

    def _receive(self, payload: Any, info: MessageInfo) -> None:
        with self._turn:
            if self._early and (info.gid, info.sequence) in self._early:
                self._early.discard((info.gid, info.sequence))
            else:
                self._send(payload, info.gid, info.sequence)

    def _send(self, payload: Any, publisher: bytes, number: int) -> None:
        if publisher in self._own or self._shared.has_crossed(publisher):
            return  # from ROS 1, which delivers it itself, or over another bridge
        sequence = (number & 0xFFFFFFFF).to_bytes(4, "little")
        try:
            parts = self._codec.from_cdr(payload, sequence)
        except MessageError as error:
            if not self._reported:
                self._reported = True
                log.warning(
                    "dropping a message for node '%s' (told once): %.300s", self._node.name, error
                )
            return
        if len(parts) > _MANY_PARTS:
            parts = [b"".join(parts)]
        self.stream.send([_LENGTH.pack(sum(map(len, parts))), *parts])
        self.sent += 1

    # Called by the stream, on the thread of the loop.

    def space(self) -> memoryview:
        """Return where the next bytes belong: a subscriber sends none."""
        return self._piece

    def closed(self) -> None:
        """Forget the connection."""
        self._shared.changes.submit(partial(self._ended, self))
