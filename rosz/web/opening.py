"""Opening the page by settings, as a command line gives them."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosz.access import PagePolicy, ServerSettings, is_loopback, open_access
from rosz.errors import UsageError
from rosz.msgs.std_srvs.srv import Trigger

if TYPE_CHECKING:
    from rosz.node import Node
    from rosz.web.server import PageServer

PORT = 8080
PAGE_SERVICE = "page"
"""Private name of the service that tells other programs of this machine the address."""
HOLDER = "web"
"""Name of those who use the page in the rules of a machine."""
_LIBRARY = "the page needs a library: pip install 'rosz[web]'"


class PageSettings(ServerSettings, frozen=True, kw_only=True):
    """Settings of the page.

    Attributes:
        bags: Folder of the bags that it records, plays and shows.
        most_pages: Largest number of pages that are open at a time.
    """

    port: int = PORT
    most_pages: int = 200
    bags: Path = Path()


def _import_server() -> type[PageServer]:
    """Import the server of the page, without the client of websockets that it has no use for.

    socketio imports aiohttp if it can, for its client, which takes an eighth of the start.
    """
    modules: dict[str, Any] = sys.modules
    unknown = "aiohttp" not in modules
    if unknown:
        modules["aiohttp"] = None  # importing it raises ImportError
    try:
        from rosz.web.server import PageServer
    finally:
        if unknown:
            del modules["aiohttp"]
    return PageServer


def open_page(node: Node, settings: PageSettings) -> tuple[PageServer, list[str]]:
    """Serve the page, and return the server with its address and lines that say more.

    Args:
        node: Node of the page.
        settings: The settings.

    Raises:
        TransportError: It cannot listen there.
        UsageError: A setting is not valid, or the library is not installed.
    """
    if not settings.bags.is_dir():
        raise UsageError(f"--bags: '{settings.bags}' is not a folder")
    access = open_access(node, settings, HOLDER)
    if importlib.util.find_spec("nicegui") is None:
        raise UsageError(_LIBRARY)
    from rosz.web.middleware import AccessMiddleware

    server = _import_server()(
        node,
        access.host,
        settings.port,
        permission=PagePolicy(access.policy.permit, settings.read_only),
        bags=settings.bags,
        middleware=AccessMiddleware(
            access.policy.password,
            local=is_loopback(access.host),
            secure=access.tls is not None,
            most=settings.most_pages,
        ),
        tls=access.tls,
    )
    described = access.describe("http", server.port)
    address = described[0].partition("?")[0]  # without the password
    node.service(
        f"~{PAGE_SERVICE}",
        Trigger,
        lambda _request: Trigger.Response(success=True, message=address),
    )
    return server, described
