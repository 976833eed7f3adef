"""Subscriptions: from Zenoh's samples to a callback, an iterator or `Subscription.get`.

`Subscription._receive` puts a sample into the queue of the subscription. A sample is decoded when
it is taken from the queue, so a sample that newer ones displace is not decoded.

With a callback, live samples skip that queue: Zenoh's own ring holds them, and a thread takes them
from there. No Python code runs before a sample is taken, which halves the time from arrival
to callback. Only replays of latching publishers and directly delivered samples use the queue,
which a second thread reads; it starts with the first of them. Callbacks run one at a time.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from rosz.errors import ClosedError, DecodeError, RoszError, WaitTimeout
from rosz.lifecycle import Registration
from rosz.node.core import NodeCore
from rosz.node.decoder import AnySample, Decoder, Received
from rosz.node.entity import ANY, Entity
from rosz.node.fetch import FetchedSample, Fetcher
from rosz.node.local_delivery import LocalReceiver, LocalSample
from rosz.program import within
from rosz.qos import QoS
from rosz.session import LONGEST_WAIT, Reply, clamp_timeout
from rosz.wire import NO_HASH, Kind, Token, entity_key, format_token, gid, read_attachment, ros_type
from rosz.worker import Worker

if TYPE_CHECKING:
    from rosz.message import Message
    from rosz.session import PullSubscriber, Sample

__all__ = ("GenericSubscription", "Subscription")

M = TypeVar("M")

_ALL = 1 << 17
"""Largest depth for keep_all, so that a callback that hangs does not exhaust the memory."""

_MOST = 1 << 20
"""Largest queue: Zenoh allocates 256 bytes for each sample at once, and aborts if it cannot."""

_HISTORY_TIMEOUT = 10.0
_LIVE_SECONDS = 1.0
"""Seconds that a replayed sample waits at most for the live ones that it may overtake."""
_POLL_SECONDS = 0.005
_YIELD_SECONDS = 0.0001
_YIELD_AFTER = 100
"""Messages after which a publisher of the same process yields at most."""


_Item = tuple[AnySample, Decoder | None]
"""A sample, with its decoder if its key does not tell its type."""


class Subscription(Entity, Generic[M]):
    """Receive the messages of a topic; see `rosz.Node.subscription`.

    Without a message type it receives all types from the start, so that nothing is missed. When the
    graph shows a publisher, a subscription of that publisher's type is announced, so that others
    see it.

    Args:
        node: The node that the subscription belongs to.
        topic: Resolved name of the topic.
        message_type: Class of the messages; any type when not given.
        callback: Function that gets each message, and its info if ``with_info``.
        qos: The depth of the queue, and what is asked of publishers.
        raw: Whether to pass on the encoded bytes instead of messages.
        with_info: Whether the callback also gets a `MessageInfo`.
        warn_dropped: Whether the first sample that is dropped is logged.
        fit: Function that returns how many samples of a size in bytes may wait for the callback,
            where these are fewer than the depth; only without a message type.
        number: Number of the subscription within the session; by default one that was never used.

    Attributes:
        message_type: As given.
        dropped: The number of samples that were lost, or pushed out of the queue by newer ones. The
            first is logged, unless the queue holds only one sample or best effort will do.
    """

    def __init__(
        self,
        node: NodeCore,
        topic: str,
        message_type: type[Message] | None,
        callback: Callable[..., Any] | None,
        qos: QoS,
        *,
        raw: bool = False,
        with_info: bool = False,
        warn_dropped: bool = True,
        fit: Callable[[int], int] | None = None,
        number: int | None = None,
    ) -> None:
        name, type_hash = ANY, ANY
        if message_type is not None:
            name, type_hash = message_type._type_name, message_type._type_hash
        super().__init__(node, Kind.SUBSCRIPTION, topic, name, type_hash, qos, number=number)
        qos = self.qos
        self.message_type = message_type
        self.dropped: int = 0
        self._callback = callback
        self._raw = raw
        self._with_info = with_info
        self._warn_dropped = warn_dropped
        self._fit = fit
        self._depth = _ALL if qos.history == "keep_all" else min(qos.depth, _MOST)
        self._queue = _Queue(self._depth)
        self._queue_worker: Worker[_Item] | None = None
        self._turn = threading.RLock()
        self._unyielding = 0
        self._turn_after = max(self._depth, _YIELD_AFTER)
        self._opened = time.time_ns()
        self._learning = threading.RLock()  # a signal handler may come in between
        self._decoder = None
        self._decoders: dict[tuple[str, str], Decoder | None] = {}
        self._announced: dict[tuple[str, str], Entity] = {}
        if message_type is not None:
            self._decoder = self._make_decoder(name, type_hash, None if raw else message_type)
        self._open()

    def _open(self) -> None:
        """Begin to receive, and announce the subscription if its type is known."""
        self._receive_locally()
        typed, latched = self._decoder is not None, self.qos.latched
        self._subscribe(
            history=self.qos.depth if typed and latched else 0,
            recover=typed and latched and self.qos.reliable,
        )
        if self._decoder is not None:
            self._receive_directly(self, self._decoder)
            self.announce()
        if not (typed and latched):
            self.keep(Registration(self.others.listen(self._follow)))

    def _receive_locally(self) -> None:
        """Receive what nodes of this process publish, where that does not use the session."""
        local = self.node.context.local_delivery
        if local is not None:
            receiver = LocalReceiver(self.matches, self._receive_message, self._expect_replay)
            self.keep(local.register(self.name, receiver))

    def _expect_replay(self, publisher: bytes) -> None:
        """Expect samples of a publisher with this subscription's type twice."""
        if self._decoder is not None:
            self._decoder.expect_replay(publisher)

    def _subscribe(self, *, history: int, recover: bool) -> None:
        session = self.node.context.session
        if self._callback is None:
            self.keep(session.subscriber(self.key, self._receive, history=history, recover=recover))
            return
        if self._fit is None:
            ring = session.pull_subscriber(self.key, self._depth, history=history, recover=recover)
        else:
            ring = session.bounded_subscriber(self.key, self._depth, self._fit)
        self.keep(ring)
        Worker(f"rosz-sub{self.name}", self._dispatch, receive=partial(_next_sample, ring))

    @property
    def types(self) -> list[str]:
        """The types received or seen so far, as ``pkg/msg/Name``, in the order of appearance."""
        if self.message_type is not None:
            return [self.token.type_name]
        return list(dict.fromkeys(name for name, _ in list(self._decoders)))

    def matches(self, token: Token) -> bool:
        """Return whether this subscription receives what a publisher sends."""
        if self.message_type is not None:
            return super().matches(token)
        return token.kind is Kind.PUBLISHER and token.name == self.name

    def publishers(self) -> list[Token]:
        """Return the publishers that this subscription receives from."""
        found = self.others.view().publishers(self.name)
        return [token for token in found if self.matches(token)]

    # Receiving.

    def _receive(self, sample: AnySample, decoder: Decoder | None = None) -> None:
        """Put a sample into the queue; called on threads of the session.

        Args:
            sample: The sample.
            decoder: Its decoder, if its key does not tell its type.
        """
        self._queue.put((sample, decoder))
        if self._callback is not None and self._queue_worker is None:
            with self._learning, within(self.node.program):
                if self._queue_worker is None:
                    self._queue_worker = Worker(
                        f"rosz-sub{self.name}",
                        self._dispatch_queued,
                        receive=self._queue.receive,
                    )

    def _receive_message(self, sample: LocalSample) -> None:
        """Put a message of this process into the queue.

        Python runs one thread at a time, for 5 ms: a publisher that fills the queue within these
        lets the callbacks have their turn, instead of displacing what they have not taken.
        """
        self._unyielding += 1
        if self._unyielding >= self._turn_after and len(self._queue.items) >= self._depth:
            self._unyielding = 0
            time.sleep(_YIELD_SECONDS)
        if self._queue_worker is None:
            self._receive(sample)
        else:
            self._queue.put((sample, None))

    def _dispatch_queued(self, item: _Item) -> None:
        """Dispatch an item, and all that have come until there is none."""
        items, dispatch = self._queue.items, self._dispatch
        while True:
            sample, decoder = item
            if decoder is not None and isinstance(sample, Reply):
                self._await_live(sample, decoder)
            dispatch(sample, decoder)
            try:
                item = items.popleft()
            except IndexError:
                return

    def _await_live(self, replayed: Reply, decoder: Decoder) -> None:
        """Wait for the live samples up to a replayed one that was published since the start."""
        try:
            sequence, published, source = read_attachment(replayed.attachment or b"")
        except DecodeError:
            return  # `_dispatch` says what is wrong
        deadline = time.monotonic() + _LIVE_SECONDS
        while published > self._opened and decoder.last(source) < sequence:
            if self._queue.closed or time.monotonic() >= deadline:
                return
            time.sleep(_POLL_SECONDS)

    def _decode(self, sample: AnySample, decoder: Decoder | None) -> Received | None:
        decoder = decoder or self._decoder or self._decoder_of(sample)
        return None if decoder is None else decoder.decode(sample)

    def _dispatch(self, sample: AnySample, decoder: Decoder | None = None) -> None:
        """Decode a sample, and call the callback with the message."""
        callback = self._callback
        if callback is None or self._queue.closed:
            return
        try:
            with self._turn:
                decoder = decoder or self._decoder or self._decoder_of(sample)
                received = None if decoder is None else decoder.decode(sample)
                if received is None:
                    return
                if self._with_info:
                    callback(*received)
                else:
                    callback(received[0])
        except BaseException as error:  # noqa: BLE001  # the thread outlives what a callback raises
            ending = self._queue.closed or self.node.context.is_shutdown
            # A callback may use its node while that is being shut down.
            if not (ending and isinstance(error, ClosedError)):
                self.node.log.report(f"callback of '{self.name}' failed", error)

    def get(self, timeout: float = 10.0) -> M:
        """Return the oldest message of the queue, waiting for one.

        Args:
            timeout: Time limit in seconds.

        Raises:
            WaitTimeout: No message came in time.
            ClosedError: The subscription was closed meanwhile.
            UsageError: The timeout is not a number.
        """
        queue = self._queue
        deadline = time.monotonic() + clamp_timeout(timeout)
        while True:
            while queue.items and not queue.closed:
                received = self._next()
                if received is not None:
                    if queue.items:
                        queue.wake()  # another thread may wait for the rest
                    message: M = received[0]
                    return message
            if queue.closed:
                queue.wake()
                self.check_open("get a message")
            left = deadline - time.monotonic()
            if left <= 0:
                raise WaitTimeout(f"message on '{self.name}'", timeout)
            queue.wait(left)

    def _next(self) -> Received | None:
        """Decode the oldest sample, if there is one."""
        with self._turn:  # decoding counts samples, so they must be decoded in their order
            item = self._queue.pop()
            return None if item is None else self._decode(*item)

    def __iter__(self) -> Iterator[M]:
        """Yield messages until the subscription or its context is closed."""
        self.node.context.cooperative = True
        return self._messages()

    def _messages(self) -> Iterator[M]:
        while True:
            try:
                message = self.get(LONGEST_WAIT)
            except ClosedError:
                return
            yield message

    def __aiter__(self) -> AsyncIterator[M]:
        """Yield messages in an asyncio program until the subscription or its context is closed."""
        self.node.context.cooperative = True
        return self._async_messages()

    async def _async_messages(self) -> AsyncIterator[M]:
        import asyncio  # it takes long to import, and few programs need it

        queue, loop = self._queue, asyncio.get_running_loop()
        arrived = asyncio.Event()

        def wake() -> None:
            try:
                loop.call_soon_threadsafe(arrived.set)
            except RuntimeError:  # the loop has ended
                queue.remove_waker(wake)

        queue.add_waker(wake)
        try:
            while not queue.closed:
                arrived.clear()
                while queue.items and not queue.closed:
                    received = self._next()
                    if received is not None:
                        yield received[0]
                if not queue.closed:
                    await arrived.wait()
        finally:
            queue.remove_waker(wake)

    # Types and latching publishers.

    def _follow(self, publisher: Token, alive: bool) -> None:
        """Announce the publisher's type, and ask a latching one for what it sent before."""
        if not alive or publisher.qos is None or not self.matches(publisher):
            return
        kind = publisher.type_name, publisher.type_hash
        decoder = self._decoder or self._decoder_for(*kind)
        if decoder is None:
            return
        if self.message_type is None:
            self._announce(kind, decoder)
        if publisher.qos.latched:
            decoder.expect_replay(gid(format_token(publisher)))
            receive = partial(self._receive, decoder=decoder)
            self._request_history(publisher, publisher.qos.depth, receive)

    def _announce(self, kind: tuple[str, str], decoder: Decoder) -> None:
        """Announce a subscription of one type, with a key for direct delivery."""
        if kind in self._announced:
            return
        with suppress(ClosedError):  # the subscription or its context ends
            entity = self.keep(Entity(self.node, Kind.SUBSCRIPTION, self.name, *kind, self.qos))
            self._announced[kind] = entity
            self._receive_directly(entity, decoder)
            entity.announce(watch=False)

    def _receive_directly(self, entity: Entity, decoder: Decoder) -> None:
        """Receive what is sent to one subscription alone, and large samples in pieces."""
        receive = partial(self._receive, decoder=decoder)

        def received(sample: FetchedSample, publisher: bytes) -> None:
            decoder.expect_replay(publisher)
            receive(sample)

        fetcher = entity.keep(Fetcher(entity, self._depth, received, decoder.last))
        direct = self.node.context.direct_delivery
        entity.keep(direct.register(entity.token.entity_id, receive, fetcher.announced))

    def _request_history(
        self, publisher: Token, depth: int, receive: Callable[[Reply], None]
    ) -> None:
        """Request the newest samples in a latching publisher's cache."""
        key = entity_key(publisher.domain, publisher.name, publisher.type_name, publisher.type_hash)
        context = self.node.context
        try:
            context.session.get_async(
                f"{key}/@adv/pub/{publisher.zid}/**",
                lambda reply: receive(reply) if reply.ok else None,
                lambda: None,
                timeout=_HISTORY_TIMEOUT,
                parameters=f"_max={min(depth, self._depth)};_anyke",
                any_key=True,
            )
        except RoszError as error:
            if not context.is_shutdown:
                self.node.log.warning(
                    "no history of '%s' from node '%s': %s", self.name, publisher.node_name, error
                )

    def _decoder_of(self, sample: AnySample) -> Decoder | None:
        """Return the decoder for a sample whose key tells its type."""
        *_, dds_name, type_hash = sample.key.split("/")
        try:
            return self._decoder_for(ros_type(dds_name), type_hash)
        except DecodeError:
            return None  # a key of Zenoh itself below the name of the topic

    def _decoder_for(self, type_name: str, type_hash: str) -> Decoder | None:
        """Return the decoder for a type; ``None``, after one warning, if it cannot be decoded."""
        kind = (type_name, type_hash)
        with self._learning:
            if kind not in self._decoders:
                self._decoders[kind] = self._learn(*kind)
            return self._decoders[kind]

    def _learn(self, type_name: str, type_hash: str) -> Decoder | None:
        log = self.node.log
        if self._raw:
            return self._make_decoder(type_name, type_hash, None)
        try:
            message_type: type[Message] = self.node.context.types.message(type_name)
        except RoszError as error:
            log.warning("cannot decode what comes on '%s': %s", self.name, error)
            return None
        if type_hash not in {message_type._type_hash, NO_HASH}:
            log.warning(
                "cannot decode what comes on '%s': its definition of '%s' (%.15s…) is not the one"
                " known here (%.15s…); put the sender's package on ROSZ_PACKAGE_PATH",
                self.name,
                type_name,
                type_hash,
                message_type._type_hash,
            )
            return None
        return self._make_decoder(type_name, type_hash, message_type)

    def _make_decoder(
        self, type_name: str, type_hash: str, message_type: type[Message] | None
    ) -> Decoder:
        return Decoder(
            self.name,
            type_name,
            type_hash,
            None if message_type is None else self.node.context.decoder(message_type),
            self.node.log,
            partial(self._report_lost, (type_name, type_hash)),
            message_type=message_type,
            with_info=self._with_info,
        )

    def _report_lost(self, kind: tuple[str, str], count: int) -> None:
        """Count samples that are missing, and warn of the first."""
        if self._warn_dropped and not self.dropped and self.qos.reliable and self._depth > 1:
            self.node.log.warning(
                "dropping messages on '%s', which come faster than they are taken or than a link"
                " carries them: the newest queue_size=%d wait (told once; rosz topic info counts)",
                self.name,
                self._depth,
            )
        self.dropped += count
        entity = self._announced.get(kind, self)
        self.node.context.dropped.add(entity.token.entity_id, count)

    # The end.

    def _finish(self) -> None:
        self._queue.close()

    def _forked(self) -> None:
        self._queue.closed = True

    def __repr__(self) -> str:
        types = ", ".join(self.types) or "any type"
        return f"<{type(self).__name__} {self.name} [{types}]{' closed' if self.closed else ''}>"


class GenericSubscription(Subscription[Any]):
    """A `Subscription` without a message type."""

    def __init__(
        self,
        node: NodeCore,
        topic: str,
        callback: Callable[..., Any] | None,
        qos: QoS,
        *,
        raw: bool = False,
        with_info: bool = False,
    ) -> None:
        super().__init__(node, topic, None, callback, qos, raw=raw, with_info=with_info)


class _Queue:
    """The newest samples, and the threads and event loops that wait for them.

    A lock notifies the waiters: it is locked while no new item has come, and releasing it wakes one
    waiter. A condition takes several times as long, and every sample takes this path.
    A thread that leaves items in the queue, or finds it closed, wakes the next waiter.

    Args:
        depth: Number of newest samples to keep.

    Attributes:
        items: The samples, oldest first.
        closed: Whether the queue is closed.
    """

    def __init__(self, depth: int) -> None:
        self.items: deque[_Item] = deque(maxlen=depth)
        self.closed = False
        self._notifier = threading.Lock()
        self._notifier.acquire()
        self._wakers: tuple[Callable[[], None], ...] = ()

    def put(self, item: _Item) -> None:
        """Add an item; neither blocks nor raises."""
        self.items.append(item)
        if self._notifier.locked() or self._wakers:
            self.wake()

    def wake(self) -> None:
        """Wake one waiter, and all event loops."""
        if self._notifier.locked():
            # Another thread may wake the waiter between the look and the release.
            with suppress(RuntimeError):
                self._notifier.release()
        for waker in self._wakers:
            waker()

    def wait(self, timeout: float = -1) -> None:
        """Wait until an item was added or the queue was closed since the last wait."""
        self._notifier.acquire(timeout=timeout)

    def pop(self) -> _Item | None:
        """Remove and return the oldest item; ``None`` if there is none."""
        try:
            return self.items.popleft()
        except IndexError:
            return None

    def receive(self) -> _Item | None:
        """Wait for an item and return it; ``None`` when the queue is closed."""
        while not self.closed:
            item = self.pop()
            if item is not None:
                return item
            self.wait()
        self.wake()
        return None

    def add_waker(self, waker: Callable[[], None]) -> None:
        """Call a function whenever an item is added, and when the queue is closed."""
        self._wakers = (*self._wakers, waker)

    def remove_waker(self, waker: Callable[[], None]) -> None:
        """Stop calling a function."""
        self._wakers = tuple(other for other in self._wakers if other is not waker)

    def close(self) -> None:
        """End all waits; a second call has no effect."""
        self.closed = True
        self.wake()


def _next_sample(ring: PullSubscriber) -> Sample | None:
    try:
        return ring.receive()
    except ClosedError:
        return None
