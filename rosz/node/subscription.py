"""Subscriptions: a ring of the newest samples, and a thread that decodes and calls back.

With a callback the ring is Zenoh's own, which Python takes part in only when a sample's turn comes:
from arrival to callback takes half the time of a ring in Python. What does not come through it,
such as the history of latching publishers, has a ring and a thread here; callbacks take turns.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import msgspec

from rosz.errors import ClosedError, DecodeError, RoszError, WaitTimeout
from rosz.node.endpoint import Endpoint, Withdrawal
from rosz.qos import QoS
from rosz.wire import Kind, Token, unpack

if TYPE_CHECKING:
    from rosz.message import Message
    from rosz.node.node import Node
    from rosz.session import Reply, Ring, Sample

__all__ = ("MessageInfo", "Subscription")

M = TypeVar("M")
_HISTORY_TIMEOUT = 10.0
_KINDS_OF_DAMAGE = 10


class MessageInfo(msgspec.Struct, frozen=True):
    """Where a message comes from.

    Attributes:
        source_time: Nanoseconds since the Unix epoch when it was published, by the sender's clock;
            0 where unknown.
        reception_time: Nanoseconds since the Unix epoch when it was dispatched here.
        sequence: Number within its publisher, from 1; 0 where unknown.
        gid: 16 bytes that identify the publisher; empty where unknown.
        lost: Samples of that publisher missing right before this one: lost, or pushed out of the
            queue by newer ones.
    """

    source_time: int
    reception_time: int
    sequence: int
    gid: bytes
    lost: int


_UNKNOWN = MessageInfo(0, 0, 0, b"", 0)


class Subscription(Endpoint, Generic[M]):
    """A sink of messages of a topic; see `rosz.Node.subscription`.

    With a callback, a thread of its own dispatches. Without one, whoever iterates or calls `get`
    does. Samples are decoded when their turn comes, so those that newer ones push out cost nothing.
    """

    def __init__(
        self,
        node: Node,
        topic: str,
        message_type: type[Message],
        callback: Callable[..., Any] | None,
        qos: QoS,
        *,
        raw: bool = False,
        with_info: bool = False,
    ) -> None:
        super().__init__(
            node, Kind.SUBSCRIPTION, topic, message_type._type_name, message_type._type_hash, qos
        )
        self.message_type = message_type
        self._decode: Callable[[bytes], Any] | None = None if raw else message_type._decode
        self._fill_seq = not raw and message_type._has_header
        self._callback = callback
        self._with_info = with_info
        depth = None if qos.history == "keep_all" else max(qos.depth, 1)
        self._ring: deque[Sample | Reply] = deque(maxlen=depth)
        self._wake = threading.Lock()
        self._wake.acquire()
        self._asked: set[str] = set()
        self._latched: set[bytes] = set()
        self._last: dict[bytes, int] = {}
        self._reported: set[str] = set()
        self._async_wake: Callable[[], None] | None = None
        self._turn = threading.Lock()
        self._side: threading.Thread | None = None
        session = node.context.session
        history = qos.depth if qos.latched else 0
        recover = qos.latched and qos.reliable
        source: Ring | None = None
        if callback is None or depth is None:
            self._declared.append(
                session.subscriber(self.key, self.deliver, history=history, recover=recover)
            )
        else:
            source = session.ring(self.key, depth, history=history, recover=recover)
            self._declared.append(source)
        self._declared.append(
            Withdrawal(node.context.open_inbox(self.token.entity_id, self.deliver))
        )
        self._announce()
        if not qos.latched:
            self._declared.append(node.listen(self._look_for_history))
        if source is not None:
            threading.Thread(
                target=self._run_ring, args=(source,), name=f"rosz-sub{topic}", daemon=True
            ).start()

    def deliver(self, sample: Sample | Reply) -> None:
        """Take a sample in that does not come through Zenoh's own ring; called on its thread."""
        self._ring.append(sample)
        if self._callback is not None and self._side is None:
            self._side = threading.Thread(
                target=self._run, name=f"rosz-sub{self.name}", daemon=True
            )
            self._side.start()
        self._signal()

    def _run_ring(self, source: Ring) -> None:
        while not self.closed:
            try:
                sample = source.take()
            except ClosedError:
                return
            with self._turn:
                self._dispatch(sample)

    def _signal(self) -> None:
        if self._wake.locked():
            # Another thread may wake the dispatcher between the look and the release.
            with suppress(RuntimeError):
                self._wake.release()
        if self._async_wake is not None:
            self._async_wake()

    def _run(self) -> None:
        while not self.closed:
            self._wake.acquire()
            while not self.closed:
                try:
                    sample = self._ring.popleft()
                except IndexError:
                    break
                with self._turn:
                    self._dispatch(sample)

    def _dispatch(self, sample: Sample | Reply) -> None:
        taken = self._take(sample)
        if taken is None or self._callback is None:
            return
        message, info = taken
        try:
            if self._with_info:
                self._callback(message, info)
            else:
                self._callback(message)
        except Exception:  # the callback boundary
            self.node.log.exception("callback of '%s' failed", self.name)

    def _take(self, sample: Sample | Reply) -> tuple[Any, MessageInfo] | None:
        """Decode one sample; ``None`` when it is damaged or was seen already."""
        try:
            info = self._origin(sample.attachment)
            if info is None:
                return None
            payload = sample.payload
            message = payload if self._decode is None else self._decode(payload)
        except DecodeError as error:
            self._complain(error)
            return None
        if self._fill_seq:
            _number(message, info.sequence)
        return message, info

    def _origin(self, attachment: bytes | None) -> MessageInfo | None:
        """Read the attachment, and count what is missing; ``None`` for a sample seen before."""
        if attachment is None:
            return _UNKNOWN
        origin = unpack(attachment)
        gid, sequence = origin.gid, origin.sequence
        last = self._last.get(gid)
        lost = 0
        if last is not None:
            if sequence <= last and gid in self._latched:
                return None
            lost = max(sequence - last - 1, 0)
        self._last[gid] = sequence
        return MessageInfo(origin.source_time, time.time_ns(), sequence, gid, lost)

    def _complain(self, error: DecodeError) -> None:
        """Log damage once per kind, so that a broken sender does not fill the disk."""
        if error.reason not in self._reported and len(self._reported) < _KINDS_OF_DAMAGE:
            self._reported.add(error.reason)
            self.node.log.warning(
                "dropping damaged samples on '%s' (told once): %s", self.name, error
            )

    def _look_for_history(self, token: Token, alive: bool) -> None:
        """Fetch what a latching publisher sent before this subscription was known to it."""
        if not (alive and self.hears(token) and token.qos is not None and token.qos.latched):
            return
        from rosz.wire import format_token, gid

        self._latched.add(gid(format_token(token)))
        count = min(token.qos.depth, self._ring.maxlen or token.qos.depth)
        try:
            self.node.context.session.get_async(
                f"{self.key}/@adv/pub/{token.zid}/**",
                self._deliver_history,
                lambda: None,
                timeout=_HISTORY_TIMEOUT,
                parameters=f"_max={count};_anyke",
                any_key=True,
            )
        except RoszError as error:
            if not self.closed:
                self.node.log.warning(
                    "no history of '%s' from node '%s': %s", self.name, token.node_name, error
                )

    def _deliver_history(self, reply: Reply) -> None:
        if reply.ok:
            self.deliver(reply)

    def hears(self, token: Token) -> bool:
        """Tell whether what a publisher sends arrives here."""
        return (
            token.kind is Kind.PUBLISHER
            and token.name == self.name
            and token.type_name == self.token.type_name
            and token.type_hash == self.token.type_hash
        )

    def publishers(self) -> list[Token]:
        """Return the publishers that this subscription hears."""
        view = self.node.context.graph.view()
        return [token for token in view.publishers(self.name) if self.hears(token)]

    def get(self, timeout: float = 10.0) -> M:
        """Return the oldest message of the queue, waiting for one.

        Args:
            timeout: Seconds.

        Raises:
            WaitTimeout: None came in time.
            ClosedError: The subscription was closed meanwhile.
        """
        deadline = time.monotonic() + timeout
        while True:
            try:
                taken = self._take(self._ring.popleft())
            except IndexError:
                left = deadline - time.monotonic()
                if self.closed:
                    raise ClosedError(f"the subscription of '{self.name}' is closed") from None
                if left <= 0:
                    raise WaitTimeout(f"message on '{self.name}'", timeout) from None
                self._wake.acquire(timeout=left)
                continue
            if taken is not None:
                message: M = taken[0]
                return message

    def __iter__(self) -> Iterator[M]:
        """Yield messages until the subscription or its context is closed."""
        while True:
            try:
                yield self.get(_FOREVER)
            except ClosedError:
                return

    async def __aiter__(self) -> AsyncIterator[M]:
        """Yield messages in an asyncio program until the subscription or its context is closed."""
        import asyncio

        loop = asyncio.get_running_loop()
        arrived = asyncio.Event()

        def wake() -> None:
            if not loop.is_closed():
                loop.call_soon_threadsafe(arrived.set)

        self._async_wake = wake
        try:
            while not self.closed:
                arrived.clear()
                while self._ring:
                    taken = self._take(self._ring.popleft())
                    if taken is not None:
                        yield taken[0]
                if not self._ring and not self.closed:
                    await arrived.wait()
        finally:
            self._async_wake = None

    def _finish(self) -> None:
        self.closed = True
        self._signal()


_FOREVER = threading.TIMEOUT_MAX / 2


def _number(message: Any, sequence: int) -> None:
    """Give a header the sequence number that ROS 1 code reads from it."""
    message.header.seq = sequence
