"""Recording topics: subscriptions that pass encoded messages on to files.

A message is never decoded, unless the format needs another layout. Each publisher is a channel of
its own, with its QoS and its node.

Messages are taken from Zenoh at once, whatever the disk does, and wait in one queue that is bounded
by bytes. One thread writes them from there. While the processor is too busy to take them, they wait
in Zenoh's channels. Topics with large messages share a quarter of the bound for these.
"""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Callable
from functools import partial
from typing import TypeAlias

from rosz.bags.bag import Channel, Payload
from rosz.bags.record.publishers import RecordedPublishers
from rosz.bags.record.queue import Channels, MessageQueue, RecordedPublisher, Row
from rosz.bags.record.recording import Sink, Track
from rosz.bags.record.selection import Selection
from rosz.errors import BagError, ClosedError, MessageError, RoszError
from rosz.lifecycle import Closing
from rosz.node import MessageInfo, Node, Subscription
from rosz.qos import QoS
from rosz.wire import Kind, Token
from rosz.worker import Worker

_QOS = QoS(depth=8192)
"""Samples of a topic that wait until they are taken from Zenoh."""
_FLUSH_SECONDS = 0.5
"""Time after which a message is in the file, whatever happens to the recorder."""
_CLOSE_TIMEOUT = 600.0
_SETTLE_SECONDS = 2.0
"""Time after which a subscription has its links, also on a busy machine."""
_LOOK_SECONDS = 1.0
"""Longest time to look at the end for topics that were not followed."""

_Item: TypeAlias = tuple[Track, Row] | tuple[()]


class Recorder(Closing):
    """Records topics until it is closed.

    Args:
        node: The node that subscribes.
        selection: The topics.
        sink: The destination of the messages.
        report: Function called with a sentence for the user.
        limit: Number of messages to record of each topic; 0 for all.
        ended: Event that others may set, too.
        buffer: Bytes that may wait to be written; 0 for no limit.

    Attributes:
        ended: As given. Set when recording has come to its end, or failed.
        lost: Number of messages that did not arrive or found no room. At the end, each topic counts
            as one that was there and not yet followed.
        error: The error that ended recording.
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
        self._channels = Channels(buffer // 4, _QOS.depth)
        room = max(buffer - sink.chunk_size, 1) if buffer else 0
        self._queue = MessageQueue(room, self._channels)
        self._subscribed: dict[str, Subscription[bytes]] = {}
        self._since: dict[str, float] = {}
        self._begun = time.time_ns()
        self._publishers = RecordedPublishers(node, self._begin, self._warn_once)
        self._counts: Counter[str] = Counter()
        self._warned: set[str] = set()
        self._worker: Worker[Callable[[], object]] = Worker("rosz-bag-recorder")
        self.ended: threading.Event = ended or threading.Event()
        self.lost: int = 0
        self.error: BagError | None = None
        self._tick_due = time.monotonic() + _FLUSH_SECONDS
        self._writer: Worker[_Item] = Worker("rosz-bag-writer", self._handle, receive=self._next)
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
            try:
                self._publishers.follow(topic)
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
                    history_from=self._begun,
                )
                self._subscribed[topic] = self._node.keep(subscription)
                self._since[topic] = time.monotonic()
            except ClosedError:
                return  # the node ends

    # On the threads of the subscriptions, which never wait.

    def _receive(self, topic: str, data: Payload, info: MessageInfo) -> None:
        if info.lost:
            self._lose(info.lost)
        if self.error is not None:
            return
        publisher = self._publishers.find(topic, info)
        clock = self._node.clock
        stamp = clock.now() if clock.simulated else info.reception_time
        row = (stamp, data, info.source_time or None, info.sequence)
        dropped = self._queue.put(publisher, row)
        if dropped:
            self._lose(dropped)
            if publisher.track is not None:
                self._warn_once(
                    f"the buffer of {self._most >> 20} MB is full, and the oldest messages are"
                    " dropped: the disk is too slow"
                )

    def _lose(self, count: int) -> None:
        with self._counting:
            self.lost += count

    def _begin(self, publisher: RecordedPublisher, channel: Channel) -> None:
        try:
            track = self._sink.track(channel, self._node.context.types)
        except RoszError as error:
            self._warn_once(f"{publisher.topic} is not recorded: {error}")
            return
        self._lose(self._queue.release(publisher, track))

    # On the thread that writes.

    def _next(self) -> _Item | None:
        """Return the next message; an empty tuple if none comes for a while, None at the end."""
        return None if self._queue.ended else self._queue.take(_FLUSH_SECONDS) or ()

    def _handle(self, item: _Item) -> None:
        if item and self.error is None:
            self._write(*item)
        if self.error is None and time.monotonic() >= self._tick_due:
            self._tick_due = time.monotonic() + _FLUSH_SECONDS
            try:
                self._sink.tick(self._node.now())
            except BagError as error:
                self._fail(error)

    def _write(self, track: Track, row: Row) -> None:
        topic = track.channel.topic
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
            self._counts[topic] += 1
            wanted = self._selection.topics if self._selection.named else ()
            if wanted and all(self._counts[name] >= self._limit for name in wanted):
                self.ended.set()

    def _fail(self, error: BagError) -> None:
        self.error = error
        self.ended.set()

    def _warn_once(self, text: str) -> None:
        """Report something once."""
        if text not in self._warned:
            self._warned.add(text)
            self._report(f"WARNING: {text}")

    def _lose_unfollowed(self) -> None:
        """Count and name the topics of which nothing came as they were not yet followed."""
        settled = time.monotonic() - _SETTLE_SECONDS
        followed = self._publishers.topics
        followed |= {topic for topic, since in list(self._since.items()) if since < settled}
        if self._selection.named and followed.issuperset(self._selection.at_once):
            return
        try:
            view = self._node.context.graph.refresh(_LOOK_SECONDS)
        except RoszError:
            return  # the session has ended
        own = self._node.context.session.zid
        missed = {
            token.name
            for token in view.entities(Kind.PUBLISHER)
            if token.zid != own and self._selection.has(token)
        } - followed
        if missed:
            self._lose(len(missed))
            self._report(
                "WARNING: the recording ended before messages could come of"
                f" {', '.join(sorted(missed))}; each counts as one that was lost"
            )

    def close(self) -> None:
        """Stop receiving, and write the rest; a second call has no effect."""
        if not self._worker.closed:
            self._lose_unfollowed()
        if self._listener is not None:
            self._listener.close()
        self._worker.close()
        self._publishers.close()
        with self._lock:
            for subscription in self._subscribed.values():
                subscription.close()
        self._publishers.begin_all()
        self._queue.close()
        self._writer.close(_CLOSE_TIMEOUT)
