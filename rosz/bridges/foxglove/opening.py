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
from rosz.bridges.foxglove.server import PORT, FoxgloveBridge, Limits, Offer
from rosz.bridges.gate import Gate, Pattern
from rosz.errors import UsageError
from rosz.session import keys_of

if TYPE_CHECKING:
    from rosz.node import Node

__all__ = ("HOLDER", "Settings", "open_bridge")

HOLDER = "foxglove"
"""Name of the clients in the rules of a machine."""

_APPS = ("https://app.foxglove.dev", "https://app.foxglove.com", "file://")
"""Origins of Foxglove in a browser, and of Foxglove and Lichtblick as programs."""

_LAST_PORT = 65535


class Settings(msgspec.Struct, frozen=True, kw_only=True):
    """Settings of a bridge.

    Attributes:
        host: Address to listen at. Beyond this machine, clients need a password.
        port: Port to listen at; 0 for any.
        password_file: File whose first line is the password; empty for a random one.
        origins: Origins of pages that may connect without a password, beside Foxglove's own.
        read_only: Whether clients change nothing.
        topics: Patterns of the topics that clients see.
        services: Patterns of the services.
        params: Patterns of the parameters.
        published: Patterns of the topics that clients publish.
        certificate: Certificate for TLS, instead of that of the keys.
        key: Its private key.
        limits: How much clients may take.
        offer: What the bridge offers.
    """

    host: str = "127.0.0.1"
    port: int = PORT
    password_file: str = ""
    origins: tuple[str, ...] = ()
    read_only: bool = False
    topics: tuple[Pattern, ...] = ()
    services: tuple[Pattern, ...] = ()
    params: tuple[Pattern, ...] = ()
    published: tuple[Pattern, ...] = ()
    certificate: str = ""
    key: str = ""
    limits: Limits = Limits()
    offer: Offer = Offer()


def open_bridge(node: Node, settings: Settings) -> tuple[FoxgloveBridge, list[str]]:
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
    elif not local:
        password = new_password()
    rules = keys.rules if keys else None
    bridge = FoxgloveBridge(
        node,
        settings.host,
        settings.port,
        gate=Gate(
            None if rules is None else rules.permit_at_bridge(HOLDER),
            settings.read_only,
            settings.topics,
            settings.services,
            settings.params,
            settings.published,
        ),
        admission=Admission(password, (*_APPS, *settings.origins)),
        tls=server_tls(None if local else keys, settings.certificate, settings.key),
        limits=settings.limits,
        offer=settings.offer,
    )
    return bridge, _describe(bridge, settings, password, secure=bool(keys and not local))


def _describe(
    bridge: FoxgloveBridge, settings: Settings, password: str, *, secure: bool
) -> list[str]:
    scheme = "wss" if secure or settings.certificate else "ws"
    everywhere = settings.host in {"0.0.0.0", "::", ""}  # noqa: S104  # it is compared
    host = socket.gethostname() if everywhere else settings.host
    address = f"{scheme}://{f'[{host}]' if ':' in host else host}:{bridge.port}"
    if password and not settings.password_file:
        address += f"/?token={password}"
    lines = [f"Foxglove connects to {address}"]
    if password and scheme == "ws":
        lines.append(
            "the password is sent unencrypted; keys (ROSZ_KEYS) or --certificate change that"
        )
    return lines
