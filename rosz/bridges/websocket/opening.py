"""Opening a bridge by settings, as a command line or the parameters of a node give them."""

from __future__ import annotations

import socket
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from rosz.bridges.admission import (
    Admission,
    is_loopback,
    new_password,
    read_password,
    server_tls,
)
from rosz.bridges.gate import Gate
from rosz.bridges.websocket.plain import Spelling
from rosz.bridges.websocket.server import PORT, Limits, WebsocketBridge
from rosz.errors import UsageError
from rosz.session import keys_of

if TYPE_CHECKING:
    from rosz.node import Node

__all__ = ("HOLDER", "Settings", "open_bridge")

HOLDER = "websocket"
"""Name of the clients in the rules of a machine."""
_LAST_PORT = 65535


class Settings(msgspec.Struct, frozen=True, kw_only=True):
    """Settings of a bridge.

    Attributes:
        host: Address to listen at. Beyond this machine, clients need a password.
        port: Port to listen at; 0 for any.
        password_file: File whose first line is the password; empty for a random one.
        authenticate: Whether clients need a password also on this machine.
        fragment_size: Largest number of characters of a text that clients get whole; None for any.
        origins: Origins of pages that may connect without a password.
        read_only: Whether clients change nothing.
        topics: Patterns of the topics that clients see.
        services: Patterns of the services.
        params: Patterns of the parameters.
        spelling: Whose names a client gets that has not shown its own.
        certificate: Certificate for TLS, instead of that of the keys.
        key: Its private key.
    """

    host: str = "127.0.0.1"
    port: int = PORT
    password_file: str = ""
    authenticate: bool = False
    fragment_size: int | None = None
    origins: tuple[str, ...] = ()
    read_only: bool = False
    topics: tuple[str, ...] = ()
    services: tuple[str, ...] = ()
    params: tuple[str, ...] = ()
    spelling: Spelling = "ros1"
    certificate: str = ""
    key: str = ""


def open_bridge(node: Node, settings: Settings) -> tuple[WebsocketBridge, list[str]]:
    """Return a bridge, and lines that say where it is.

    Args:
        node: Node of the bridge.
        settings: The settings.

    Raises:
        TransportError: It cannot listen there.
        UsageError: A setting is not valid, or the library is not installed.
    """
    if not 0 <= settings.port <= _LAST_PORT:
        raise UsageError(f"port {settings.port}: expected 0 to {_LAST_PORT}")
    if bool(settings.certificate) != bool(settings.key):
        raise UsageError("a certificate for TLS and its private key go together: give both")
    local = is_loopback(settings.host)
    keys = keys_of(node.context.environment)
    password = ""
    if settings.password_file:
        password = read_password(Path(settings.password_file))
    elif settings.authenticate or not local:
        password = new_password()
    rules = keys.rules if keys else None
    bridge = WebsocketBridge(
        node,
        settings.host,
        settings.port,
        gate=Gate(
            None if rules is None else rules.permit_at_bridge(HOLDER),
            settings.read_only,
            settings.topics,
            settings.services,
            settings.params,
        ),
        admission=Admission(password, settings.origins),
        tls=server_tls(None if local else keys, settings.certificate, settings.key),
        spelling=settings.spelling,
        limits=Limits(fragment_size=settings.fragment_size),
    )
    return bridge, _describe(bridge, settings, password, secure=bool(keys and not local))


def _describe(
    bridge: WebsocketBridge, settings: Settings, password: str, *, secure: bool
) -> list[str]:
    scheme = "wss" if secure or settings.certificate else "ws"
    everywhere = settings.host in {"0.0.0.0", "::", ""}  # noqa: S104  # it is compared
    host = socket.gethostname() if everywhere else settings.host
    address = f"{scheme}://{f'[{host}]' if ':' in host else host}:{bridge.port}"
    if password and not settings.password_file:
        address += f"/?token={password}"
    lines = [f"rosbridge clients connect to {address}"]
    if password and scheme == "ws" and not is_loopback(settings.host):
        lines.append(
            "the password is sent unencrypted; keys (ROSZ_KEYS) or --certificate change that"
        )
    return lines
