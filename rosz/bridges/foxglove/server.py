"""The server of the Foxglove protocol, and its settings."""

from __future__ import annotations

import re
import time
from typing import TYPE_CHECKING

import msgspec

from rosz.access import ServerAccess
from rosz.bridges import clients
from rosz.bridges.assets import SHOWN, Assets
from rosz.bridges.foxglove.catalog import NetworkCatalog
from rosz.bridges.foxglove.client import (
    CAPABILITIES,
    CalledServices,
    FoxgloveClient,
    FoxgloveLimits,
    FoxgloveResources,
)
from rosz.bridges.foxglove.parameters import ClientParameters
from rosz.bridges.foxglove.protocol import SUBPROTOCOLS
from rosz.errors import RoszError
from rosz.lifecycle import Lifecycle

if TYPE_CHECKING:
    from collections.abc import Callable

    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request

    from rosz.node import Node

PORT = 8765
"""Port of foxglove_bridge."""

_HOLDER = "foxglove"
"""Name of the clients in the rules of a machine."""

_APPS = ("https://app.foxglove.dev", "https://app.foxglove.com")
"""Origins of Foxglove in a browser; the Foxglove program has the origin of files, ``file://``."""


class Offer(msgspec.Struct, frozen=True):
    """Features and files that a bridge offers; permissions may restrict them further.

    Attributes:
        capabilities: Features, in the words of the protocol.
        hidden: Whether topics and services with a part that begins with ``_`` are shown.
        assets: Patterns of the URIs of files that clients may fetch.
    """

    capabilities: tuple[str, ...] = CAPABILITIES
    hidden: bool = False
    assets: tuple[re.Pattern[str], ...] = SHOWN


class FoxgloveSettings(clients.BridgeSettings, frozen=True, kw_only=True):
    """Settings of a bridge; Foxglove's own pages may always connect.

    Attributes:
        limits: Limits on the number of clients and on their messages.
        offer: Features and files that the bridge offers.
    """

    port: int = PORT
    limits: FoxgloveLimits = FoxgloveLimits()
    offer: Offer = Offer()


class FoxgloveBridge(clients.WebsocketServer[FoxgloveClient, clients.TopicMessage]):
    """A server of the Foxglove protocol, whose clients take part in the network of a node.

    Args:
        node: The node. It is not closed with the bridge.
        port: Port to listen at; 0 for any.
        access: Address of the server, and access policy of its clients.
        limits: Limits on the number of clients and on their messages.
        offer: Features and files that the bridge offers.

    Raises:
        TransportError: It cannot listen there.
        UsageError: The library is not installed.
    """

    def __init__(
        self,
        node: Node,
        port: int = PORT,
        *,
        access: ServerAccess = ServerAccess(),  # noqa: B008  # frozen
        limits: FoxgloveLimits = FoxgloveLimits(),  # noqa: B008  # frozen
        offer: Offer = Offer(),  # noqa: B008  # frozen
    ) -> None:
        policy = access.policy
        lifecycle = Lifecycle("the Foxglove bridge")
        services = "services" in offer.capabilities and not policy.read_only
        catalog = NetworkCatalog(node, policy, hidden=offer.hidden, services=services)
        self._shared = FoxgloveResources(
            node,
            policy,
            clients.ClientTopics(node, clients.TopicMessage),
            lifecycle.keep(catalog),
            lifecycle.keep(ClientParameters(node, policy)),
            lifecycle.keep(CalledServices(node)),
            Assets(node.context.environment, offer.assets),
            lifecycle.keep(clients.task_worker("rosz-foxglove-calls")),
            str(time.time_ns()),
            limits,
            offer.capabilities,
        )
        super().__init__(
            "foxglove",
            node,
            port,
            access,
            limits,
            lifecycle,
            subprotocols=list(SUBPROTOCOLS),
            max_size=limits.message,
        )

    def _objection(self, _connection: ServerConnection, request: Request) -> str:
        if self._policy.is_authenticated(request):
            return ""
        return "the password is missing: the address of the bridge ends with /?token=PASSWORD"

    def _client(
        self,
        websocket: ServerConnection,
        queue: clients.OutgoingQueue[clients.TopicMessage],
        _refuse: Callable[[str], None],
    ) -> FoxgloveClient:
        return FoxgloveClient(self._shared, queue, clients.place(websocket))

    async def _receive(self, websocket: ServerConnection, client: FoxgloveClient) -> None:
        await self._run(client.open)
        await super()._receive(websocket, client)

    async def _write_answer(
        self, websocket: ServerConnection, client: FoxgloveClient, answer: bytes
    ) -> None:
        # Texts are JSON objects; binary messages begin with a small number.
        await websocket.send(answer, text=answer.startswith(b"{"))
        client.sent(answer)

    async def _write_message(
        self,
        websocket: ServerConnection,
        client: FoxgloveClient,
        message: clients.TopicMessage,
        topic: clients.TopicQueue[clients.TopicMessage],
    ) -> None:
        try:
            frame = client.encode(message, topic)
        except RoszError as error:
            self._log.warning("cannot send a message to a client: %s", error)
        else:
            await websocket.send(frame)


def open_bridge(node: Node, settings: FoxgloveSettings) -> tuple[FoxgloveBridge, list[str]]:
    """Return a bridge, and lines that tell the user its address.

    Args:
        node: Node of the bridge.
        settings: The settings.

    Raises:
        TransportError: It cannot listen there.
        UsageError: A setting is not valid, or the library is not installed.
    """
    access = settings.open_access(node, _HOLDER, _APPS)
    bridge = FoxgloveBridge(
        node, settings.port, access=access, limits=settings.limits, offer=settings.offer
    )
    address, *more = access.describe("ws", bridge.port)
    return bridge, [f"Foxglove connects to {address}", *more]
