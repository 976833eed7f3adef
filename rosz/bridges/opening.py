"""Settings that all servers for web clients share, and the access that they grant."""

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
from rosz.security import Permit
from rosz.session import keys_of

if TYPE_CHECKING:
    from rosz.node import Node

__all__ = ("Access", "BridgeSettings", "Entrance", "ServerSettings", "entrance", "grant_access")

_LAST_PORT = 65535


class ServerSettings(msgspec.Struct, frozen=True, kw_only=True):
    """Settings of a server.

    Attributes:
        port: Port to listen at; 0 for any.
        host: Address to listen at. Beyond this machine, clients need a password.
        password_file: File whose first line is the password; empty for a random one.
        read_only: Whether clients change nothing.
        certificate: Certificate for TLS, instead of that of the keys.
        key: Its private key.
    """

    port: int
    host: str = "127.0.0.1"
    password_file: str = ""
    read_only: bool = False
    certificate: str = ""
    key: str = ""


class BridgeSettings(ServerSettings, frozen=True, kw_only=True):
    """Settings of a bridge.

    Attributes:
        authenticate: Whether clients need a password also on this machine.
        origins: Origins of pages that may connect without a password.
        topics: Patterns of the topics that clients see.
        services: Patterns of the services.
        params: Patterns of the parameters.
        published: Patterns of the topics that clients publish.
    """

    authenticate: bool = False
    origins: tuple[str, ...] = ()
    topics: tuple[Pattern, ...] = ()
    services: tuple[Pattern, ...] = ()
    params: tuple[Pattern, ...] = ()
    published: tuple[Pattern, ...] = ()


class Access(msgspec.Struct, frozen=True):
    """Conditions under which clients may connect to a server.

    Attributes:
        host: Address that it listens at.
        password: The password of the clients; empty if they need none.
        shown: Whether the password is part of the address, as no file has it.
        tls: Settings of TLS, if links are encrypted.
        permit: Permissions of the clients by the rules of the machine; None without rules.
    """

    host: str = "127.0.0.1"
    password: str = ""
    shown: bool = False
    tls: ssl.SSLContext | None = None
    permit: Permit | None = None

    def describe(self, protocol: str, port: int) -> list[str]:
        """Return the address of the server, and lines that say more.

        Args:
            protocol: ``ws`` or ``http``.
            port: Port that it listens at.
        """
        everywhere = self.host in {"0.0.0.0", "::", ""}  # noqa: S104  # it is compared
        name = socket.gethostname() if everywhere else self.host
        scheme = protocol if self.tls is None else f"{protocol}s"
        address = f"{scheme}://{f'[{name}]' if ':' in name else name}:{port}"
        lines = [f"{address}/?token={self.password}" if self.shown else address]
        if self.password and self.tls is None and not is_loopback(self.host):
            lines.append(
                "the password is sent unencrypted; keys (ROSZ_KEYS) or --certificate change that"
            )
        return lines


def grant_access(
    node: Node, settings: ServerSettings, holder: str, *, authenticate: bool = False
) -> Access:
    """Return who may connect, by settings and the keys of the machine.

    Args:
        node: Node of the server.
        settings: The settings.
        holder: Name of the clients in the rules of the machine.
        authenticate: Whether clients need a password also on this machine.

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
    elif authenticate or not local:
        password = new_password()
    rules = keys.rules if keys else None
    return Access(
        settings.host,
        password,
        bool(password) and not settings.password_file,
        server_tls(None if local else keys, settings.certificate, settings.key),
        None if rules is None else rules.permit_at_bridge(holder),
    )


class Entrance(msgspec.Struct, frozen=True):
    """The conditions under which clients of a bridge connect, and what they may do.

    By default clients of this machine may do everything.

    Attributes:
        access: Who may connect, and how.
        gate: Permissions of the clients.
        admission: Conditions under which they may connect.
    """

    access: Access = Access()
    gate: Gate = Gate()
    admission: Admission = Admission()

    def describe(self, clients: str, port: int) -> list[str]:
        """Return lines that say where clients connect to.

        Args:
            clients: The clients, as in ``rosbridge clients connect``.
            port: Port that the bridge listens at.
        """
        address, *more = self.access.describe("ws", port)
        return [f"{clients} to {address}", *more]


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
    access = grant_access(node, settings, holder, authenticate=settings.authenticate)
    gate = Gate(
        access.permit,
        settings.read_only,
        settings.topics,
        settings.services,
        settings.params,
        settings.published,
    )
    return Entrance(access, gate, Admission(access.password, (*origins, *settings.origins)))
