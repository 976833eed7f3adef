"""Subscriptions: from Zenoh's samples to a callback, an iterator or `Subscription.get`.

The session keeps live samples and handles them one at a time (`Session.queue_subscriber`): it
passes them to the callback, or to the queue from which `Subscription.get` takes them. A sample is
decoded there, so one that newer ones displace is not decoded. Replays of latching publishers,
directly delivered samples and those of the same process wait beside them, and a second thread is
lent to handle them. Callbacks run one at a time.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

from rosz.errors import ClosedError, DecodeError, RoszError, WaitTimeout
from rosz.lifecycle import Registration
from rosz.node.core import NodeCore
from rosz.node.decoder import AnySample, Received, SampleDecoder, TypeDecoders
from rosz.node.entity import ANY, Entity
from rosz.node.fetch import FetchedSample, Fetcher
from rosz.node.local_delivery import LocalReceiver, LocalSample
from rosz.qos import FOREVER, QoS
from rosz.session import LONGEST_WAIT, Reply, clamp_timeout
from rosz.wire import Kind, Token, entity_key, format_token, gid, read_attachment
from rosz.worker import Serial

if TYPE_CHECKING:
    from rosz.message import Message

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


_Item = tuple[AnySample, SampleDecoder | None]
"""A sample, with its decoder if its key does not tell its type."""


class _History:
    """Passes on the replies of latching publishers from a time on.

    Of what is older it passes on the last sample of each publisher at the end, if that is lasting.
    """

    def __init__(self, receive: Callable[[Reply], None], since: int, *, lasting: bool) -> None:
        self._receive = receive
        self._since = since
        self._lasting = lasting
        self._older: dict[bytes, tuple[int, Reply]] = {}

    def take(self, reply: Reply) -> None:
        sequence, stamp, publisher = 0, self._since, b""
        if self._since and reply.attachment is not None:
            with suppress(DecodeError):  # whoever decodes the sample reports it
                sequence, stamp, publisher = read_attachment(reply.attachment)
        if stamp >= self._since:
            self._receive(reply)
        elif sequence >= self._older.get(publisher, (0, reply))[0]:
            self._older[publisher] = sequence, reply

    def finish(self) -> None:
        for _, reply in self._older.values() if self._lasting else ():
            self._receive(reply)


class _WantedHistory(NamedTuple):
    """The kept samples of latching publishers that a subscription requests.

    Attributes:
        wanted: Whether it requests any.
        since: Time of the oldest sample that it requests, in nanoseconds; 0 for all.
        opened: Time when the subscription was made, in nanoseconds.
    """

    wanted: bool
    since: int
    opened: int

    def start(self, *, lasting: bool) -> int:
        """Return the time of the oldest sample that it requests.

        Args:
            lasting: Whether the samples of the publisher have no lifespan.
        """
        return self.since or (0 if lasting else self.opened)


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
        qos: The depth of the queue, and the requested quality of service.
        raw: Whether to pass on the encoded bytes instead of messages.
        with_info: Whether the callback also gets a `MessageInfo`.
        warn_dropped: Whether the first sample that is dropped is logged.
        fit: Function that returns how many samples of a size in bytes may wait for the callback,
            where these are fewer than the depth; only without a message type.
        history: Whether it gets the kept samples of latching publishers although the QoS is
            volatile. ROS 1 has no durability: there every subscription gets them.
        number: Number of the subscription within the session; by default one that was never used.
        history_from: Time from which on all is received that latching publishers hold, and of what
            is older the last message only; 0 for all.

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
        history: bool = True,
        number: int | None = None,
        history_from: int = 0,
    ) -> None:
        name, type_hash = ANY, ANY
        if message_type is not None:
            name, type_hash = message_type._type_name, message_type._type_hash
        super().__init__(node, Kind.SUBSCRIPTION, topic, name, type_hash, qos, number=number)
        qos = self.qos
        self.message_type = message_type
        self.dropped: int = 0
        self._callback = callback
        self._with_info = with_info
        self._warn_dropped = warn_dropped
        self._history = _WantedHistory(history or qos.latched, history_from, time.time_ns())
        self._depth = _ALL if qos.history == "keep_all" else min(qos.depth, _MOST)
        self._queue = _Queue(self._depth)
        self._unhandled: deque[_Item] = deque(maxlen=self._depth)
        self._serial = Serial(self._handle, keeps_thread=True)
        self._turn = threading.RLock()
        self._until_yield = max(self._depth, _YIELD_AFTER)
        self._decoders = TypeDecoders(self, self._report_lost, raw=raw, with_info=with_info)
        self._decoder: SampleDecoder | None = None
        self._announced: dict[tuple[str, str], Entity] = {}
        if message_type is not None:
            self._decoder = self._decoders.make(name, type_hash, message_type)
        self._open(fit)

    def _open(self, fit: Callable[[int], int] | None) -> None:
        """Begin to receive, and announce the subscription if its type is known."""
        local, decoder = self.node.context.local_delivery, self._decoder
        if local is not None:
            expect_replay = decoder.expect_replay if decoder is not None else lambda _: None
            receiver = LocalReceiver(self.matches, self._receive_message, expect_replay)
            self.keep(local.register(self.name, receiver))
        typed, latched = decoder is not None, self.qos.latched
        self.keep(
            self.node.context.session.queue_subscriber(
                self.key,
                self._depth,
                self._receive if self._callback is None else self._dispatch,
                fit=fit,
                history=self.qos.depth if typed and latched else 0,
                recover=typed and latched and self.qos.reliable,
            )
        )
        if self._decoder is not None:
            self._receive_directly(self, self._decoder)
            self.announce()
        if not typed or (self._history.wanted and not latched):
            self.keep(Registration(self.others.listen(self._follow)))

    @property
    def types(self) -> list[str]:
        """The types received or seen so far, as ``pkg/msg/Name``, in the order of appearance."""
        if self.message_type is not None:
            return [self.token.type_name]
        return self._decoders.types

    def matches(self, token: Token) -> bool:
        """Return whether this subscription receives what a publisher sends."""
        if self.message_type is not None:
            return super().matches(token)
        return token.kind is Kind.PUBLISHER and token.name == self.name

    def publishers(self) -> list[Token]:
        """Return the publishers that this subscription receives from."""
        tokens = self.others.view().publishers(self.name)
        return [token for token in tokens if self.matches(token)]

    # Receiving.

    def _receive(self, sample: AnySample, decoder: SampleDecoder | None = None) -> None:
        """Queue a sample, whose key may tell no type; neither blocks nor raises."""
        if self._callback is not None or _is_ahead(sample, decoder, self._history.opened):
            self._unhandled.append((sample, decoder))
            self._serial.wake()
        else:
            self._queue.put((sample, decoder))

    def _receive_message(self, sample: LocalSample) -> None:
        """Receive a message of this process.

        Python runs one thread at a time, for 5 ms: a publisher that fills the queue within these
        lets the callbacks have their turn, instead of displacing samples that they have not taken.
        """
        self._until_yield -= 1
        if self._until_yield <= 0 and len(self._unhandled or self._queue.items) >= self._depth:
            self._until_yield = max(self._depth, _YIELD_AFTER)
            time.sleep(_YIELD_SECONDS)
        self._receive(sample)

    def _handle(self) -> None:
        """Pass on the replayed and direct samples, each after the live ones before it."""
        while self._unhandled:
            item = self._unhandled.popleft()
            self._await_live(item)
            if self._callback is None:
                self._queue.put(item)
            else:
                self._dispatch(*item)

    def _await_live(self, item: _Item) -> None:
        """Wait for the live samples up to a replayed one that was published since the start."""
        deadline = time.monotonic() + _LIVE_SECONDS
        while _is_ahead(*item, self._history.opened):
            if self._queue.closed or time.monotonic() >= deadline:
                break
            time.sleep(_POLL_SECONDS)

    def _dispatch(self, sample: AnySample, decoder: SampleDecoder | None = None) -> None:
        """Decode a sample, and call the callback with the message."""
        callback = self._callback
        if callback is None or self._queue.closed:
            return
        try:
            with self._turn:
                decoder = decoder or self._decoder or self._decoders.of_sample(sample)
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
            try:
                sample, decoder = self._queue.items.popleft()
            except IndexError:
                return None
            decoder = decoder or self._decoder or self._decoders.of_sample(sample)
            return None if decoder is None else decoder.decode(sample)

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
        """Announce the publisher's type, and request the history of a latching publisher."""
        if not alive or publisher.qos is None or not self.matches(publisher):
            return
        kind = publisher.type_name, publisher.type_hash
        decoder = self._decoder or self._decoders.of_type(*kind)
        if decoder is None:
            return
        if self.message_type is None:
            self._announce(kind, decoder)
        if self._history.wanted and publisher.qos.latched:
            # Samples with a lifespan, such as lines of /rosout, are events: late joiners skip them.
            lasting = publisher.qos.lifespan == FOREVER
            decoder.expect_replay(gid(format_token(publisher)), events=not lasting)
            receive = partial(self._receive, decoder=decoder)
            history = _History(receive, self._history.start(lasting=lasting), lasting=lasting)
            self._request_history(publisher, publisher.qos.depth, history.take, history.finish)

    def _announce(self, kind: tuple[str, str], decoder: SampleDecoder) -> None:
        """Announce a subscription of one type, with a key for direct delivery."""
        if kind in self._announced:
            return
        with suppress(ClosedError):  # the subscription or its context ends
            entity = self.keep(Entity(self.node, Kind.SUBSCRIPTION, self.name, *kind, self.qos))
            self._announced[kind] = entity
            self._receive_directly(entity, decoder)
            entity.announce(watch=False)

    def _receive_directly(self, entity: Entity, decoder: SampleDecoder) -> None:
        """Receive samples for one subscription alone, and large samples in pieces."""
        receive = partial(self._receive, decoder=decoder)

        def received(sample: FetchedSample, publisher: bytes) -> None:
            decoder.expect_replay(publisher)
            receive(sample)

        fetcher = entity.keep(Fetcher(entity, self._depth, received, decoder.last))
        direct = self.node.context.direct_delivery
        entity.keep(direct.register(entity.token.entity_id, receive, fetcher.announced))

    def _request_history(
        self,
        publisher: Token,
        depth: int,
        receive: Callable[[Reply], None],
        finish: Callable[[], None] = lambda: None,
    ) -> None:
        """Request the newest samples in a latching publisher's cache."""
        key = entity_key(publisher.domain, publisher.name, publisher.type_name, publisher.type_hash)
        context = self.node.context
        try:
            context.session.get_async(
                f"{key}/@adv/pub/{publisher.zid}/**",
                lambda reply: receive(reply) if reply.ok else None,
                finish,
                timeout=_HISTORY_TIMEOUT,
                parameters=f"_max={min(depth, self._depth)};_anyke",
                any_key=True,
            )
        except RoszError as error:
            if not context.is_shutdown:
                self.node.log.warning(
                    "no history of '%s' from node '%s': %s", self.name, publisher.node_name, error
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
        history: bool = True,
    ) -> None:
        super().__init__(
            node, topic, None, callback, qos, raw=raw, with_info=with_info, history=history
        )


class _Queue:
    """The newest samples, oldest first, and the threads and event loops that wait for them.

    A lock notifies the waiters: it is locked while no new item has come, and releasing it wakes one
    waiter. A condition takes several times as long, and every sample takes this path.
    A thread that leaves items in the queue, or finds it closed, wakes the next waiter.
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


def _is_ahead(sample: AnySample, decoder: SampleDecoder | None, opened: int) -> bool:
    """Return whether live samples are missing up to a replayed one that is newer than a time."""
    if decoder is None or not isinstance(sample, Reply):
        return False
    try:
        sequence, published, source = read_attachment(sample.attachment or b"")
    except DecodeError:
        return False  # whoever decodes the sample reports it
    return published > opened and decoder.last(source) < sequence
