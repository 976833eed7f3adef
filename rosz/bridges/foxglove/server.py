"""The Foxglove websocket server: connections, who may open one, and what is written to them."""

from __future__ import annotations

import asyncio
import http
import logging
import re
import ssl
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import TYPE_CHECKING, Self

import msgspec

from rosz.bridges.admission import Admission
from rosz.bridges.foxglove.assets import SHOWN, Assets
from rosz.bridges.foxglove.catalog import Catalog
from rosz.bridges.foxglove.connection import CAPABILITIES, Connection, Shared
from rosz.bridges.foxglove.parameters import Parameters
from rosz.bridges.foxglove.protocol import SUBPROTOCOLS
from rosz.bridges.foxglove.services import Services
from rosz.bridges.gate import Gate
from rosz.bridges.websocket import Encodings, Outbox, Topics
from rosz.errors import RoszError, TransportError, UsageError
from rosz.lifecycle import Lifecycle, Registration
from rosz.worker import Worker

if TYPE_CHECKING:
    from websockets.asyncio.server import Server, ServerConnection
    from websockets.http11 import Request, Response

    from rosz.node import Node

__all__ = ("PORT", "FoxgloveBridge", "Limits", "Offer")

PORT = 8765
"""Port of foxglove_bridge."""

_LIBRARY = "the Foxglove bridge needs a library: pip install 'rosz[foxglove]'"
_CALLS = 64
_HANDLERS = 16
_POLICY = 1008
_START_SECONDS = 10.0
_UNREAD = "answers wait that the client does not read"


class Limits(msgspec.Struct, frozen=True):
    """How much clients may take.

    Attributes:
        clients: Largest number of clients.
        waiting: Bytes that wait for a client; the oldest messages give way to newer ones.
        message: Largest size of a message that a client sends, in bytes.
    """

    clients: int = 500
    waiting: int = 16 << 20
    message: int = 64 << 20


class Offer(msgspec.Struct, frozen=True):
    """What a bridge offers to its clients, within their permissions.

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
        host: Address to listen at.
        port: Port to listen at; 0 for any.
        gate: Permissions of the clients.
        admission: Conditions under which a client may connect.
        tls: Settings of TLS; without them, links are not encrypted.
        limits: How much clients may take.
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
        host: str = "127.0.0.1",
        port: int = PORT,
        *,
        gate: Gate = Gate(),  # noqa: B008  # frozen
        admission: Admission = Admission(),  # noqa: B008  # frozen
        tls: ssl.SSLContext | None = None,
        limits: Limits = Limits(),  # noqa: B008  # frozen
        offer: Offer = Offer(),  # noqa: B008  # frozen
    ) -> None:
        self._log: logging.Logger = node.log
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
            keep.keep(Worker[Callable[[], object]]("rosz-foxglove-calls", threads=_CALLS)),
            str(time.time_ns()),
            offer.capabilities,
        )
        self._handlers = ThreadPoolExecutor(_HANDLERS, "rosz-foxglove")
        self._loop = asyncio.new_event_loop()
        self._clients: dict[ServerConnection, asyncio.Future[None]] = {}
        self._server: Server
        self.port: int = 0
        self._thread = threading.Thread(
            target=self._loop.run_forever, name="rosz-foxglove", daemon=True
        )
        self._thread.start()
        keep.keep(Registration(self._end))
        try:
            opening = asyncio.run_coroutine_threadsafe(self._open(host, port, tls), self._loop)
            opening.result(_START_SECONDS)
        except BaseException:
            self.close()
            raise

    async def _open(self, host: str, port: int, tls: ssl.SSLContext | None) -> None:
        try:
            from websockets.asyncio.server import serve
            from websockets.typing import Subprotocol
        except ImportError as error:
            raise UsageError(f"{_LIBRARY} ({error})") from error
        try:
            self._server = await serve(
                self._serve,
                host,
                port,
                ssl=tls,
                process_request=self._admit,
                subprotocols=[Subprotocol(name) for name in SUBPROTOCOLS],
                max_size=self._limits.message,
                compression=None,  # it costs more than the links that this is for
                server_header=None,
                logger=_quiet,
            )
        except OSError as error:
            raise TransportError(f"cannot listen at {host} port {port}: {error}") from error
        self.port = next(iter(self._server.sockets)).getsockname()[1]

    # Connections.

    def _admit(self, connection: ServerConnection, request: Request) -> Response | None:
        """Refuse a request to connect, with the reason, or accept it."""
        status = http.HTTPStatus.FORBIDDEN
        reason = self._admission.objection(request.path, request.headers)
        if not reason and not self._admission.is_known(request):
            status = http.HTTPStatus.UNAUTHORIZED
            reason = (
                "the password is missing: connect to an address that ends with /?token=PASSWORD"
            )
        if not reason and len(self._clients) >= self._limits.clients:
            status = http.HTTPStatus.SERVICE_UNAVAILABLE
            reason = f"there are {len(self._clients)} clients, which is the limit"
        if reason:
            self._log.warning("a client at %s is refused: %s", _place(connection), reason)
            return connection.respond(status, f"{reason}\n")
        # It counts from here on, since others may come before it is served.
        self._clients[connection] = end = asyncio.ensure_future(connection.wait_closed())
        end.add_done_callback(lambda _: self._clients.pop(connection))
        return None

    async def _serve(self, websocket: ServerConnection) -> None:
        from websockets.exceptions import ConnectionClosed

        loop, wanted = self._loop, asyncio.Event()

        def wake() -> None:
            with suppress(RuntimeError):  # the loop is closed
                loop.call_soon_threadsafe(wanted.set)

        def refuse() -> None:
            with suppress(RuntimeError):
                asyncio.run_coroutine_threadsafe(websocket.close(_POLICY, _UNREAD), loop)

        outbox = Outbox(self._limits.waiting, wake, refuse)
        place, limit = _place(websocket), self._limits.message
        connection = Connection(self._shared, outbox, place, limit)
        sender = asyncio.ensure_future(self._send(websocket, connection, outbox, wanted))
        try:
            await loop.run_in_executor(self._handlers, connection.open)
            async for data in websocket:
                await loop.run_in_executor(self._handlers, connection.handle, data)
        except (ConnectionClosed, RuntimeError):  # the executor has been shut down
            pass
        finally:
            sender.cancel()
            with suppress(RuntimeError):
                await loop.run_in_executor(self._handlers, connection.close)

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
        return len(self._clients)

    def close(self) -> None:
        """End the bridge and all connections; a second call has no effect."""
        self._lifecycle.close()

    def _end(self) -> None:
        async def end() -> None:
            server = getattr(self, "_server", None)
            if server is not None:
                server.close()
                await server.wait_closed()
            await self._loop.shutdown_default_executor()

        with suppress(TimeoutError):
            asyncio.run_coroutine_threadsafe(end(), self._loop).result(_START_SECONDS)
        self._handlers.shutdown(wait=False, cancel_futures=True)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(_START_SECONDS)
        self._loop.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


_quiet = logging.getLogger("rosz.foxglove")
_quiet.addHandler(logging.NullHandler())
_quiet.propagate = False


def _place(connection: ServerConnection) -> str:
    address = connection.remote_address
    return f"{address[0]} port {address[1]}" if address else "an unknown address"
