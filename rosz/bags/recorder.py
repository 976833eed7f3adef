"""Recording topics: subscriptions that pass encoded messages on to files.

A message is never decoded, unless the format needs another layout. Each publisher is a channel of
its own, with its QoS and its node. A type that is not known here is described by the publisher's
node. The messages of the channel wait in memory until that has replied, and for a second at most
until the token of the publisher is known.

Messages are taken from Zenoh at once, whatever the disk does, and wait in one buffer that is
bounded by bytes. One thread writes them from there. While the processor is too busy to take them,
they wait in Zenoh's channels. Topics with large messages share a quarter of the bound for these.
"""

from __future__ import annotations

import re
import threading
from collections import Counter, deque
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Self

from rosz.bags.bag import Channel, Payload
from rosz.bags.buffer import ROW_BYTES, Buffer, Channels
from rosz.bags.recording import Selection, Sink, Track
from rosz.errors import BagError, ClosedError, MessageError, RoszError
from rosz.idl import is_service_message
from rosz.node import Subscription
from rosz.node.type_description import request_definition
from rosz.qos import QoS
from rosz.wire import NO_HASH, Kind, Token, format_token, gid
from rosz.worker import Worker

if TYPE_CHECKING:
    from rosz.graph import Followed
    from rosz.node import MessageInfo, Node

__all__ = ("Recorder",)

_QOS = QoS(depth=8192)
"""Samples of a topic that wait until they are taken from Zenoh."""
_TOKEN_TIMEOUT = 1.0
"""Time that messages wait for the token of their publisher, which tells its QoS and its node."""
_DEFINITION_TIMEOUT = 10.0
_CLOSE_TIMEOUT = 600.0
_RULE = "=" * 80
_LONG_NAME = re.compile(r"(\w+)/(?:msg|srv)/(\w+)")
"""A name as ROS 2 describes the events of services; readers of bags know ``package/Name`` only."""

_Row = tuple[int, Payload, int | None, int]
"""Stamp, payload, time of sending, sequence number."""


class _Source:
    """One publisher: its track once its definition is known, and what waits until then."""

    def __init__(self, topic: str, info: MessageInfo) -> None:
        self.topic = topic
        self.gid = info.gid
        self.type_name = info.type_name
        self.type_hash = info.type_hash
        self.token: Token | None = None
        self.defined = False
        self.track: Track | None = None
        self.held: deque[_Row] = deque()
        self.lock = threading.Lock()

    def channel(self, definition: str, md5: str) -> Channel:
        """Return its channel."""
        token = self.token
        return Channel(
            self.topic,
            self.type_name,
            definition=definition,
            md5=md5,
            type_hash="" if self.type_hash == NO_HASH else self.type_hash,
            qos=(token.qos,) if token is not None and token.qos is not None else (),
            node="" if token is None else token.node_name,
        )


class Recorder:
    """Records topics until it is closed.

    Args:
        node: The node that subscribes.
        selection: The topics.
        sink: What takes the messages.
        report: Function called with a sentence for the user.
        limit: Number of messages to record of each topic; 0 for all.
        ended: Event that others may set, too.
        buffer: Bytes that may wait to be written; 0 for no limit.

    Attributes:
        ended: As given. Set when recording has come to its end, or failed.
        lost: Number of messages that did not arrive or found no room.
        error: What made it fail.
    """

    def __init__(
        self,
        node: Node,
        selection: Selection,
        sink: Sink,
        report: Callable[[str], object],
        limit: int = 0,
        ended: threading.Event | None = None,
        *,
        buffer: int = 0,
    ) -> None:
        self._node = node
        self._selection = selection
        self._sink = sink
        self._report = report
        self._limit = limit
        self._lock = threading.Lock()
        self._counting = threading.Lock()
        self._most = buffer
        self._held_bytes = 0
        self._channels = Channels(buffer // 4, _QOS.depth)
        self._buffer: Buffer[tuple[_Source, _Row]] = Buffer(
            buffer, lambda: sink.waiting + self._held_bytes + self._channels.size
        )
        self._subscribed: dict[str, Subscription[bytes]] = {}
        self._publishers: dict[str, Followed] = {}
        self._sources: dict[bytes, _Source] = {}
        self._counts: Counter[str] = Counter()
        self._warned: set[str] = set()
        self._worker: Worker[Callable[[], object]] = Worker("rosz-bag-recorder", threads=4)
        self._late: Worker[Callable[[], object]] = Worker("rosz-bag-tokens")
        self.ended: threading.Event = ended or threading.Event()
        self.lost: int = 0
        self.error: BagError | None = None
        self._writer = Worker("rosz-bag-buffer", self._take, receive=self._buffer.take)
        for name in selection.at_once:
            self._subscribe(name)
        # Topics that are named are subscribed to already.
        self._listener = None if selection.named else node.listen(self._follow)

    @property
    def topics(self) -> list[str]:
        """The topics that are recorded, sorted."""
        return sorted(self._subscribed)

    def _follow(self, token: Token, alive: bool) -> None:
        own = token.zid == self._node.context.session.zid
        if alive and not own and token.qos is not None and self._selection.has(token):
            self._worker.submit(partial(self._subscribe, token.name))

    def _subscribe(self, topic: str) -> None:
        with self._lock:
            if topic in self._subscribed or self._worker.closed:
                return
            self._report(f"Subscribing to {topic}")
            graph = self._node.context.graph
            try:
                publishers = graph.follow_entities(Kind.PUBLISHER, topic)
                self._publishers[topic] = self._node.keep(publishers)
                publishers.listen(self._learn, history=False)
                subscription: Subscription[bytes] = Subscription(
                    self._node,
                    topic,
                    None,
                    partial(self._receive, topic),
                    _QOS,
                    raw=True,
                    with_info=True,
                    warn_dropped=False,
                    fit=partial(self._channels.fit, topic) if self._most else None,
                )
                self._subscribed[topic] = self._node.keep(subscription)
            except ClosedError:
                return  # the node ends

    # Messages: on the threads of the subscriptions, which never wait.

    def _receive(self, topic: str, data: Payload, info: MessageInfo) -> None:
        if info.lost:
            self._lose(info.lost)
        if self.error is not None:
            return
        source = self._sources.get(info.gid) or self._source(topic, info)
        clock = self._node.clock
        stamp = clock.now() if clock.simulated else info.reception_time
        row = (stamp, data, info.source_time or None, info.sequence)
        dropped = self._buffer.put((source, row), len(data))
        if dropped:
            self._lose(dropped)
            self._warn_once(
                f"the buffer of {self._most >> 20} MB is full, and the oldest messages are"
                " dropped: the disk is too slow"
            )

    def _lose(self, count: int) -> None:
        with self._counting:
            self.lost += count

    # Messages: on the thread that writes.

    def _take(self, item: tuple[_Source, _Row]) -> None:
        """Write a message, or keep it until its definition is known."""
        source, row = item
        if source.track is None:
            with source.lock:
                if source.track is None:
                    self._hold(source, row)
                    return
        self._write(source.track, row)

    def _hold(self, source: _Source, row: _Row) -> None:
        source.held.append(row)
        self._count_held(row, 1)
        while self._most and self._held_bytes > self._most // 2 and source.held:
            self._count_held(source.held.popleft(), -1)
            self._lose(1)

    def _count_held(self, row: _Row, sign: int) -> None:
        with self._counting:
            self._held_bytes += sign * (len(row[1]) + ROW_BYTES)

    def _write(self, track: Track, row: _Row) -> None:
        topic = track.channel.topic
        if self.error is not None:
            return
        if self._limit and self._counts[topic] >= self._limit:
            return
        try:
            lost = self._sink.write(track, *row)
        except MessageError as error:
            self._lose(1)
            self._warn_once(f"a message of {topic} is left out: {error}")
            return
        except BagError as error:
            self._fail(error)
            return
        if lost:
            self._lose(lost)
        if self._limit:
            self._count(topic)

    def _count(self, topic: str) -> None:
        self._counts[topic] += 1
        wanted = self._selection.topics
        named = self._selection.named
        if named and all(self._counts[name] >= self._limit for name in wanted):
            self.ended.set()

    def _fail(self, error: BagError) -> None:
        self.error = error
        self.ended.set()

    def _warn_once(self, text: str) -> None:
        """Report something once."""
        if text not in self._warned:
            self._warned.add(text)
            self._report(f"WARNING: {text}")

    # Channels.

    def _source(self, topic: str, info: MessageInfo) -> _Source:
        """Return the publisher of a first message, which may come before its token."""
        source = self._sources[info.gid] = _Source(topic, info)
        # What is known is looked at after `_learn` can find the source, so that none is missed.
        token = self._find_token(source)
        if token is not None:
            self._define(source, token)
        else:
            self._late.later(_TOKEN_TIMEOUT, partial(self._define, source, None))
        return source

    def _find_token(self, source: _Source) -> Token | None:
        found = self._publishers[source.topic].view().publishers(source.topic)
        return next((one for one in found if gid(format_token(one)) == source.gid), None)

    def _learn(self, token: Token, alive: bool) -> None:
        """Begin to record the publisher of a token, if its messages wait for that."""
        source = self._sources.get(gid(format_token(token))) if alive else None
        if source is not None:
            self._worker.submit(partial(self._define, source, token))

    def _define(self, source: _Source, token: Token | None) -> None:
        """Begin to record a publisher, with its definition from here or from its node."""
        with source.lock:
            if source.defined:
                return
            source.defined, source.token = True, token
        known = self._definition(source)
        if known is not None:
            self._begin(source, *known)
        elif token is None:
            self._begin(source, "", "")
        else:
            self._worker.submit(partial(self._request_definition, source, token))

    def _definition(self, source: _Source) -> tuple[str, str] | None:
        """Return the definition and the md5 of a publisher's type, if it is the one known here."""
        try:
            cls = self._node.context.types.message(source.type_name)
        except RoszError:
            return None
        same = source.type_hash in {NO_HASH, cls._type_hash}
        return (cls._full_text, cls._md5sum) if same else None

    def _request_definition(self, source: _Source, token: Token) -> None:
        try:
            found = request_definition(self._node, token, _DEFINITION_TIMEOUT)
        except RoszError as error:
            self._warn_once(
                f"{source.topic} is recorded without the definition of its type: {error}"
            )
            self._begin(source, "", "")
            return
        texts = [found.text]
        texts += [f"{_RULE}\nMSG: {name}\n{text}" for name, text in found.others.items()]
        text = "\n".join(texts)
        if is_service_message(found.name):
            text = _LONG_NAME.sub(r"\1/\2", text)
        try:
            md5 = self._node.context.types.message_from_text(found.name, text)._md5sum
        except RoszError as error:
            self._warn_once(f"the definition of {found.name} is not well-formed: {error}")
            md5 = ""
        self._begin(source, text, md5)

    def _begin(self, source: _Source, definition: str, md5: str) -> None:
        channel = source.channel(definition, md5)
        try:
            track = self._sink.track(channel, self._node.context.types)
        except RoszError as error:
            self._warn_once(f"{source.topic} is not recorded: {error}")
            return
        with source.lock:
            while source.held:
                row = source.held.popleft()
                self._write(track, row)
                self._count_held(row, -1)
            source.track = track

    def close(self) -> None:
        """Stop receiving; a second call has no effect."""
        if self._listener is not None:
            self._listener.close()
        self._worker.close()
        self._late.close()
        with self._lock:
            for subscription in self._subscribed.values():
                subscription.close()
        self._buffer.close()
        self._writer.close(_CLOSE_TIMEOUT)
        for source in list(self._sources.values()):
            if source.track is None:  # its token has not come in time, or its node not replied
                source.token = source.token or self._find_token(source)
                self._begin(source, *(self._definition(source) or ("", "")))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc_info: object) -> None:
        self.close()
