"""Publishers: messages to all subscriptions of a topic, or to one of them."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from enum import Enum
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from rosz.errors import ClosedError, EncodeError
from rosz.lifecycle import Registration
from rosz.node.core import NodeCore
from rosz.node.direct_delivery import direct_key
from rosz.node.entity import Entity
from rosz.node.fetch import LARGE, FetchableSamples
from rosz.node.local_delivery import LocalDelivery, LocalReceiver, LocalSample
from rosz.qos import QoS
from rosz.queue import BoundedQueue
from rosz.wire import Kind, Token, pack_attachment
from rosz.worker import Worker

if TYPE_CHECKING:
    from rosz.message import Message

M = TypeVar("M", bound="Message")
_WaitingSample = tuple[int, bytes, bytes]
"""The sequence number, payload and attachment of a sample."""


class _State(Enum):
    """The state of a publisher, which decides what becomes of a sample."""

    HELD = "samples wait until the links are up, or until the subscriptions are known"
    DIRECT = "small samples need nothing but to be published"
    FETCHED = "subscriptions fetch large samples, which small ones must not overtake"
    CLOSED = "the publisher was inherited by a forked child"


_DIRECT = _State.DIRECT  # looked up for each sample, which is slow in the class of an enum

_HELD_SAMPLES = 1000
_HELD_BYTES = 64 << 20
_HEADER = 4
"""Bytes of the header of CDR; a receiver of fewer may abort."""

_UNNUMBERED = 0
"""Sequence number of a message to one subscription alone, so that the others see no gap."""


class SubscriberLink(Generic[M]):
    """One subscription, as a publisher sees it.

    Attributes:
        node: Full name of its node.
    """

    def __init__(self, publisher: Publisher[M], token: Token) -> None:
        self._publisher = publisher
        self._token = token
        self.node: str = token.node_name

    def publish(self, message: M) -> None:
        """Send one message to this subscription alone.

        A subscription outside rosz cannot be reached alone: the message then goes to all.

        Raises:
            EncodeError: A field has a value that does not fit.
            ClosedError: The publisher is closed.
        """
        self._publisher.publish_to(self._token, message)


class Publisher(Entity, Generic[M]):
    """Publish messages on a topic; see `rosz.Node.publisher`.

    Samples published before the process is linked to all its neighbours are held, the newest 1000
    or 64 MB of them, and sent then; see `rosz.session.MeshReadiness`.

    Of large samples, those of more than 32 kB, subscriptions on other machines fetch the newest
    ``queue_size`` in pieces, each at its own pace. When it closes, the publisher waits until they
    have, at most 8 seconds.

    Args:
        node: The node that the publisher belongs to.
        topic: Resolved name of the topic.
        message_type: Class of the messages.
        qos: The QoS that others see.
        waits: Whether a full link makes ``publish`` wait instead of dropping the message, also
            where the QoS keeps only some messages.
        express: Whether each message is sent at once; it may be held for 1 ms otherwise, so that
            several are sent together.
        copies: Whether subscriptions of the same process get copies of the messages.
        number: Number of the publisher within the session; by default one that was never used.
        sequence: Sequence number of the last message of the publisher that had the number before.

    Attributes:
        message_type: The class of the messages.
        dropped: The number of samples that newer ones replaced before a subscription on another
            machine had fetched them.
    """

    def __init__(
        self,
        node: NodeCore,
        topic: str,
        message_type: type[M],
        qos: QoS,
        *,
        waits: bool = False,
        express: bool = False,
        copies: bool = False,
        number: int | None = None,
        sequence: int = 0,
    ) -> None:
        type_name, type_hash = message_type._type_name, message_type._type_hash
        super().__init__(node, Kind.PUBLISHER, topic, type_name, type_hash, qos, number=number)
        qos = self.qos
        self.message_type = message_type
        self._encode: Callable[[Any], bytes] = message_type._encode
        self._sequence = sequence
        self.dropped: int = 0
        # A signal handler that publishes may interrupt this thread while it publishes.
        self._ordered = threading.RLock()
        self._blocks = waits or (qos.reliable and qos.history == "keep_all")
        self._local = node.context.local_delivery
        self._receivers: tuple[LocalReceiver, ...] = ()
        self._receivers_version = -1
        self._copies = copies
        self._latched = qos.latched
        self._has_header = bool(message_type._has_header)
        self._raw = node.context.session.publisher(
            self.key,
            reliable=qos.reliable,
            block=self._blocks,
            express=express,
            cache=qos.depth if qos.latched else 0,
            remote_only=self._local is not None,
        )
        self._put = self._raw.put
        self._fetchable: FetchableSamples | None = None
        if qos.reliable:
            depth = None if self._blocks else qos.depth
            self._fetchable = self.keep(FetchableSamples(self, depth, self._report_dropped))
        self._direct_bytes = sys.maxsize if self._fetchable is None else LARGE
        self._waiting: BoundedQueue[_WaitingSample] = BoundedQueue(_HELD_SAMPLES, _HELD_BYTES)
        linked = node.context.mesh.linked.is_set()
        self._state = _State.DIRECT if linked else _State.HELD
        self.announce()
        if not linked:
            node.context.mesh.when_linked(self._release)

    @property
    def sequence(self) -> int:
        """The sequence number of the last message."""
        return self._sequence

    def publish(self, *args: Any, **fields: Any) -> None:
        """Send a message: one of the topic's type, or the values of its fields.

        Raises:
            EncodeError: A field has a value that does not fit.
            ClosedError: The publisher is closed.
        """
        if len(args) == 1 and not fields and isinstance(args[0], self.message_type):
            message: Any = args[0]
        else:
            message = self._build(args, fields)
        if self._local is None:
            self._send(self._encode(message))
        else:
            self._deliver(self._local, message, None)

    def publish_raw(self, payload: bytes | bytearray | memoryview) -> None:
        """Send an encoded message.

        Args:
            payload: CDR with its header of four bytes; it is not checked against the type.

        Raises:
            EncodeError: The payload is not bytes, or shorter than the header.
            ClosedError: The publisher is closed.
        """
        if type(payload) is not bytes:
            if not isinstance(payload, bytes | bytearray | memoryview):
                given = type(payload).__name__
                raise EncodeError(self.message_type._type, "", f"expected bytes, got {given}")
            # A copy, because the caller could change a mutable buffer while it waits.
            payload = bytes(payload)
        if len(payload) < _HEADER:
            raise EncodeError(
                self.message_type._type,
                "",
                f"expected CDR with its header, got {len(payload)} bytes",
            )
        if self._local is None:
            self._send(payload)
        else:
            self._deliver(self._local, None, payload)

    def _deliver(self, local: LocalDelivery, message: Any, payload: bytes | None) -> None:
        """Give a message to the subscriptions of this process, and send it if others need it."""
        if local.version != self._receivers_version:
            self._find_receivers(local)
        with self._ordered:
            if self._lifecycle.closing:
                self.check_open("publish")
            sent = self._state is not _DIRECT or self._latched or self._raw.matched
            if payload is None and (sent or self._copies):
                payload = self._encode(message)
            if sent and payload is not None:
                self._send(payload)
            else:
                self._sequence += 1
            if self._receivers:
                self._pass_on(message, payload)

    def _pass_on(self, message: Any, payload: bytes | None) -> None:
        """Give the message that has just been numbered to the subscriptions of this process."""
        if self._copies:
            message = None
        elif self._has_header and message is not None:
            message.header.seq = self._sequence
        encoded = payload or self._encode
        now = time.time_ns()
        sample = LocalSample(self.key, self._sequence, now, self.gid, message, encoded)
        for receiver in self._receivers:
            receiver.receive(sample)

    def _find_receivers(self, local: LocalDelivery) -> None:
        self._receivers_version = local.version
        self._receivers = local.find(self.token)
        if self.qos.latched:
            for receiver in self._receivers:
                receiver.expect_replay(self.gid)

    def _send(self, payload: bytes) -> None:
        with self._ordered:
            self._sequence = sequence = self._sequence + 1
            attachment = pack_attachment(sequence, time.time_ns(), self.gid)
            if self._state is _DIRECT and len(payload) <= self._direct_bytes:
                self._put(payload, attachment)
            else:
                self.check_open("publish")
                self._send_with_care(sequence, payload, attachment)

    def _send_with_care(self, sequence: int, payload: bytes, attachment: bytes) -> None:
        """Send a sample that is large, or comes after a large one, or before the links are up."""
        fetchable, small = self._fetchable, len(payload) <= self._direct_bytes
        if self._state is _State.HELD:
            self._hold(sequence, payload, attachment)
        elif fetchable is None or (small and self._state is _DIRECT):
            self._put(payload, attachment)
        elif fetchable.undecided:
            self._state = _State.HELD
            self._hold(sequence, payload, attachment)
            fetchable.when_decided(self._release)
        else:
            needed = fetchable.drop_unneeded()
            self._state = _State.FETCHED if needed else _State.DIRECT
            published = not needed or self.qos.latched or fetchable.to_publish
            if published:
                self._put(payload, attachment)
            if needed:
                fetchable.send(sequence, payload, attachment, published=published)

    def _hold(self, sequence: int, payload: bytes, attachment: bytes) -> None:
        """Hold a sample; the newest are kept where there are too many."""
        for _ in self._waiting.put((sequence, payload, attachment), len(payload)):
            if not self.dropped:
                self.node.log.warning(
                    "dropping messages on '%s': until this process is linked to all others, only"
                    " the newest %d wait, or %d MB (told once)",
                    self.name,
                    _HELD_SAMPLES,
                    _HELD_BYTES >> 20,
                )
            self._count_dropped()

    def _count_dropped(self) -> None:
        self.dropped += 1
        self.node.context.dropped.add(self.token.entity_id, 1)

    def _report_dropped(self, node: str) -> None:
        """Count a sample that newer ones replaced before a node had fetched it."""
        if not self.dropped:
            self.node.log.warning(
                "dropping messages on '%s' for node '%s', which takes them more slowly than they"
                " are published: queue_size=%d (told once)",
                self.name,
                node,
                self.qos.depth,
            )
        self._count_dropped()

    def publish_to(self, subscription: Token, message: M) -> None:
        """Send a message to one subscription alone; see `SubscriberLink.publish`.

        Raises:
            EncodeError: A field has a value that does not fit.
            ClosedError: The publisher is closed.
        """
        self.check_open("publish")
        context = self.node.context
        key = direct_key(subscription)
        if key is None:
            self.publish(message)
            return
        attachment = pack_attachment(_UNNUMBERED, time.time_ns(), self.gid)
        context.session.put(key, self._encode(message), attachment=attachment, block=self._blocks)

    def _build(self, args: tuple[Any, ...], fields: dict[str, Any]) -> Any:
        if len(args) == 1 and getattr(args[0], "_type_hash", "") == self.message_type._type_hash:
            return args[0]  # the same type, compiled elsewhere
        try:
            return self.message_type(*args, **fields)
        except TypeError as error:
            raise EncodeError(
                self.message_type._type,
                "",
                f"{error}; expected a message of that type or its fields,"
                f" got {', '.join(type(a).__name__ for a in args) or 'keywords'}",
            ) from error

    def _release(self) -> None:
        """Send the samples that wait, in order, and hold no more."""
        with self._ordered:
            if self._state is not _State.HELD:
                return
            self._state = _State.DIRECT
            samples = list(self._waiting)
            self._waiting.clear()
            for sample in samples:
                self._send_with_care(*sample)

    def _finish(self) -> None:
        context = self.node.context
        if self._waiting:
            context.mesh.linked.wait(context.HOLD_TIMEOUT)
            self._release()
        if self._waiting and self._fetchable is not None:  # a subscription has just appeared
            decided = threading.Event()
            self._fetchable.when_decided(decided.set)
            decided.wait(context.HOLD_TIMEOUT)
            self._release()
        if self._fetchable is not None:
            for node, count in self._fetchable.flush().items():
                self.node.log.warning(
                    "closed '%s' before node '%s' had received the last %d messages, which its link"
                    " or the node was too slow for",
                    self.name,
                    node,
                    count,
                )
        # Zenoh's handle refuses to be undeclared while another thread is inside its put.
        with self._ordered:
            self._raw.close()

    def subscribers(self) -> list[Token]:
        """Return the subscriptions that this publisher reaches: same topic, type and hash."""
        subscriptions = self.others.view().subscriptions(self.name)
        return [token for token in subscriptions if self.matches(token)]

    @property
    def heard(self) -> bool:
        """Whether anybody may receive what is published now, nodes or other programs of Zenoh.

        Raises:
            ClosedError: The publisher is closed.
        """
        if self._state in {_State.HELD, _State.CLOSED} or self.qos.latched:
            return True
        far = self._fetchable is not None and self._fetchable.drop_unneeded()
        return far or self._raw.matched

    def wait_for_subscribers(self, count: int = 1, timeout: float = 10.0) -> None:
        """Wait until this publisher reaches a number of subscriptions.

        Args:
            count: Number of subscriptions.
            timeout: Time limit in seconds.

        Raises:
            WaitTimeout: There were fewer when the time limit was reached.
            ClosedError: The context was shut down meanwhile.
            UsageError: The timeout is not a number.
        """
        self.others.wait_for(
            lambda view: sum(map(self.matches, view.subscriptions(self.name))) >= count,
            timeout,
            f"{count} subscriber(s) of '{self.name}' with type '{self.token.type_name}'",
        )

    def on_connection(
        self,
        connected: Callable[[SubscriberLink[M]], object] | None = None,
        disconnected: Callable[[str], object] | None = None,
    ) -> None:
        """Call functions as subscriptions come and go, beginning with those that exist.

        They run on a thread of their own, one at a time; what they raise is logged.

        Args:
            connected: Function that gets a link to each new subscription.
            disconnected: Function that gets the full name of the node of each that has gone.

        Raises:
            ClosedError: The publisher is closed.
        """
        self.check_open("follow its subscriptions")

        def report(change: tuple[Token, bool]) -> None:
            token, alive = change
            if self.closed:
                return
            try:
                if alive and connected is not None:
                    connected(SubscriberLink(self, token))
                elif not alive and disconnected is not None:
                    disconnected(token.node_name)
            except BaseException as error:  # noqa: BLE001  # the thread outlives it
                if not (self.closed and isinstance(error, ClosedError)):
                    self.node.log.report(f"connection callback of '{self.name}' failed", error)

        changes = Worker(f"rosz-links{self.name}", report)

        def changed(token: Token, alive: bool) -> None:
            if self.matches(token):
                changes.submit((token, alive))

        self.keep(Registration(lambda: changes.close(0)))
        self.keep(Registration(self.others.listen(changed)))

    def _forked(self) -> None:
        self._ordered = threading.RLock()
        self._state = _State.CLOSED
