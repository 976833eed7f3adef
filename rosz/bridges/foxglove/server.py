"""The Foxglove websocket server: connections, who may open one, and what is written to them."""

from __future__ import annotations

import asyncio
import logging
import re
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Self

import msgspec

from rosz.bridges.assets import SHOWN, Assets
from rosz.bridges.foxglove.catalog import Catalog
from rosz.bridges.foxglove.connection import CAPABILITIES, Connection, Shared
from rosz.bridges.foxglove.parameters import Parameters
from rosz.bridges.foxglove.protocol import SUBPROTOCOLS
from rosz.bridges.foxglove.services import Services
from rosz.bridges.listener import Listener, place
from rosz.bridges.opening import Entrance
from rosz.bridges.tasks import task_worker
from rosz.bridges.websocket import Encodings, Outbox, Topics
from rosz.errors import RoszError
from rosz.lifecycle import Lifecycle

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request

    from rosz.node import Node

__all__ = ("PORT", "FoxgloveBridge", "Limits", "Offer")

PORT = 8765
"""Port of foxglove_bridge."""

_POLICY = 1008
_UNREAD = "answers wait that the client does not read"


class Limits(msgspec.Struct, frozen=True):
    """Limits on the number of clients and on their messages.

    Attributes:
        clients: Largest number of clients.
        waiting: Bytes that wait for a client; the oldest messages give way to newer ones.
        message: Largest size of a message that a client sends, in bytes.
    """

    clients: int = 500
    waiting: int = 16 << 20
    message: int = 64 << 20


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


class FoxgloveBridge:
    """A server of the Foxglove protocol, whose clients take part in the network of a node.

    Args:
        node: The node. It is not closed with the bridge.
        port: Port to listen at; 0 for any.
        entrance: Where clients connect, who may do so, and what they may do.
        limits: Limits on the number of clients and on their messages.
        offer: What the bridge offers.

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
        limits: Limits = Limits(),  # noqa: B008  # frozen
        offer: Offer = Offer(),  # noqa: B008  # frozen
    ) -> None:
        self._log: logging.Logger = node.log
        gate, admission, access = entrance.gate, entrance.admission, entrance.access
        self._admission = admission
        self._limits = limits
        self._lifecycle = keep = Lifecycle("the Foxglove bridge")
        self._shared = Shared(
            node,
            gate,
            Topics(node, Encodings(0)),  # messages are sent as they come
            keep.keep(
                Catalog(
                    node,
                    gate,
                    hidden=offer.hidden,
                    services="services" in offer.capabilities and not gate.read_only,
                )
            ),
            keep.keep(Parameters(node, gate)),
            keep.keep(Services(node)),
            Assets(node.context.environment, offer.assets),
            keep.keep(task_worker("rosz-foxglove-calls")),
            str(time.time_ns()),
            offer.capabilities,
        )
        self._listener = keep.keep(
            Listener(
                "foxglove",
                node.log,
                admission,
                limits.clients,
                self._serve,
                accept=self._accept,
                subprotocols=list(SUBPROTOCOLS),
                max_size=limits.message,
            )
        )
        try:
            self._listener.open(access.host, port, access.tls)
        except BaseException:
            self.close()
            raise
        self.port: int = self._listener.port

    def _accept(self, _connection: ServerConnection, request: Request) -> str:
        if self._admission.is_known(request):
            return ""
        return "the password is missing: the address of the bridge ends with /?token=PASSWORD"

    async def _serve(self, websocket: ServerConnection) -> None:
        from websockets.exceptions import ConnectionClosed

        loop, wanted = self._listener.loop, asyncio.Event()

        def wake() -> None:
            with suppress(RuntimeError):  # the loop is closed
                loop.call_soon_threadsafe(wanted.set)

        def refuse() -> None:
            with suppress(RuntimeError):
                asyncio.run_coroutine_threadsafe(websocket.close(_POLICY, _UNREAD), loop)

        outbox = Outbox(self._limits.waiting, wake, refuse)
        connection = Connection(self._shared, outbox, place(websocket), self._limits.message)
        sender = asyncio.ensure_future(self._send(websocket, connection, outbox, wanted))
        run = self._listener.run
        try:
            await run(connection.open)
            async for data in websocket:
                await run(connection.handle, data)
        except (ConnectionClosed, RuntimeError):  # the listener has been closed
            pass
        finally:
            sender.cancel()
            with suppress(RuntimeError):
                await run(connection.close)

    async def _send(
        self,
        websocket: ServerConnection,
        connection: Connection,
        outbox: Outbox,
        wanted: asyncio.Event,
    ) -> None:
        from websockets.exceptions import ConnectionClosed

        with suppress(ConnectionClosed):
            while True:
                wanted.clear()
                item, feed, delay = outbox.next()
                if item is None:
                    with suppress(TimeoutError):
                        await asyncio.wait_for(wanted.wait(), min(delay, 3600.0))
                elif isinstance(item, bytes):
                    # Texts are JSON objects; binary messages begin with a small number.
                    await websocket.send(item, text=item.startswith(b"{"))
                    connection.sent(item)
                elif feed is not None:
                    try:
                        frame = connection.encode(item, feed)
                    except RoszError as error:
                        self._log.warning("cannot send a message to a client: %s", error)
                    else:
                        await websocket.send(frame)

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
