"""Subscriptions of a topic whatever its type: it is learned from what comes, and from the graph."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Self

from rosz import names
from rosz.errors import DecodeError, RoszError
from rosz.node.channel import Channel, Taken
from rosz.node.endpoint import Endpoint, Withdrawal, definite
from rosz.node.history import ask_for_history
from rosz.node.reader import Reader
from rosz.qos import QoS
from rosz.wire import NO_HASH, Kind, Token, endpoint_key, format_token, gid, ros_type

if TYPE_CHECKING:
    from types import TracebackType

    from rosz.lifecycle import Closable
    from rosz.message import Message
    from rosz.node.node import Node
    from rosz.session import Reply, Sample

__all__ = ("GenericSubscription",)


class GenericSubscription(Reader[Any]):
    """A sink of messages of a topic, of whatever type; see `rosz.Node.subscription`.

    It listens to all types from the start, so nothing is missed. When the graph shows a publisher,
    a subscription of that publisher's type is announced, so that others see who listens.

    Attributes:
        name: Resolved name of the topic.
        closed: Whether it has been closed.
    """

    def __init__(
        self,
        node: Node,
        topic: str,
        callback: Callable[..., Any] | None,
        qos: QoS,
        *,
        raw: bool = False,
        with_info: bool = False,
    ) -> None:
        qos = definite(qos)
        super().__init__(node, topic, callback, qos, with_info=with_info)
        self.node = node
        self.name = topic
        self.qos = qos
        self.closed = False
        self._raw = raw
        # A signal handler may come in between.
        self._closing = threading.RLock()
        self._knowing = threading.RLock()
        self._channels: dict[tuple[str, str], Channel | None] = {}
        self._faces: dict[tuple[str, str], Endpoint] = {}
        self._declared: list[Closable] = []
        node.context.check_open()
        key = endpoint_key(node.context.domain, names.check_resource(topic), "*", "*")
        self._declared.append(self._subscribe(key, self._take))
        self._declared.append(node.listen(self._follow))

    @property
    def types(self) -> list[str]:
        """The types that were seen so far, as ``pkg/msg/Name``, in the order of their coming."""
        return list(dict.fromkeys(name for name, _ in list(self._channels)))

    def publishers(self) -> list[Token]:
        """Return the publishers of the topic."""
        return self.node.context.graph.view().publishers(self.name)

    def _take(self, sample: Sample | Reply) -> Taken | None:
        *_, dds, type_hash = sample.key.split("/")
        try:
            channel = self._channel(ros_type(dds), type_hash)
        except DecodeError:
            return None  # something of Zenoh's below the topic's name, but no sample of the topic
        return None if channel is None else channel.take(sample)

    def _channel(self, type_name: str, type_hash: str) -> Channel | None:
        """Return what decodes a type; ``None`` where that is not possible, which is told once."""
        kind = (type_name, type_hash)
        with self._knowing:
            if kind not in self._channels:
                self._channels[kind] = self._learn(*kind)
            return self._channels[kind]

    def _learn(self, type_name: str, type_hash: str) -> Channel | None:
        log = self.node.log
        if self._raw:
            return Channel(self.name, type_name, None, log)
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
        return Channel(self.name, type_name, message_type, log)

    def _follow(self, publisher: Token, alive: bool) -> None:
        if not alive or publisher.kind is not Kind.PUBLISHER or publisher.name != self.name:
            return
        channel = self._channel(publisher.type_name, publisher.type_hash)
        if channel is None or publisher.qos is None:
            return
        self._show(publisher, channel)
        if publisher.qos.latched:
            channel.expect_replay(gid(format_token(publisher)))
            ask_for_history(self.node, publisher, partial(self._put, channel.take), self._depth)

    def _show(self, publisher: Token, channel: Channel) -> None:
        """Announce a subscription of a publisher's type, with an address of its own."""
        kind = (publisher.type_name, publisher.type_hash)
        if kind in self._faces:
            return
        with self._closing:
            if self.closed:
                return
            face = Endpoint(self.node, Kind.SUBSCRIPTION, self.name, *kind, self.qos)
            inbox = self.node.context.inbox
            deliver = partial(self._put, channel.take)
            face.also_close(Withdrawal(inbox.open(face.token.entity_id, deliver)))
            face.announce(watch=False)
            self._faces[kind] = face

    def close(self) -> None:
        """End it; from any thread, again is no error."""
        with self._closing:
            if self.closed:
                return
            self.closed = True
        self._feed.close()
        for face in self._faces.values():
            face.close()
        if not self.node.context.session.closed:
            for declared in reversed(self._declared):
                declared.close()
        self.node.forget(self)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        types = ", ".join(self.types) or "any type"
        return f"<{type(self).__name__} {self.name} [{types}]{' closed' if self.closed else ''}>"
