"""The websocket server: connections, who may open one, and what is written to them."""

from __future__ import annotations

import asyncio
import http
import logging
import ssl
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Self

import msgspec

from rosz.bridges.admission import Admission
from rosz.bridges.gate import Gate
from rosz.bridges.websocket.actions import Gateways
from rosz.bridges.websocket.connection import Connection, Shared
from rosz.bridges.websocket.operations import fragments, png
from rosz.bridges.websocket.outbox import Encodings, Message, Outbox
from rosz.bridges.websocket.plain import Spelling
from rosz.bridges.websocket.rosapi import RosApi
from rosz.bridges.websocket.topics import Topics
from rosz.errors import RoszError, TransportError, UsageError
from rosz.lifecycle import Lifecycle, Registration
from rosz.transforms import Republisher
from rosz.worker import Worker

if TYPE_CHECKING:
    from websockets.asyncio.server import Server, ServerConnection
    from websockets.http11 import Request, Response

    from rosz.node import Node

__all__ = ("PORT", "Limits", "WebsocketBridge")

PORT = 9090
"""Port of rosbridge."""

_LIBRARY = "the websocket bridge needs a library: pip install 'rosz[websocket]'"
_CALLS = 64
_HANDLERS = 16
_ENCODED_HERE = 16384
"""Bytes of a message that the thread of the server encodes itself."""
_POLICY = 1008
_LATE = "the password is missing"  # what a client is told
_START_SECONDS = 10.0


class Limits(msgspec.Struct, frozen=True):
    """How much clients may take.

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
        host: Address to listen at.
        port: Port to listen at; 0 for any.
        gate: Permissions of the clients.
        admission: Conditions under which a client may connect.
        tls: Settings of TLS; without them, links are not encrypted.
        spelling: Whose names of types and fields a client gets that has not shown its own.
        limits: How much clients may take.

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
        spelling: Spelling = "ros1",
        limits: Limits = Limits(),  # noqa: B008  # frozen
    ) -> None:
        self._log: logging.Logger = node.log
        self._admission = admission
        self._limits = limits
        self._lifecycle = Lifecycle("the websocket bridge")
        self._calls = self._lifecycle.keep(
            Worker[Callable[[], object]]("rosz-calls", threads=_CALLS)
        )
        topics = Topics(node, Encodings(limits.encoded))
        self._shared = Shared(
            node,
            gate,
            topics,
            Gateways(node),
            RosApi(node),
            self._calls,
            spelling,
            admission.password,
        )
        self._handlers = ThreadPoolExecutor(_HANDLERS, "rosz-websocket")
        self._loop = asyncio.new_event_loop()
        self._clients: dict[ServerConnection, asyncio.Future[None]] = {}
        self._republishing = threading.Lock()
        self._republisher: Republisher | None = None
        self._server: Server
        self.port: int = 0
        self._thread = threading.Thread(
            target=self._loop.run_forever, name="rosz-websocket", daemon=True
        )
        self._thread.start()
        self._lifecycle.keep(Registration(self._end))
        try:
            opening = asyncio.run_coroutine_threadsafe(self._open(host, port, tls), self._loop)
            opening.result(_START_SECONDS)
        except BaseException:
            self.close()
            raise

    async def _open(self, host: str, port: int, tls: ssl.SSLContext | None) -> None:
        try:
            from websockets.asyncio.server import serve
        except ImportError as error:
            raise UsageError(f"{_LIBRARY} ({error})") from error
        try:
            self._server = await serve(
                self._serve,
                host,
                port,
                ssl=tls,
                process_request=self._admit,
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
        reason = self._admission.objection(request.path, request.headers)
        status = http.HTTPStatus.FORBIDDEN
        if not reason and len(self._clients) >= self._limits.clients:
            reason = f"there are {len(self._clients)} clients, which is the limit"
            status = http.HTTPStatus.SERVICE_UNAVAILABLE
        if reason:
            self._log.warning("a client at %s is refused: %s", _place(connection), reason)
            return connection.respond(status, f"{reason}\n")
        limits = self._limits
        known = self._admission.is_known(request)
        connection.protocol.max_message_size = limits.operation if known else limits.password
        # It counts from here on, since others may come before its first operation.
        self._clients[connection] = end = asyncio.ensure_future(connection.wait_closed())
        end.add_done_callback(lambda _: self._clients.pop(connection))
        return None

    async def _serve(self, websocket: ServerConnection) -> None:
        from websockets.exceptions import ConnectionClosed

        loop, wanted = self._loop, asyncio.Event()

        def wake() -> None:
            with suppress(RuntimeError):  # the loop is closed
                loop.call_soon_threadsafe(wanted.set)

        def refuse(reason: str) -> None:
            with suppress(RuntimeError):
                asyncio.run_coroutine_threadsafe(websocket.close(_POLICY, reason), loop)

        outbox = Outbox(
            self._limits.waiting, wake, lambda: refuse("answers wait that the client does not read")
        )
        await loop.run_in_executor(self._handlers, self._republish)
        trusted = self._admission.is_known(websocket.request)
        connection = Connection(
            self._shared,
            outbox,
            _place(websocket),
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
                await loop.run_in_executor(self._handlers, connection.handle, text)
                if connection.trusted:
                    websocket.protocol.max_message_size = self._limits.operation
        except (ConnectionClosed, RuntimeError):  # the executor has been shut down
            pass
        finally:
            sender.cancel()
            late.cancel()
            with suppress(RuntimeError):
                await loop.run_in_executor(self._handlers, connection.close)

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
                    await websocket.send(item, text=True)
                elif feed is not None:
                    numbers += 1
                    for frame in await self._encode(item, feed, numbers):
                        await websocket.send(frame, text=not feed.form[0].startswith("cbor"))

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
            return await self._loop.run_in_executor(self._handlers, encode)
        except (RoszError, ImportError) as error:
            self._log.warning("cannot send a message to a client: %s", error)
            return []

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


_quiet = logging.getLogger("rosz.websocket")
_quiet.addHandler(logging.NullHandler())
_quiet.propagate = False


def _place(connection: Any) -> str:
    address = connection.remote_address
    return f"{address[0]} port {address[1]}" if address else "an unknown address"
