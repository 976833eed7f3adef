"""rosgraph.xmlrpc: servers of XML-RPC that programs make for themselves.

Nothing of rosz uses XML-RPC.
"""

from __future__ import annotations

import logging
import threading
from socketserver import ThreadingMixIn
from typing import Any
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

from rosz.ros1.rosgraph.network import get_host_name

__all__ = (
    "SilenceableXMLRPCRequestHandler",
    "ThreadingXMLRPCServer",
    "XmlRpcHandler",
    "XmlRpcNode",
)

_log = logging.getLogger("rosz.xmlrpc")


class SilenceableXMLRPCRequestHandler(SimpleXMLRPCRequestHandler):
    """Handles a request, and prints nothing of it."""

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002  # the library's
        """Log a request where debug messages go."""
        _log.debug(format, *args)


class ThreadingXMLRPCServer(ThreadingMixIn, SimpleXMLRPCServer):
    """A server that handles each request on a thread of its own."""

    daemon_threads = True

    def __init__(self, addr: tuple[str, int], log_requests: bool = True) -> None:
        super().__init__(addr, SilenceableXMLRPCRequestHandler, log_requests)


class XmlRpcHandler:
    """Base class of what a server offers: the methods whose names have no dash in front."""

    def _ready(self, uri: str) -> None:
        """Handle that the server can be reached."""

    def _shutdown(self, reason: str) -> None:
        """Handle the end of the server."""


class XmlRpcNode:
    """A server with a thread.

    Args:
        port: Its port; one that is free when 0.
        rpc_handler: What it offers.
        on_run_error: Function called with what the server raises.

    Attributes:
        uri: Its URI, once it has been started.
    """

    def __init__(
        self, port: int = 0, rpc_handler: XmlRpcHandler | None = None, on_run_error: Any = None
    ) -> None:
        self.handler = rpc_handler
        self.port = port or 0
        self.uri: str | None = None
        self.server: ThreadingXMLRPCServer | None = None
        self.is_shutdown = False
        self._on_run_error = on_run_error

    def set_uri(self, uri: str) -> None:
        """Set the URI that others are told."""
        self.uri = uri

    def start(self) -> None:
        """Serve on a thread."""
        self._bind()
        threading.Thread(target=self._serve, name="rosz-xmlrpc", daemon=True).start()

    def run(self) -> None:
        """Serve on this thread, until `shutdown`."""
        self._bind()
        self._serve()

    def _bind(self) -> None:
        self.server = ThreadingXMLRPCServer(("", self.port))
        self.port = int(self.server.server_address[1])
        self.uri = self.uri or f"http://{get_host_name()}:{self.port}/"
        self.server.register_multicall_functions()
        if self.handler is not None:
            self.server.register_instance(self.handler)
            self.handler._ready(self.uri)  # noqa: SLF001  # as ROS 1 names it

    def _serve(self) -> None:
        if self.server is None:
            return
        try:
            self.server.serve_forever()
        except OSError as error:
            if self.is_shutdown:
                return
            if self._on_run_error is None:
                raise
            self._on_run_error(error)

    def shutdown(self, reason: str) -> None:
        """End the server.

        Args:
            reason: Text for the handler.
        """
        self.is_shutdown = True
        if self.server is not None:
            self.server.shutdown()
            self.server.server_close()
            self.server = None
        if self.handler is not None:
            self.handler._shutdown(reason)  # noqa: SLF001  # as ROS 1 names it
