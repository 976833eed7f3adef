"""``rosgraph.xmlrpc``: a server of XML-RPC, for programs that import it."""

from __future__ import annotations

import logging
from socketserver import ThreadingMixIn
from typing import Any
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

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
