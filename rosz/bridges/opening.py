"""What the settings of all bridges for websocket clients have in common."""

from __future__ import annotations

import socket
import ssl
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
from rosz.bridges.gate import Gate, Pattern
from rosz.errors import UsageError
from rosz.session import keys_of

if TYPE_CHECKING:
    from rosz.node import Node

__all__ = ("BridgeSettings", "Entrance", "entrance")

_LAST_PORT = 65535


class BridgeSettings(msgspec.Struct, frozen=True, kw_only=True):
    """Settings of a bridge.

    Attributes:
        port: Port to listen at; 0 for any.
        host: Address to listen at. Beyond this machine, clients need a password.
        password_file: File whose first line is the password; empty for a random one.
        authenticate: Whether clients need a password also on this machine.
        origins: Origins of pages that may connect without a password.
        read_only: Whether clients change nothing.
        topics: Patterns of the topics that clients see.
        services: Patterns of the services.
        params: Patterns of the parameters.
        published: Patterns of the topics that clients publish.
        certificate: Certificate for TLS, instead of that of the keys.
        key: Its private key.
    """

    port: int
    host: str = "127.0.0.1"
    password_file: str = ""
    authenticate: bool = False
    origins: tuple[str, ...] = ()
    read_only: bool = False
    topics: tuple[Pattern, ...] = ()
    services: tuple[Pattern, ...] = ()
    params: tuple[Pattern, ...] = ()
    published: tuple[Pattern, ...] = ()
    certificate: str = ""
    key: str = ""


class Entrance(msgspec.Struct, frozen=True):
    """The conditions under which clients connect, and what they may do.

    Attributes:
        gate: Permissions of the clients.
        admission: Conditions under which they may connect.
        tls: Settings of TLS, if links are encrypted.
        shown: Whether the password is part of the address, as no file has it.
    """

    gate: Gate
    admission: Admission
    tls: ssl.SSLContext | None
    shown: bool

    def describe(self, clients: str, host: str, port: int) -> list[str]:
        """Return lines that say where clients connect to.

        Args:
            clients: The clients, as in ``rosbridge clients connect``.
            host: Address that the bridge listens at.
            port: Port that it listens at.
        """
        everywhere = host in {"0.0.0.0", "::", ""}  # noqa: S104  # it is compared
        name = socket.gethostname() if everywhere else host
        scheme = "ws" if self.tls is None else "wss"
        address = f"{scheme}://{f'[{name}]' if ':' in name else name}:{port}"
        if self.shown:
            address += f"/?token={self.admission.password}"
        lines = [f"{clients} to {address}"]
        if self.admission.password and self.tls is None and not is_loopback(host):
            lines.append(
                "the password is sent unencrypted; keys (ROSZ_KEYS) or --certificate change that"
            )
        return lines


def entrance(
    node: Node, settings: BridgeSettings, holder: str, origins: tuple[str, ...] = ()
) -> Entrance:
    """Return the conditions that settings and the keys of the machine make.

    Args:
        node: Node of the bridge.
        settings: The settings.
        holder: Name of the clients in the rules of the machine.
        origins: Origins of pages that may connect always.

    Raises:
        UsageError: A setting is not valid.
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
    gate = Gate(
        None if rules is None else rules.permit_at_bridge(holder),
        settings.read_only,
        settings.topics,
        settings.services,
        settings.params,
        settings.published,
    )
    return Entrance(
        gate,
        Admission(password, (*origins, *settings.origins)),
        server_tls(None if local else keys, settings.certificate, settings.key),
        bool(password) and not settings.password_file,
    )
