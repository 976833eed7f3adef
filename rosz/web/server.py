"""The server of the page: uvicorn and NiceGUI, on a thread of their own.

NiceGUI keeps its pages in the module, so that a process has one such server.
"""

from __future__ import annotations

import asyncio
import logging
import os
import socket
import ssl
import threading
from collections.abc import Callable
from inspect import isawaitable
from pathlib import Path
from typing import Any

import uvicorn
from fastapi import FastAPI
from nicegui import Client, core, ui
from nicegui import app as pages

from rosz.access import PagePolicy
from rosz.errors import TransportError
from rosz.node import Node
from rosz.web.middleware import AccessMiddleware
from rosz.web.model import System
from rosz.web.pages import add_pages
from rosz.worker import Worker, run_task

_START_SECONDS = 120.0
_STOP_SECONDS = 1
_RECONNECT_SECONDS = 10.0
"""Seconds that a page stays as it is without a link, as on a robot that drives out of reach."""
_PING_SECONDS = 5.0
_ANSWER_SECONDS = 20.0
"""Seconds within which a browser must answer a ping: one that draws much in 3D without a graphics
processor, or that opens a page on a busy machine, answers late. It would lose its forms."""
_LOGGERS = ("nicegui", "uvicorn.error")
_log = logging.getLogger("rosz.web")
_NICENESS = 10
"""Niceness of the threads of the server, so that nodes of the machine run before the pages."""


def _prepare_links() -> None:
    core.sio.eio.ping_interval = _PING_SECONDS
    core.sio.eio.ping_timeout = _ANSWER_SECONDS
    for handlers in (core.sio.eio.handlers, core.sio.handlers["/"]):
        for name in handlers.keys() - {"connect", "disconnect"}:
            handlers[name] = _checked(handlers[name])


def _checked(handler: Callable[..., Any]) -> Callable[..., Any]:
    """Return a handler that drops malformed messages, and logs a line for each of them."""

    async def handle(*words: object) -> Any:
        try:
            result = handler(*words)
            return await result if isawaitable(result) else result
        except (AttributeError, LookupError, RecursionError, TypeError, ValueError) as error:
            _log.warning("dropping a malformed message of a page: %r", error)

    return handle


class _Server(uvicorn.Server):
    """A server that sets an event when it has started."""

    def __init__(self, config: uvicorn.Config, ready: threading.Event) -> None:
        super().__init__(config)
        self._ready = ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start, and set the event."""
        await super().startup(sockets)
        self._ready.set()


class PageServer:
    """Serves the page of a node until it is closed.

    Args:
        node: The node. It is not closed with the server.
        host: Address to listen at.
        port: Port to listen at; 0 for any.
        permission: The changes that the page may make.
        middleware: Refuses requests of those who may not open it.
        bags: Folder of the bags.
        tls: Settings of TLS; without them, links are not encrypted.

    Attributes:
        port: Port that it listens at.

    Raises:
        TransportError: It cannot listen there.
    """

    def __init__(
        self,
        node: Node,
        host: str,
        port: int,
        *,
        permission: PagePolicy,
        middleware: AccessMiddleware,
        bags: Path,
        tls: ssl.SSLContext | None = None,
    ) -> None:
        self._socket = _listen(host, port)
        self.port: int = self._socket.getsockname()[1]
        add_pages(System(node, permission, bags))
        app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
        ui.run_with(
            app,
            title="rosz",
            dark=None,
            favicon=_ICON,
            binding_refresh_interval=None,
            message_history_length=200,
            reconnect_timeout=_RECONNECT_SECONDS,
            show_welcome_message=False,
        )
        pages.on_startup(_prepare_links)
        logging.getLogger("asyncio").setLevel(logging.ERROR)  # it warns of browsers that leave
        config = uvicorn.Config(
            middleware.protect(app, _open_pages),
            log_level="warning",
            ws="websockets-sansio",
            timeout_graceful_shutdown=_STOP_SECONDS,
            server_header=False,
            ssl_context_factory=None if tls is None else lambda _config, _default: tls,
        )
        self._ready = threading.Event()
        self._server = _Server(config, self._ready)
        self._worker: Worker[Callable[[], object]] = Worker("rosz-web", run_task)
        self._worker.submit(self._run)
        if not self._ready.wait(_START_SECONDS):
            self.close()
            raise TransportError(f"the page was not ready within {_START_SECONDS:g} seconds")

    def _run(self) -> None:
        os.nice(_NICENESS)  # of this thread, and of those that it starts; see sched(7)
        asyncio.run(self._server.serve([self._socket]))

    def close(self) -> None:
        """Stop serving; a second call has no effect."""
        for name in _LOGGERS:  # a request that the end cuts short is no error
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
        self._server.should_exit = True
        self._worker.close()
        self._socket.close()


def _open_pages(path: str) -> int:
    """Return the number of open pages if a path is that of a page, else 0."""
    return len(Client.instances) if path in Client.page_routes.values() else 0


_ICON = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32"><rect width="32" height="32"'
    ' rx="7" fill="#2456c8"/><g fill="#fff"><circle cx="9" cy="9" r="3"/><circle cx="23" cy="9"'
    ' r="3"/><circle cx="9" cy="23" r="3"/><circle cx="23" cy="23" r="3"/></g><path'
    ' d="M9 9h14L9 23h14" fill="none" stroke="#fff" stroke-width="2"/></svg>'
)


def _listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        listening = socket.socket(family, kind, protocol)
    except OSError as error:
        raise TransportError(f"cannot listen at '{host}': {error}") from error
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(address)
        listening.listen(128)
    except OSError as error:
        listening.close()
        raise TransportError(
            f"cannot listen at {host}, port {port}: {error.strerror or error};"
            " --port takes another one, and 0 any that is free"
        ) from error
    return listening
