"""The messages of a recording that wait to be written, within one bound in bytes."""

from __future__ import annotations

import threading
from typing import TypeAlias

from rosz.bags.bag import Channel, Payload
from rosz.bags.record.recording import Track
from rosz.node import MessageInfo
from rosz.queue import BoundedQueue
from rosz.wire import NO_HASH, Token

ROW_BYTES = 400
"""Bytes of memory that a message takes beside its payload while it waits."""
_COLLECT_SECONDS = 0.01
"""Time to wait for more after the first message, as waking a thread for each takes longer than
writing it."""
_SMALL_CHANNEL = 4 << 20
"""Bytes that may wait in the channel of a topic with small messages; they are not counted."""
_LEAST = 8
"""Messages of a topic that may wait in its channel however large they are."""

Row: TypeAlias = tuple[int, Payload, int | None, int]
"""Stamp, payload, time of sending, sequence number."""


class RecordedPublisher:
    """A publisher: its track once its definition is known, and its messages until then."""

    def __init__(self, topic: str, info: MessageInfo) -> None:
        self.topic = topic
        self.gid = info.gid
        self.type_name = info.type_name
        self.type_hash = info.type_hash
        self.token: Token | None = None
        self.defined = False
        self.track: Track | None = None
        self.rows: BoundedQueue[Row] = BoundedQueue()

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


class MessageQueue:
    """The messages that wait, with all that wait in Zenoh: the oldest make room for new ones.

    Those of a publisher without a track wait aside, and take half of the room at most. The limit is
    in bytes; 0 for none.
    """

    def __init__(self, limit: int, channels: Channels) -> None:
        self._limit = limit
        self._channels = channels
        self._changed = threading.Condition()
        self._closed = threading.Event()
        self._ready: BoundedQueue[tuple[Track, Row]] = BoundedQueue()
        self._aside = 0

    @property
    def size(self) -> int:
        """Bytes that wait."""
        return self._ready.size + self._aside

    @property
    def ended(self) -> bool:
        """Whether it was closed and nothing waits any more."""
        return self._closed.is_set() and not self._ready

    def put(self, publisher: RecordedPublisher, row: Row) -> int:
        """Add a message, and never wait; return the number of oldest messages that were dropped."""
        size = len(row[1]) + ROW_BYTES
        with self._changed:
            if publisher.track is None:
                return self._put_aside(publisher.rows, row, size)
            return self._put_ready(publisher.track, row, size)

    def _put_aside(self, rows: BoundedQueue[Row], row: Row, size: int) -> int:
        others = self._aside - rows.size
        if self._limit:
            rows.most_bytes = max(self._limit // 2 - others, 1)
        dropped = rows.put(row, size)
        self._aside = others + rows.size
        return len(dropped)

    def _put_ready(self, track: Track, row: Row, size: int) -> int:
        if self._limit:
            room = self._limit - self._channels.size - self._aside
            self._ready.most_bytes = max(room, 1)
        dropped = self._ready.put((track, row), size)
        if len(self._ready) == 1:
            self._changed.notify()
        return len(dropped)

    def release(self, publisher: RecordedPublisher, track: Track) -> int:
        """Let the messages of a publisher be taken; return how many old ones were dropped."""
        with self._changed:
            publisher.track = track
            self._aside -= publisher.rows.size
            dropped = 0
            for row in publisher.rows:
                dropped += self._put_ready(track, row, len(row[1]) + ROW_BYTES)
            publisher.rows.clear()
            return dropped

    def take(self, timeout: float) -> tuple[Track, Row] | None:
        """Wait some seconds, and return the oldest message; None if none comes, or at the end."""
        if not self._ready:
            with self._changed:
                self._changed.wait_for(lambda: self._ready or self._closed.is_set(), timeout)
            if self._ready:
                self._closed.wait(_COLLECT_SECONDS)
        with self._changed:
            return self._ready.pop() if self._ready else None

    def close(self) -> None:
        """End the queue once it is empty; a second call has no effect."""
        self._closed.set()
        with self._changed:
            self._changed.notify_all()


class Channels:
    """The capacity of each topic's Zenoh channel, so that all together keep to a bound in bytes.

    Topics with large messages share the bytes. Sizes and numbers are rounded, so that they change
    rarely. The depth is the largest number of messages in a channel.

    Attributes:
        size: Bytes that may wait in the channels of topics with large messages.
    """

    def __init__(self, limit: int, depth: int) -> None:
        self._limit = limit
        self._depth = depth
        self._lock = threading.Lock()
        self._largest: dict[str, int] = {}
        self._share = limit
        self.size: int = 0

    def fit(self, topic: str, size: int) -> int:
        """Return how many messages of some bytes may wait in the channel of a topic."""
        largest = self._largest.get(topic, 0)
        if size > largest:
            with self._lock:
                # To an eighth more at most: images of 1 MB have some bytes more than 1 MB.
                step = 1 << max(size.bit_length() - 4, 0)
                largest = self._largest[topic] = -(-size // step) * step
                large = [each for each in self._largest.values() if self._is_large(each)]
                self._share = self._limit // max(len(large), 1)
                self.size = sum(each * self._fitting(each) for each in large)
        return self._fitting(largest) if self._is_large(largest) else self._depth

    def _is_large(self, size: int) -> bool:
        return size * self._depth > _SMALL_CHANNEL

    def _fitting(self, size: int) -> int:
        count = self._share // size
        step = 1 << max(count.bit_length() - 2, 0)
        return min(max(count // step * step, _LEAST), self._depth)
