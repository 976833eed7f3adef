"""The server of the rosbridge protocol, and its settings."""

from __future__ import annotations

import asyncio
import threading
from functools import partial
from typing import TYPE_CHECKING

from rosz.access import ServerAccess
from rosz.bridges import clients
from rosz.bridges.rosbridge.client import RosbridgeClient
from rosz.bridges.rosbridge.encoded import EncodedMessage, Encodings, SubscribedQueue
from rosz.bridges.rosbridge.operations import fragments, png
from rosz.bridges.rosbridge.plain import Spelling
from rosz.bridges.rosbridge.rosapi import RosApi
from rosz.bridges.rosbridge.state import Gateways, RosbridgeLimits, RosbridgeResources
from rosz.errors import RoszError
from rosz.lifecycle import Lifecycle
from rosz.transforms import Republisher

if TYPE_CHECKING:
    from collections.abc import Callable

    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request

    from rosz.node import Node

PORT = 9090
"""Port of rosbridge."""

_HOLDER = "websocket"
"""Name of the clients in the access rules of a machine."""
_ENCODED_HERE = 16384
"""Largest message, in bytes, that is encoded on the thread of the server."""
_LATE = "the password is missing"  # text for the client


class RosbridgeSettings(clients.BridgeSettings, frozen=True, kw_only=True):
    """Settings of a bridge.

    Attributes:
        spelling: Spelling of names for a client until it uses its own spelling.
        fragment_size: Largest number of characters that are sent in one piece; None for no limit.
    """

    port: int = PORT
    spelling: Spelling = "ros1"
    fragment_size: int | None = None


class WebsocketBridge(clients.WebsocketServer[RosbridgeClient, EncodedMessage]):
    """A server of the rosbridge protocol, whose clients take part in the network of a node.

    Args:
        node: The node. It is not closed with the bridge.
        port: Port to listen at; 0 for any.
        access: Address of the server, and access policy of its clients.
        spelling: Spelling of types and fields for a client until it uses its own spelling.
        limits: Limits on the number of clients and on their messages.

    Raises:
        TransportError: The server cannot listen at the address.
        UsageError: The library websockets is not installed.
    """

    def __init__(
        self,
        node: Node,
        port: int = PORT,
        *,
        access: ServerAccess = ServerAccess(),  # noqa: B008  # frozen
        spelling: Spelling = "ros1",
        limits: RosbridgeLimits = RosbridgeLimits(),  # noqa: B008  # frozen
    ) -> None:
        self._limits = limits
        lifecycle = Lifecycle("the websocket bridge")
        self._shared = RosbridgeResources(
            node,
            access.policy,
            clients.ClientTopics(node, partial(EncodedMessage, Encodings(limits.encoded))),
            Gateways(node),
            RosApi(node),
            lifecycle.keep(clients.task_worker("rosz-calls")),
            spelling,
            limits,
        )
        self._republishing = threading.Lock()
        self._republisher: Republisher | None = None
        super().__init__("websocket", node, port, access, limits, lifecycle)

    def _objection(self, connection: ServerConnection, request: Request) -> str:
        limits = self._limits
        authenticated = self._policy.is_authenticated(request)
        connection.protocol.max_message_size = (
            limits.operation if authenticated else limits.password
        )
        return ""

    def _client(
        self,
        websocket: ServerConnection,
        queue: clients.OutgoingQueue[EncodedMessage],
        refuse: Callable[[str], None],
    ) -> RosbridgeClient:
        trusted = self._policy.is_authenticated(websocket.request)
        name, pause = (
            clients.place(websocket),
            partial(self._guesses.pause, clients.host_of(websocket)),
        )
        return RosbridgeClient(self._shared, queue, name, refuse, pause, trusted=trusted)

    async def _receive(self, websocket: ServerConnection, client: RosbridgeClient) -> None:
        await self._run(self._republish)

        def refuse_untrusted() -> None:
            if not client.trusted:
                client.refuse(_LATE)

        loop = asyncio.get_running_loop()
        timer = loop.call_later(self._limits.password_seconds, refuse_untrusted)
        try:
            async for text in websocket:
                await self._run(client.handle, text)
                if client.trusted:
                    websocket.protocol.max_message_size = self._limits.operation
        finally:
            timer.cancel()

    def _republish(self) -> None:
        """Serve transforms to web pages once a client has connected, unless a node does so."""
        with self._republishing:
            if self._republisher is None and not Republisher.is_served(self._shared.node):
                self._republisher = Republisher(self._shared.node)

    async def _write_answer(
        self, websocket: ServerConnection, _client: RosbridgeClient, answer: bytes
    ) -> None:
        await websocket.send(clients.pieces(answer), text=True)

    async def _write_message(
        self,
        websocket: ServerConnection,
        client: RosbridgeClient,
        message: EncodedMessage,
        topic: clients.TopicQueue[EncodedMessage],
    ) -> None:
        assert isinstance(topic, SubscribedQueue)  # noqa: S101  # clients subscribe with no other class
        number = next(client.message_numbers)
        for frame in await self._encode(message, topic, number):
            await websocket.send(clients.pieces(frame), text=not topic.form[0].startswith("cbor"))

    async def _encode(
        self, message: EncodedMessage, topic: SubscribedQueue, number: int
    ) -> list[bytes]:
        """Return the frames of a message; empty if it cannot be encoded."""

        def encode() -> list[bytes]:
            compression = topic.form[0]
            data = message.encode(("none", topic.form[1]) if compression == "png" else topic.form)
            if compression == "png":
                data = png(data)
            if compression.startswith("cbor"):
                return [data]
            size = topic.fragment_size or self._limits.fragment_size
            return list(fragments(data, size, number))

        try:
            if message.size <= _ENCODED_HERE and topic.form[0] != "png":
                return encode()
            return await self._run(encode)
        except (RoszError, ImportError) as error:
            self._log.warning("cannot send a message to a client: %s", error)
            return []


def open_bridge(node: Node, settings: RosbridgeSettings) -> tuple[WebsocketBridge, list[str]]:
    """Return a bridge, and lines of text with its address.

    Args:
        node: Node of the bridge.
        settings: The settings.

    Raises:
        TransportError: The server cannot listen at the address.
        UsageError: A setting is not valid, or the library websockets is not installed.
    """
    access = settings.open_access(node, _HOLDER)
    bridge = WebsocketBridge(
        node,
        settings.port,
        access=access,
        spelling=settings.spelling,
        limits=RosbridgeLimits(fragment_size=settings.fragment_size),
    )
    address, *more = access.describe("ws", bridge.port)
    return bridge, [f"rosbridge clients connect to {address}", *more]
