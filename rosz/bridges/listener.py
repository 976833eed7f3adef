"""A websocket server with a thread of its own, for bridges whose clients come from outside."""

from __future__ import annotations

import asyncio
import http
import itertools
import logging
import ssl
import threading
from collections.abc import Callable, Coroutine, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import TYPE_CHECKING, Any, TypeVar

from rosz.bridges.admission import Admission
from rosz.errors import TransportError, UsageError

if TYPE_CHECKING:
    from websockets.asyncio.server import Server, ServerConnection
    from websockets.http11 import Request, Response

__all__ = ("Listener", "pieces", "place")

T = TypeVar("T")

_HANDLERS = 16
_SECONDS = 10.0
_PIECE = 1 << 18


class Listener:
    """A websocket server: it accepts clients, on a thread that writes to them, too.

    Args:
        extra: Extra of rosz that installs its library; also the name of its threads.
        log: Logger of refused clients.
        admission: Conditions under which a client may connect.
        limit: Largest number of clients.
        serve: Coroutine function that serves a client until it is gone.
        accept: Function that returns why a client may not connect that fulfils the conditions, or
            prepares its connection.
        options: Further options of the server.

    Attributes:
        loop: Event loop of the thread.
        port: Port that it listens at.
    """

    def __init__(
        self,
        extra: str,
        log: logging.Logger,
        admission: Admission,
        limit: int,
        serve: Callable[[ServerConnection], Coroutine[Any, Any, None]],
        *,
        accept: Callable[[ServerConnection, Request], str],
        **options: Any,
    ) -> None:
        self._extra = extra
        self._log = log
        self._admission = admission
        self._limit = limit
        self._serve = serve
        self._accept = accept
        self._options = options
        self._handlers = ThreadPoolExecutor(_HANDLERS, f"rosz-{extra}")
        self._clients: dict[ServerConnection, asyncio.Future[None]] = {}
        self._server: Server | None = None
        self.port: int = 0
        self.loop = asyncio.new_event_loop()
        self._thread = threading.Thread(
            target=self.loop.run_forever, name=f"rosz-{extra}", daemon=True
        )
        self._thread.start()

    def open(self, host: str, port: int, tls: ssl.SSLContext | None) -> None:
        """Listen.

        Args:
            host: Address to listen at.
            port: Port to listen at; 0 for any.
            tls: Settings of TLS; without them, links are not encrypted.

        Raises:
            TransportError: It cannot listen there.
            UsageError: The library is not installed.
        """
        asyncio.run_coroutine_threadsafe(self._open(host, port, tls), self.loop).result(_SECONDS)

    async def _open(self, host: str, port: int, tls: ssl.SSLContext | None) -> None:
        try:
            from websockets.asyncio.server import serve
        except ImportError as error:
            raise UsageError(
                f"the {self._extra} bridge needs a library: pip install 'rosz[{self._extra}]'"
                f" ({error})"
            ) from error
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
                **self._options,
            )
        except OSError as error:
            raise TransportError(f"cannot listen at {host} port {port}: {error}") from error
        self.port = next(iter(self._server.sockets)).getsockname()[1]

    def _admit(self, connection: ServerConnection, request: Request) -> Response | None:
        """Refuse a request to connect, with the reason, or accept it."""
        status = http.HTTPStatus.FORBIDDEN
        reason = self._admission.objection(request.path, request.headers)
        reason = reason or self._accept(connection, request)
        if not reason and self.clients >= self._limit:
            reason = f"there are {self.clients} clients, which is the limit"
            status = http.HTTPStatus.SERVICE_UNAVAILABLE
        if reason:
            self._log.warning("a client at %s is refused: %s", place(connection), reason)
            return connection.respond(status, f"{reason}\n")
        # It counts from here on, since others may come before it is served.
        self._clients[connection] = end = asyncio.ensure_future(connection.wait_closed())
        end.add_done_callback(lambda _: self._clients.pop(connection))
        return None

    async def run(self, task: Callable[..., T], *args: object) -> T:
        """Call a function on a thread for what clients ask for.

        Raises:
            RuntimeError: The server is closed.
        """
        return await self.loop.run_in_executor(self._handlers, task, *args)

    @property
    def clients(self) -> int:
        """Number of clients that are connected."""
        return len(self._clients)

    def close(self) -> None:
        """End all connections and the thread."""

        async def end() -> None:
            if self._server is not None:
                self._server.close()
                await self._server.wait_closed()
            await self.loop.shutdown_default_executor()

        with suppress(TimeoutError):
            asyncio.run_coroutine_threadsafe(end(), self.loop).result(_SECONDS)
        self._handlers.shutdown(wait=False, cancel_futures=True)
        self.loop.call_soon_threadsafe(self.loop.stop)
        self._thread.join(_SECONDS)
        self.loop.close()


_quiet = logging.getLogger("rosz.bridges.clients")
_quiet.addHandler(logging.NullHandler())
_quiet.propagate = False


def pieces(data: bytes, head: bytes = b"") -> bytes | Iterator[bytes | memoryview]:
    """Return a message as websockets send it with the fewest copies: in pieces if it is large.

    What a socket does not take at once is copied, several times.

    Args:
        data: The message.
        head: Bytes that stand before it.
    """
    if len(data) <= _PIECE:
        return head + data
    view = memoryview(data)
    rest = (view[at : at + _PIECE] for at in range(_PIECE, len(data), _PIECE))
    return itertools.chain((head + view[:_PIECE],), rest)


def place(connection: ServerConnection) -> str:
    """Return where a client is, for the log."""
    address = connection.remote_address
    return f"{address[0]} port {address[1]}" if address else "an unknown address"
