"""Publishers."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from rosz.errors import ClosedError, EncodeError
from rosz.node.endpoint import Endpoint, Withdrawal
from rosz.node.inbox import address
from rosz.node.pool import Jobs, Pool
from rosz.qos import QoS
from rosz.wire import Kind, Token, pack

if TYPE_CHECKING:
    from rosz.message import Message
    from rosz.node.node import Node

__all__ = ("Publisher", "SubscriberLink")

M = TypeVar("M", bound="Message")
_HELD_SAMPLES = 1000
_HEADER = 4
"""Bytes of the header of CDR; who gets fewer may abort."""

_UNNUMBERED = 0
"""Sequence number of what goes to one subscription alone, and leaves no gap for the others."""


class SubscriberLink(Generic[M]):
    """One subscription, as the publisher sees it.

    Attributes:
        node: Full name of its node.
        publish: Sends one message to it alone. A subscription that is not of rosz has no address
            of its own, and the message goes to all.
    """

    def __init__(self, publisher: Publisher[M], token: Token) -> None:
        self._publisher = publisher
        self._token = token
        self.node = token.node_name

    def publish(self, message: M) -> None:
        """Send one message to this subscription.

        Raises:
            EncodeError: A field has a value that does not fit.
            ClosedError: The publisher is closed.
        """
        self._publisher.publish_to(self._token, message)


class Publisher(Endpoint, Generic[M]):
    """A source of messages on a topic; see `rosz.Node.publisher`.

    What is published before the process is linked to all its neighbours is held, at most 1000
    samples for at most two seconds, and sent when it is.
    """

    def __init__(self, node: Node, topic: str, message_type: type[M], qos: QoS) -> None:
        super().__init__(
            node, Kind.PUBLISHER, topic, message_type._type_name, message_type._type_hash, qos
        )
        qos = self.qos
        self.message_type = message_type
        self._encode: Callable[[Any], bytes] = message_type._encode
        self._sequence = 0
        # A signal handler that publishes may interrupt this thread while it publishes.
        self._ordered = threading.RLock()
        self._blocks = qos.reliable and qos.history == "keep_all"
        self._raw = node.context.session.publisher(
            self.key,
            reliable=qos.reliable,
            block=self._blocks,
            cache=qos.depth if qos.latched else 0,
        )
        self._put = self._raw.put
        self._held: list[tuple[bytes, bytes]] | None = None if node.context.settled.is_set() else []
        self.announce()
        if self._held is not None:
            node.context.when_settled(self._release)

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
        self._send(self._encode(message))

    def publish_raw(self, payload: bytes | bytearray | memoryview) -> None:
        """Send a message that is encoded already.

        Args:
            payload: CDR with its header of four bytes; whether it fits the type is not looked at.

        Raises:
            EncodeError: It is no bytes, or fewer than the header has.
            ClosedError: The publisher is closed.
        """
        if not isinstance(payload, bytes | bytearray | memoryview):
            given = type(payload).__name__
            raise EncodeError(self.message_type._type, "", f"expected bytes, got {given}")
        # A copy, where others could change it while it waits; and what ROS 2 would choke on.
        data = bytes(payload)
        if len(data) < _HEADER:
            raise EncodeError(
                self.message_type._type, "", f"expected CDR with its header, got {len(data)} bytes"
            )
        self._send(data)

    def _send(self, payload: bytes) -> None:
        with self._ordered:
            self._sequence = sequence = self._sequence + 1
            attachment = pack(sequence, time.time_ns(), self.gid)
            if self._held is None:
                self._put(payload, attachment)
                return
            self.ensure_open("publish on")
            self._held.append((payload, attachment))
            del self._held[:-_HELD_SAMPLES]

    def publish_to(self, subscription: Token, message: M) -> None:
        """Send a message to one subscription, where that has an address of its own.

        Raises:
            EncodeError: A field has a value that does not fit.
            ClosedError: The publisher is closed.
        """
        self.ensure_open("publish on")
        context = self.node.context
        to_it_alone = address(subscription, context.graph.view())
        if to_it_alone is None:
            self.publish(message)
            return
        attachment = pack(_UNNUMBERED, time.time_ns(), self.gid)
        context.session.put(
            to_it_alone, self._encode(message), attachment=attachment, block=self._blocks
        )

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
        """Send what was held, in order, and hold no more."""
        with self._ordered:
            held, self._held = self._held, None
            for payload, attachment in held or ():
                self._put(payload, attachment)

    def _finish(self) -> None:
        context = self.node.context
        if self._held:
            context.settled.wait(context.SETTLED_BY)
        if self._held is not None:
            self._release()
        # Zenoh's handle refuses to be undeclared while another thread is inside its put.
        with self._ordered:
            self._raw.close()

    def subscribers(self) -> list[Token]:
        """Return the subscriptions that this publisher reaches: same topic, type and hash."""
        view = self.node.context.graph.view()
        return [token for token in view.subscriptions(self.name) if self.matches(token)]

    def wait_for_subscribers(self, count: int = 1, timeout: float = 10.0) -> None:
        """Wait until at least so many subscriptions are reached.

        Args:
            count: How many.
            timeout: Seconds.

        Raises:
            WaitTimeout: There were fewer when the time was over.
            ClosedError: The context was shut down meanwhile.
            UsageError: The timeout is no number.
        """
        self.node.context.graph.wait_for(
            lambda view: sum(map(self.matches, view.subscriptions(self.name))) >= count,
            timeout,
            f"{count} subscriber(s) of '{self.name}' with type '{self.token.type_name}'",
        )

    def on_connection(
        self,
        connected: Callable[[SubscriberLink[M]], object] | None = None,
        disconnected: Callable[[str], object] | None = None,
    ) -> None:
        """Have subscriptions told as they come and go, those that exist already first.

        Both run on a thread of their own, one at a time; what they raise is logged.

        Args:
            connected: Gets the link, whose ``publish`` reaches that subscription alone.
            disconnected: Gets the full name of the node.

        Raises:
            ClosedError: The publisher is closed.
        """
        self.ensure_open("follow the links of")

        def tell(change: tuple[Token, bool]) -> None:
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

        changes: Jobs[tuple[Token, bool]] = Jobs()
        Pool(1, f"rosz-links{self.name}", changes.take, tell)

        def changed(token: Token, alive: bool) -> None:
            if self.matches(token):
                changes.put((token, alive))

        self.also_close(Withdrawal(changes.close))
        self.also_close(self.node.listen(changed))

    def disown(self, reason: str) -> None:
        """Refuse everything from now on, touching neither threads nor links: after a fork."""
        super().disown(reason)
        self._ordered = threading.RLock()
        self._held = []
