"""Subscriptions of a known type."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

from rosz.node.channel import Channel
from rosz.node.endpoint import Endpoint, Withdrawal
from rosz.node.history import ask_for_history
from rosz.node.reader import Reader
from rosz.qos import QoS
from rosz.wire import Kind, Token, format_token, gid

if TYPE_CHECKING:
    from rosz.message import Message
    from rosz.node.node import Node

__all__ = ("Subscription",)

M = TypeVar("M")


class Subscription(Reader[M], Endpoint):
    """A sink of messages of a topic; see `rosz.Node.subscription`.

    Attributes:
        message_type: What is expected.
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
        type_name = message_type._type_name
        Endpoint.__init__(
            self, node, Kind.SUBSCRIPTION, topic, type_name, message_type._type_hash, qos
        )
        qos = self.qos
        Reader.__init__(self, node, topic, callback, qos, with_info=with_info)
        self.message_type = message_type
        self._channel = Channel(
            topic, type_name, None if raw else message_type, node.log, with_info=with_info
        )
        context = node.context
        self._declared.append(
            self._subscribe(
                self.key,
                self._channel.take,
                history=qos.depth if qos.latched else 0,
                recover=qos.latched and qos.reliable,
            )
        )
        self._deliver = partial(self._put, self._channel.take)
        self._declared.append(Withdrawal(context.inbox.open(self.token.entity_id, self._deliver)))
        self.announce()
        if not qos.latched:
            self._declared.append(node.listen(self._follow))

    def _follow(self, publisher: Token, alive: bool) -> None:
        """Ask a latching publisher for what it sent before it knew of this subscription."""
        latched = publisher.qos is not None and publisher.qos.latched
        if alive and latched and self.matches(publisher):
            self._channel.expect_replay(gid(format_token(publisher)))
            ask_for_history(self.node, publisher, self._deliver, self._depth)

    def publishers(self) -> list[Token]:
        """Return the publishers that this subscription hears: same topic, type and hash."""
        view = self.node.context.graph.view()
        return [token for token in view.publishers(self.name) if self.matches(token)]

    def disown(self, reason: str) -> None:
        """Refuse everything from now on, touching neither threads nor links: after a fork."""
        super().disown(reason)
        self._feed.closed = True

    def _finish(self) -> None:
        self._feed.close()
