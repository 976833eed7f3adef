"""Large samples for other machines, which fetch them in pieces, each at its own pace.

Zenoh drops a sample of many pieces when a link takes longer for it than 50 ms, and to wait for a
slow link would hold up all other links. So a publisher keeps its newest samples and announces them,
and a subscription on another machine asks for one piece after the other. No piece waits for a link,
so small samples pass between them, and a subscription that is slow or stopped delays nobody.

The publisher repeats its announcement until the subscription has fetched the samples. So neither
a lost announcement nor a link that was cut loses a sample that is still kept.
"""

from __future__ import annotations

import sys
import threading
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from itertools import takewhile
from typing import NamedTuple

import msgspec

from rosz.errors import ClosedError, TransportError
from rosz.graph import View
from rosz.node.direct_delivery import announcement_key, direct_key, own_direct_key
from rosz.node.entity import Entity
from rosz.session import Cancellation, Query, Queryable, Replies, Sample
from rosz.wire import Token, host_number
from rosz.worker import Worker

LARGE = 1 << 15
"""Bytes beyond which a sample is large; ten smaller ones fit into the buffer of a link."""
_PIECE = 60_000
"""Bytes of one reply, which Zenoh sends in one batch of up to 65535 bytes."""
_AT_ONCE = 2 * _PIECE
"""Bytes of one request: as much as the queue of a link holds, so that no thread waits for room."""
_MOST_BYTES = 1 << 28
"""Bytes that a publisher keeps at most, whatever the depth of its queue; one sample in any case."""
_THREADS = 16
_ROOM_SECONDS = 5.0
_AGAIN_SECONDS = 1.0
_RETURN_SECONDS = 60.0
"""Seconds in which a subscription that is gone may return, because only its link was cut."""
_ARRIVAL_SECONDS = 0.1
"""Seconds in which a sample that was published arrives over a link that is fast enough."""
_POLL_SECONDS = 0.02
_TIMEOUT = 5.0
_SILENT_SECONDS = 2.0
_CLOSE_SECONDS = 8.0
_SUBSCRIPTIONS = 1000
"""Subscriptions to remember; the oldest is forgotten."""


class _Announcement(msgspec.Struct, frozen=True, array_like=True):
    """The samples that a publisher keeps for a subscription.

    Attributes:
        zid: The session of the publisher.
        entity_id: The number of the publisher.
        gid: The 16 bytes that identify the publisher.
        published: Whether the samples were published as well, and may have arrived already.
        samples: The sequence number and the size in bytes of each sample, oldest first.
    """

    zid: str
    entity_id: int
    gid: bytes
    published: bool
    samples: list[tuple[int, int]]


class _Request(msgspec.Struct, frozen=True, array_like=True):
    """A request of a subscription for a sample.

    Attributes:
        sequence: The sequence number of the sample.
        offset: The bytes of it that have come already; all of them when it needs nothing more.
        subscription: The key of the subscription for direct delivery.
    """

    sequence: int
    offset: int
    subscription: str


_encode = msgspec.msgpack.Encoder().encode
_read_announcement = msgspec.msgpack.Decoder(_Announcement).decode
_read_request = msgspec.msgpack.Decoder(_Request).decode


class FetchedSample(NamedTuple):
    """A sample that was put together from pieces.

    Attributes:
        key: The key expression of the publisher.
        payload: The encoded message.
        attachment: The bytes beside it.
    """

    key: str
    payload: bytes
    attachment: bytes | None


def _source_key(key: str, zid: str, entity_id: int) -> str:
    """Return the key of the kept samples of a publisher.

    It lies below the key of the topic, which everybody who may receive the topic may query.
    """
    return f"{key}/@adv/rosz/{zid}/{entity_id}"


class FetchableSamples:
    """The newest samples of a publisher, for subscriptions on other machines.

    Args:
        publisher: The publisher.
        depth: The number of samples to keep; ``None`` to wait for room instead, at most 5 seconds.
        report_dropped: Function called with the node of a subscription for each sample that it has
            not fetched before newer ones took its place.

    Attributes:
        to_publish: Whether there are subscriptions of ROS 2, which receive only published samples.
    """

    def __init__(
        self, publisher: Entity, depth: int | None, report_dropped: Callable[[str], object]
    ) -> None:
        token = publisher.token
        self._publisher = publisher
        self._context = publisher.node.context
        self._depth = sys.maxsize if depth is None else depth
        self._waits = depth is None
        self._report_dropped = report_dropped
        self._key = _source_key(publisher.key, token.zid, token.entity_id)
        self._lock = threading.RLock()  # a signal handler may publish meanwhile
        self._view: View | None = None
        self._near: list[str] = []
        self._far: dict[str, Token] = {}
        self.to_publish: bool = False
        self._gone: dict[str, float] = {}
        self._last = 0
        self._published = False
        self._kept: dict[int, tuple[bytes, bytes]] = {}
        self._bytes = 0
        # Samples that are being fetched, so that newer ones do not take their places.
        self._current: dict[str, tuple[int, bytes, bytes]] = {}
        # The number up to which a subscription needs nothing more, also while its link is cut.
        self._done: dict[str, int] = {}
        self._progress = threading.Event()
        self._worker: Worker[Callable[[], object]] = Worker(f"rosz-announce{publisher.name}")
        self._queryable: Queryable | None = None
        self._announcing = False

    def drop_unneeded(self) -> bool:
        """Drop what nobody needs; return whether other machines have to fetch the samples."""
        view = self._publisher.others.view()
        with self._lock:
            if view is not self._view:
                self._sort(view)
            now = time.monotonic()
            self._gone = {k: t for k, t in self._gone.items() if now - t < _RETURN_SECONDS}
            waiting = (*self._far, *self._gone)
            done = min((self._done.get(key, self._last) for key in waiting), default=self._last)
            for number in list(takewhile(lambda number: number <= done, self._kept)):
                self._bytes -= len(self._kept.pop(number)[0])
            return bool(waiting)

    @property
    def undecided(self) -> bool:
        """Whether the subscriptions that existed before the publisher are not known yet."""
        return not self._publisher.others.complete

    def when_decided(self, callback: Callable[[], object]) -> None:
        """Call a function, on another thread, once that is known."""

        def check() -> None:
            if self.undecided:
                self._worker.later(_POLL_SECONDS, check)
            else:
                callback()

        self._worker.submit(check)

    def _sort(self, view: View) -> None:
        """Sort the subscriptions into those of this machine and those of others."""
        publisher = self._publisher
        here = host_number(publisher.token.zid)
        near: list[str] = []
        far: dict[str, Token] = {}
        foreign = False
        for token in filter(publisher.matches, view.subscriptions(publisher.name)):
            key = direct_key(token)
            if key is None:
                foreign = True
            elif host_number(token.zid) == here:
                near.append(key)
            else:
                far[key] = token
        self.to_publish = foreign
        gone = dict.fromkeys(self._far.keys() - far.keys(), time.monotonic())
        self._gone = {key: t for key, t in (self._gone | gone).items() if key not in far}
        for key in gone:
            self._current.pop(key, None)
        for key in far:
            self._done.setdefault(key, self._last)
        while len(self._done) > max(_SUBSCRIPTIONS, len(far)):
            del self._done[next(key for key in self._done if key not in far)]
        self._near, self._far, self._view = near, far, view

    def send(self, sequence: int, payload: bytes, attachment: bytes, *, published: bool) -> None:
        """Announce a sample to the subscriptions of other machines.

        Args:
            sequence: The sequence number.
            payload: The encoded message.
            attachment: The bytes beside it.
            published: Whether it is published; the subscriptions of this machine get it if not.

        Raises:
            ClosedError: The publisher is closed.
        """
        if self._waits:
            self._wait_for_room(len(payload))
        with self._lock:
            if self._queryable is None:
                self._queryable = self._context.session.pull_queryable(self._key)
                name, receive = f"rosz-samples{self._publisher.name}", self._queryable.receive
                Worker(name, self._reply, receive=receive, threads=_THREADS)
            self._last = sequence
            self._published = published
            self._kept[sequence] = (payload, attachment)
            self._bytes += len(payload)
            while len(self._kept) > self._depth or (
                self._bytes > _MOST_BYTES and len(self._kept) > 1
            ):
                self._drop_oldest()
            near, far = [] if published else self._near, list(self._far)
            first, self._announcing = not self._announcing, True
        session = self._context.session
        for key in near:
            session.put(key, payload, attachment=attachment, block=self._waits)
        for key in far:
            self._announce(key)
        if first:
            self._worker.later(_AGAIN_SECONDS, self._announce_again)

    def _wait_for_room(self, size: int) -> None:
        """Wait until there is room for a sample, or none is kept."""
        deadline = time.monotonic() + _ROOM_SECONDS
        while (left := deadline - time.monotonic()) > 0:
            self._progress.clear()
            self.drop_unneeded()
            if not self._kept or self._bytes + size <= _MOST_BYTES:
                return
            self._progress.wait(left)

    def _drop_oldest(self) -> None:
        sequence = next(iter(self._kept))
        self._bytes -= len(self._kept.pop(sequence)[0])
        for key, token in self._far.items():
            current = self._current.get(key)
            if self._done[key] < sequence and (current is None or current[0] != sequence):
                self._done[key] = sequence
                self._report_dropped(token.node_name)

    def _announce(self, key: str) -> None:
        with self._lock:
            done = self._done.get(key, self._last)
            samples = [(n, len(payload)) for n, (payload, _) in self._kept.items() if n > done]
        if samples:
            publisher, token = self._publisher, self._publisher.token
            announcement = _Announcement(
                token.zid, token.entity_id, publisher.gid, self._published, samples
            )
            self._context.session.put(announcement_key(key), _encode(announcement), block=False)

    def _announce_again(self) -> None:
        """Repeat the announcements until all samples have been fetched."""
        with self._lock:
            behind = self._behind()
            self._announcing = again = bool(behind or self._gone)
        self.drop_unneeded()
        with suppress(ClosedError):  # the session may close meanwhile
            for key in behind:
                self._announce(key)
        if again:
            self._worker.later(_AGAIN_SECONDS, self._announce_again)

    def _behind(self) -> list[str]:
        return [key for key in self._far if self._done[key] < self._last]

    def _reply(self, query: Query) -> None:
        """Send the next pieces of a sample, or an empty one if it is not kept any more."""
        with query:
            try:
                request = _read_request(query.payload or b"")
            except msgspec.DecodeError as error:
                query.reply_error(f"cannot read the request: {error}")
                return
            payload, attachment = self._find(request)
            self._progress.set()
            if payload and request.offset >= len(payload):
                return
            end = min(request.offset + _AT_ONCE, len(payload))
            for begin in range(request.offset, end, _PIECE) if payload else (0,):
                piece = payload[begin : min(begin + _PIECE, end)]
                query.reply(self._key, piece, attachment=attachment)

    def _find(self, request: _Request) -> tuple[bytes, bytes]:
        """Return the requested sample, and note the progress of the subscription."""
        sequence, key = request.sequence, request.subscription
        with self._lock:
            current = self._current.get(key)
            if current is not None and current[0] == sequence:
                payload, attachment = current[1:]
            else:
                payload, attachment = self._kept.get(sequence, (b"", b""))
            if payload and request.offset >= len(payload):
                self._current.pop(key, None)
                self._done[key] = max(sequence, self._done.get(key, 0))
            elif payload and key in self._far:
                self._current[key] = sequence, payload, attachment
            return payload, attachment

    def flush(self) -> dict[str, int]:
        """Wait until all samples have been fetched, or nobody fetches any more.

        Returns:
            The number of samples that were not fetched, by the node of the subscription.
        """
        deadline = time.monotonic() + _CLOSE_SECONDS
        while self.drop_unneeded() and (left := deadline - time.monotonic()) > 0:
            self._progress.clear()
            if not self._behind() or not self._progress.wait(min(left, _SILENT_SECONDS)):
                break
        with self._lock:
            nodes = [(self._far[key].node_name, self._done[key]) for key in self._behind()]
            return Counter(node for node, done in nodes for n in self._kept if n > done)

    def close(self) -> None:
        """End its threads; a second call has no effect."""
        self._worker.close(0)
        if self._queryable is not None:
            self._queryable.close()


class Fetcher(msgspec.Struct, eq=False):
    """Fetches large samples for one subscription.

    Args:
        subscription: The subscription, with the type of the publishers.
        depth: The number of newest samples that wait to be fetched; older ones are left out.
        receive: Function that gets each sample, and the GID of its publisher.
        last: Function that gets the GID of a publisher, and returns the sequence number of its
            latest sample that was received.
    """

    _subscription: Entity
    _depth: int
    _receive: Callable[[FetchedSample, bytes], object]
    _last: Callable[[bytes], int]
    _cancel: Cancellation = msgspec.field(default_factory=Cancellation)
    _sources: dict[tuple[str, int], _FetchSource] = msgspec.field(default_factory=dict)

    def announced(self, sample: Sample) -> None:
        """Fetch the samples that a publisher announces, on a thread for each publisher.

        Called on a thread of the session.
        """
        try:
            announcement = _read_announcement(sample.payload)
        except msgspec.DecodeError as error:
            raise TransportError(f"cannot read the announcement of a sample: {error}") from error
        place = announcement.zid, announcement.entity_id
        source = self._sources.get(place)
        if source is None:
            self._forget_ended()
            key = _source_key(self._subscription.key, *place)
            gid = announcement.gid
            source = _FetchSource(
                self._subscription,
                key,
                self._depth,
                lambda fetched: self._receive(fetched, gid),
                lambda: self._last(gid),
                self._cancel,
            )
            self._sources[place] = source
        source.announced(announcement)

    def _forget_ended(self) -> None:
        subscription = self._subscription
        publishers = subscription.others.view().publishers(subscription.name)
        alive = {(t.zid, t.entity_id) for t in publishers}
        for place in self._sources.keys() - alive:
            self._sources.pop(place).close()

    def close(self) -> None:
        """Fetch nothing more; a second call has no effect."""
        self._cancel.cancel()
        for source in self._sources.values():
            source.close()


class _FetchSource:
    """One publisher, whose samples are fetched in their order."""

    def __init__(
        self,
        subscription: Entity,
        key: str,
        depth: int,
        receive: Callable[[FetchedSample], object],
        last: Callable[[], int],
        cancel: Cancellation,
    ) -> None:
        self._session = subscription.node.context.session
        self._topic_key = subscription.key
        self._own = own_direct_key(subscription.token)
        self._key = key
        self._depth = depth
        self._receive = receive
        self._last = last
        self._cancel = cancel
        self._published = False
        self._wanted: list[tuple[int, int]] = []
        self._done = 0
        self._partly = 0, bytearray()
        self._worker: Worker[Callable[[], object]] = Worker(f"rosz-fetch{subscription.name}")

    def announced(self, announcement: _Announcement) -> None:
        """Fetch some samples, rather than those announced before."""
        self._wanted, self._published = announcement.samples, announcement.published
        if self._published:
            self._worker.later(_ARRIVAL_SECONDS, self._fetch_all)
        else:
            self._worker.submit(self._fetch_all)

    def close(self) -> None:
        """End the thread."""
        self._worker.close(0)

    def _fetch_all(self) -> None:
        """Fetch the announced samples until nobody replies; an announcement begins it again."""
        try:
            while not self._worker.closed and (wanted := self._next()) is not None:
                if not self._fetch(*wanted):
                    return
        except ClosedError:
            return  # the subscription or the session is closed

    def _next(self) -> tuple[int, int] | None:
        return next(
            (sample for sample in self._wanted[-self._depth :] if sample[0] > self._done), None
        )

    def _fetch(self, sequence: int, size: int) -> bool:
        """Fetch a sample; return false if nobody replies."""
        if self._published and sequence <= self._last():
            self._done = sequence
            self._query(sequence, size)
            return True
        if self._partly[0] != sequence:
            self._partly = sequence, bytearray()
        data, attachment = self._partly[1], None
        while len(data) < size:
            before = len(data)
            for reply in self._query(sequence, before):
                if not reply.ok:
                    return False
                if not reply.size:
                    self._done = sequence  # it is not kept any more
                    return True
                data += reply.payload
                attachment = reply.attachment
            if len(data) == before:
                return False
        self._done = sequence
        self._partly = 0, bytearray()
        self._receive(FetchedSample(self._topic_key, bytes(data), attachment))
        self._query(sequence, size)
        return True

    def _query(self, sequence: int, offset: int) -> Replies:
        request = _encode(_Request(sequence, offset, self._own))
        return self._session.query(
            self._key, timeout=_TIMEOUT, payload=request, cancel=self._cancel, priority="background"
        )
