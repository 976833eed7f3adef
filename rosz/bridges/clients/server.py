"""A websocket server with a thread of its own, which accepts clients and writes to them."""

from __future__ import annotations

import asyncio
import http
import itertools
import logging
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from rosz.access import PasswordGuesses, origin_objection
from rosz.bridges.clients.queues import M, OutgoingQueue, TopicQueue
from rosz.errors import TransportError, UsageError
from rosz.lifecycle import Closing, Lifecycle, Registration

if TYPE_CHECKING:
    from websockets.asyncio.server import Server, ServerConnection
    from websockets.http11 import Request, Response

    from rosz.access import ServerAccess
    from rosz.bridges.clients.settings import ClientLimits
    from rosz.node import Node

_HANDLERS = 16
_SECONDS = 10.0
# Bytes that a socket does not take at once are copied by websockets, asyncio and the kernel: an
# image of 6 MB took 13 ms of the processor whole, and takes 3 ms in pieces.
_PIECE = 1 << 18
_LONGEST_WAIT = 3600.0
_POLICY = 1008
"""Code with which a websocket is closed that breaks the rules of the server (RFC 6455, 7.4.1)."""
WRONG_TOO_OFTEN = "the password was wrong too often; try again in {:.0f} s"
_UNREAD = "answers wait that the client does not read"

Refuse = Callable[[str], None]
"""Function that ends a connection with a reason; any thread may call it."""


class BridgeClient(Protocol):
    """A client, as its server sees it; its methods run on threads for handlers."""

    def handle(self, data: str | bytes, /) -> None:
        """Handle a message of the client."""

    def close(self) -> None:
        """End everything that the client has begun."""


T = TypeVar("T")
C = TypeVar("C", bound=BridgeClient)


class WebsocketServer(Closing, Generic[C, M]):
    """A websocket server: it accepts clients, on a thread that writes to them, too.

    Args:
        name: Name of the protocol, and of the extra of rosz that installs the library.
        node: The node. It is not closed with the server.
        options: Further options of the library's server.

    Attributes:
        port: Port that it listens at.

    Raises:
        TransportError: It cannot listen there.
        UsageError: The library is not installed.
    """

    def __init__(
        self,
        name: str,
        node: Node,
        port: int,
        access: ServerAccess,
        limits: ClientLimits,
        lifecycle: Lifecycle,
        **options: Any,
    ) -> None:
        self._name = name
        self._log: logging.Logger = node.log
        self._access = access
        self._policy = access.policy
        self._guesses = PasswordGuesses()
        self._client_limits = limits
        self._lifecycle = lifecycle
        self._handlers = ThreadPoolExecutor(_HANDLERS, f"rosz-{name}")
        self._connected: dict[ServerConnection, asyncio.Future[None]] = {}
        self._server: Server | None = None
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(
            target=self._loop.run_forever, name=f"rosz-{name}", daemon=True
        )
        self._thread.start()
        lifecycle.keep(Registration(self._end))
        try:
            listening = asyncio.run_coroutine_threadsafe(self._listen(port, options), self._loop)
            self.port: int = listening.result(_SECONDS)
        except BaseException:
            self.close()
            raise

    # Defined by each protocol.

    def _objection(self, _connection: ServerConnection, _request: Request) -> str:
        """Return why a client may not connect that the policy lets, or prepare its connection."""
        return ""

    def _client(self, websocket: ServerConnection, queue: OutgoingQueue[M], refuse: Refuse) -> C:
        """Return the client of a connection."""
        raise NotImplementedError

    async def _receive(self, websocket: ServerConnection, client: C) -> None:
        """Handle the messages of a client, in order, until it is gone."""
        async for data in websocket:
            await self._run(client.handle, data)

    async def _write_answer(self, websocket: ServerConnection, client: C, answer: bytes) -> None:
        """Send an answer."""
        raise NotImplementedError

    async def _write_message(
        self, websocket: ServerConnection, client: C, message: M, topic: TopicQueue[M]
    ) -> None:
        """Send a message of a topic."""
        raise NotImplementedError

    # Connections, on the thread of the loop.

    async def _listen(self, port: int, options: dict[str, Any]) -> int:
        """Listen, and return the port."""
        try:
            from websockets.asyncio.server import serve
        except ImportError as error:
            raise UsageError(
                f"the {self._name} bridge needs a library: pip install 'rosz[{self._name}]'"
                f" ({error})"
            ) from error
        host = self._access.host
        try:
            self._server = await serve(
                self._serve,
                host,
                port,
                ssl=self._access.tls,
                process_request=self._admit,
                compression=None,  # it costs more than the links that this is for
                server_header=None,
                logger=_quiet,
                **options,
            )
        except OSError as error:
            raise TransportError(f"cannot listen at {host} port {port}: {error}") from error
        listening: int = next(iter(self._server.sockets)).getsockname()[1]
        return listening

    def _admit(self, connection: ServerConnection, request: Request) -> Response | None:
        """Refuse a request to connect, with the reason, or accept it."""
        try:
            status, reason = self._check(connection, request)
        except (ValueError, LookupError) as error:  # such as a header that may come once
            status, reason = http.HTTPStatus.BAD_REQUEST, f"the request is malformed: {error}"
        if reason:
            self._log.warning("a client at %s is refused: %s", place(connection), reason)
            return connection.respond(status, f"{reason}\n")
        # It counts from here on, since others may come before it is served.
        self._connected[connection] = end = asyncio.ensure_future(connection.wait_closed())
        end.add_done_callback(lambda _: self._connected.pop(connection))
        return None

    def _check(self, connection: ServerConnection, request: Request) -> tuple[http.HTTPStatus, str]:
        """Return the status and the reason with which a request is refused; empty if it is not.

        Raises:
            ValueError: The request is malformed.
            LookupError: A header comes twice.
        """
        right = self._policy.shows_password(request.path, request.headers)
        if right is None:
            reason = origin_objection(request.headers.get("Origin", ""), self._policy.origins)
        elif pause := self._guesses.pause(host_of(connection), right):
            return http.HTTPStatus.TOO_MANY_REQUESTS, WRONG_TOO_OFTEN.format(pause)
        elif not right:
            return http.HTTPStatus.UNAUTHORIZED, "the password is wrong"
        else:
            reason = ""
        if reason := reason or self._objection(connection, request):
            return http.HTTPStatus.FORBIDDEN, reason
        if self.clients >= self._client_limits.clients:
            reason = f"there are {self.clients} clients, which is the limit"
        return http.HTTPStatus.SERVICE_UNAVAILABLE, reason

    async def _serve(self, websocket: ServerConnection) -> None:
        """Serve a client until it is gone."""
        from websockets.exceptions import ConnectionClosed

        wanted = asyncio.Event()

        def wake() -> None:
            with suppress(RuntimeError):  # the loop is closed
                self._loop.call_soon_threadsafe(wanted.set)

        def refuse(reason: str) -> None:
            with suppress(RuntimeError):
                asyncio.run_coroutine_threadsafe(websocket.close(_POLICY, reason), self._loop)

        queue: OutgoingQueue[M] = OutgoingQueue(
            self._client_limits.waiting, wake, partial(refuse, _UNREAD)
        )
        client = self._client(websocket, queue, refuse)
        sender = asyncio.ensure_future(self._write(websocket, client, queue, wanted))
        try:
            await self._receive(websocket, client)
        except (ConnectionClosed, RuntimeError):  # the server has been closed
            pass
        finally:
            sender.cancel()
            with suppress(RuntimeError):
                await self._run(client.close)

    async def _write(
        self, websocket: ServerConnection, client: C, queue: OutgoingQueue[M], wanted: asyncio.Event
    ) -> None:
        """Send the messages that wait for a client."""
        from websockets.exceptions import ConnectionClosed

        with suppress(ConnectionClosed):
            while True:
                wanted.clear()
                item, topic, delay = queue.next()
                if item is None:
                    with suppress(TimeoutError):
                        await asyncio.wait_for(wanted.wait(), min(delay, _LONGEST_WAIT))
                elif isinstance(item, bytes):
                    await self._write_answer(websocket, client, item)
                elif topic is not None:
                    await self._write_message(websocket, client, item, topic)

    async def _run(self, task: Callable[..., T], *args: object) -> T:
        """Call a function on a thread for handlers.

        Raises:
            RuntimeError: The server is closed.
        """
        return await self._loop.run_in_executor(self._handlers, task, *args)

    # The end.

    @property
    def clients(self) -> int:
        """Number of clients that are connected."""
        return len(self._connected)

    def close(self) -> None:
        """End the server and all connections; a second call has no effect."""
        self._lifecycle.close()

    def _end(self) -> None:
        async def end() -> None:
            if self._server is not None:
                self._server.close()
                await self._server.wait_closed()
            await self._loop.shutdown_default_executor()

        with suppress(TimeoutError):
            asyncio.run_coroutine_threadsafe(end(), self._loop).result(_SECONDS)
        self._handlers.shutdown(wait=False, cancel_futures=True)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(_SECONDS)
        self._loop.close()


_quiet = logging.getLogger("rosz.bridges.clients")
_quiet.addHandler(logging.NullHandler())
_quiet.propagate = False


def pieces(data: bytes, head: bytes = b"") -> bytes | Iterator[bytes | memoryview]:
    """Return a message as websockets send it with the fewest copies: in pieces if it is large."""
    if len(data) <= _PIECE:
        return head + data
    view = memoryview(data)
    rest = (view[at : at + _PIECE] for at in range(_PIECE, len(data), _PIECE))
    return itertools.chain((head + view[:_PIECE],), rest)


def host_of(connection: ServerConnection) -> str:
    """Return the address of a client; empty if it is not known."""
    return connection.remote_address[0] if connection.remote_address else ""


def place(connection: ServerConnection) -> str:
    """Return where a client is, for the log."""
    address = connection.remote_address
    return f"{address[0]} port {address[1]}" if address else "an unknown address"
