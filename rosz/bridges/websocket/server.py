"""The websocket server: connections, who may open one, and what is written to them."""

from __future__ import annotations

import asyncio
import logging
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Self

import msgspec

from rosz.bridges.listener import Listener, pieces, place
from rosz.bridges.opening import Entrance
from rosz.bridges.tasks import task_worker
from rosz.bridges.websocket.actions import Gateways
from rosz.bridges.websocket.connection import Connection, Shared
from rosz.bridges.websocket.operations import fragments, png
from rosz.bridges.websocket.outbox import Encodings, Message, Outbox
from rosz.bridges.websocket.plain import Spelling
from rosz.bridges.websocket.rosapi import RosApi
from rosz.bridges.websocket.topics import Topics
from rosz.errors import RoszError
from rosz.lifecycle import Lifecycle
from rosz.transforms import Republisher

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request

    from rosz.node import Node

__all__ = ("PORT", "Limits", "WebsocketBridge")

PORT = 9090
"""Port of rosbridge."""

_ENCODED_HERE = 16384
"""Bytes of a message that the thread of the server encodes itself."""
_POLICY = 1008
_LATE = "the password is missing"  # what a client is told


class Limits(msgspec.Struct, frozen=True):
    """Limits on the number of clients and on their messages.

    Attributes:
        clients: Largest number of clients.
        waiting: Bytes that wait for a client; the oldest messages give way to newer ones.
        encoded: Bytes of encodings that are kept since several clients need them.
        operation: Largest size of an operation that a client sends, in bytes.
        password: Largest size of the first operation of a client that has no password yet.
        password_seconds: Time that such a client has, in seconds.
        fragment_size: Largest number of characters of a text that clients get whole; None for any.
    """

    clients: int = 500
    waiting: int = 16 << 20
    encoded: int = 64 << 20
    operation: int = 64 << 20
    password: int = 4096
    password_seconds: float = 10.0
    fragment_size: int | None = None


class WebsocketBridge:
    """A server of the rosbridge protocol, whose clients take part in the network of a node.

    Args:
        node: The node. It is not closed with the bridge.
        port: Port to listen at; 0 for any.
        entrance: Where clients connect, who may do so, and what they may do.
        spelling: Whose names of types and fields a client gets that has not shown its own.
        limits: Limits on the number of clients and on their messages.

    Attributes:
        port: Port that it listens at.

    Raises:
        TransportError: It cannot listen there.
        UsageError: The library is not installed.
    """

    def __init__(
        self,
        node: Node,
        port: int = PORT,
        *,
        entrance: Entrance = Entrance(),  # noqa: B008  # frozen
        spelling: Spelling = "ros1",
        limits: Limits = Limits(),  # noqa: B008  # frozen
    ) -> None:
        self._log: logging.Logger = node.log
        gate, admission, access = entrance.gate, entrance.admission, entrance.access
        self._admission = admission
        self._limits = limits
        self._lifecycle = Lifecycle("the websocket bridge")
        topics = Topics(node, Encodings(limits.encoded))
        self._shared = Shared(
            node,
            gate,
            topics,
            Gateways(node),
            RosApi(node),
            self._lifecycle.keep(task_worker("rosz-calls")),
            spelling,
            admission.password,
        )
        self._republishing = threading.Lock()
        self._republisher: Republisher | None = None
        self._listener = self._lifecycle.keep(
            Listener(
                "websocket", node.log, admission, limits.clients, self._serve, accept=self._accept
            )
        )
        try:
            self._listener.open(access.host, port, access.tls)
        except BaseException:
            self.close()
            raise
        self.port: int = self._listener.port

    def _accept(self, connection: ServerConnection, request: Request) -> str:
        limits = self._limits
        known = self._admission.is_known(request)
        connection.protocol.max_message_size = limits.operation if known else limits.password
        return ""

    async def _serve(self, websocket: ServerConnection) -> None:
        from websockets.exceptions import ConnectionClosed

        loop, wanted = self._listener.loop, asyncio.Event()

        def wake() -> None:
            with suppress(RuntimeError):  # the loop is closed
                loop.call_soon_threadsafe(wanted.set)

        def refuse(reason: str) -> None:
            with suppress(RuntimeError):
                asyncio.run_coroutine_threadsafe(websocket.close(_POLICY, reason), loop)

        outbox = Outbox(
            self._limits.waiting, wake, lambda: refuse("answers wait that the client does not read")
        )
        await self._listener.run(self._republish)
        trusted = self._admission.is_known(websocket.request)
        connection = Connection(
            self._shared,
            outbox,
            place(websocket),
            refuse,
            trusted=trusted,
            limit=self._limits.operation,
            fragment_size=self._limits.fragment_size,
        )

        def check_trust() -> None:
            if not connection.trusted:
                refuse(_LATE)

        sender = asyncio.ensure_future(self._send(websocket, outbox, wanted))
        late = loop.call_later(self._limits.password_seconds, check_trust)
        try:
            async for text in websocket:
                await self._listener.run(connection.handle, text)
                if connection.trusted:
                    websocket.protocol.max_message_size = self._limits.operation
        except (ConnectionClosed, RuntimeError):  # the listener has been closed
            pass
        finally:
            sender.cancel()
            late.cancel()
            with suppress(RuntimeError):
                await self._listener.run(connection.close)

    def _republish(self) -> None:
        """Serve transforms to pages from the first client on, unless a node does so."""
        with self._republishing:
            if self._republisher is None and not Republisher.is_served(self._shared.node):
                self._republisher = Republisher(self._shared.node)

    async def _send(
        self, websocket: ServerConnection, outbox: Outbox, wanted: asyncio.Event
    ) -> None:
        from websockets.exceptions import ConnectionClosed

        numbers = 0
        with suppress(ConnectionClosed):
            while True:
                wanted.clear()
                item, feed, delay = outbox.next()
                if item is None:
                    with suppress(TimeoutError):
                        await asyncio.wait_for(wanted.wait(), min(delay, 3600.0))
                elif isinstance(item, bytes):
                    await websocket.send(pieces(item), text=True)
                elif feed is not None:
                    numbers += 1
                    for frame in await self._encode(item, feed, numbers):
                        await websocket.send(
                            pieces(frame), text=not feed.form[0].startswith("cbor")
                        )

    async def _encode(self, message: Message, feed: Any, number: int) -> list[bytes]:
        """Return the frames of a message; none if it cannot be encoded."""

        def encode() -> list[bytes]:
            compression = feed.form[0]
            data = message.encode(("none", feed.form[1]) if compression == "png" else feed.form)
            if compression == "png":
                data = png(data)
            if compression.startswith("cbor"):
                return [data]
            size = feed.fragment_size or self._limits.fragment_size
            return list(fragments(data, size, number))

        try:
            if message.size <= _ENCODED_HERE and feed.form[0] != "png":
                return encode()
            return await self._listener.run(encode)
        except (RoszError, ImportError) as error:
            self._log.warning("cannot send a message to a client: %s", error)
            return []

    # The end.

    @property
    def clients(self) -> int:
        """Number of clients that are connected."""
        return self._listener.clients

    def close(self) -> None:
        """End the bridge and all connections; a second call has no effect."""
        self._lifecycle.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()
