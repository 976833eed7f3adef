"""Opening the page by settings, as a command line gives them."""

from __future__ import annotations

import importlib.util
import socket
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from rosz.bridges.admission import is_loopback, new_password, read_password, server_tls
from rosz.errors import UsageError
from rosz.session import keys_of
from rosz.web.guard import Guard
from rosz.web.model import Permission

if TYPE_CHECKING:
    from rosz.node import Node
    from rosz.web.server import PageServer

__all__ = ("PORT", "Settings", "open_page")

PORT = 8080
HOLDER = "web"
"""Name of those who use the page in the rules of a machine."""
_LIBRARY = "the page needs a library: pip install 'rosz[web]'"
_LAST_PORT = 65535


class Settings(msgspec.Struct, frozen=True, kw_only=True):
    """Settings of the page.

    Attributes:
        host: Address to listen at. Beyond this machine, a password is needed.
        port: Port to listen at; 0 for any.
        password_file: File whose first line is the password; empty for a random one.
        read_only: Whether the page changes nothing.
        certificate: Certificate for TLS, instead of that of the keys.
        key: Its private key.
    """

    host: str = "127.0.0.1"
    port: int = PORT
    password_file: str = ""
    read_only: bool = False
    certificate: str = ""
    key: str = ""


def open_page(node: Node, settings: Settings) -> tuple[PageServer, list[str]]:
    """Serve the page, and return the server with its address and lines that say more.

    Args:
        node: Node of the page.
        settings: The settings.

    Raises:
        TransportError: It cannot listen there.
        UsageError: A setting is not valid, or the library is not installed.
    """
    if not 0 <= settings.port <= _LAST_PORT:
        raise UsageError(f"port {settings.port}: expected 0 to {_LAST_PORT}")
    if bool(settings.certificate) != bool(settings.key):
        raise UsageError("a certificate for TLS and its private key go together: give both")
    if importlib.util.find_spec("nicegui") is None:
        raise UsageError(_LIBRARY)
    from rosz.web.server import PageServer

    local = is_loopback(settings.host)
    keys = keys_of(node.context.environment)
    password = ""
    if settings.password_file:
        password = read_password(Path(settings.password_file))
    elif not local:
        password = new_password()
    rules = keys.rules if keys else None
    tls = server_tls(None if local else keys, settings.certificate, settings.key)
    server = PageServer(
        node,
        settings.host,
        settings.port,
        permission=Permission(
            None if rules is None else rules.permit_at_bridge(HOLDER), settings.read_only
        ),
        guard=Guard(password, local=local, secure=tls is not None),
        tls=tls,
    )
    return server, _describe(server.port, settings, password, secure=tls is not None)


def _describe(port: int, settings: Settings, password: str, *, secure: bool) -> list[str]:
    """Return the address to open, and lines that say more."""
    everywhere = settings.host in {"0.0.0.0", "::", ""}  # noqa: S104  # it is compared
    host = socket.gethostname() if everywhere else settings.host
    scheme = "https" if secure else "http"
    address = f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}/"
    if password and not settings.password_file:
        address += f"?token={password}"
    lines = [address]
    if password and not secure:
        lines.append(
            "the password is sent unencrypted; keys (ROSZ_KEYS) or --certificate change that"
        )
    return lines
