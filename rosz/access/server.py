"""The settings that bridges and the page share, and the access that they grant."""

from __future__ import annotations

import secrets
import socket
import ssl
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from rosz.access.connecting import is_loopback
from rosz.access.policy import AccessPolicy
from rosz.errors import UsageError
from rosz.session import keys_of, present_loopback

if TYPE_CHECKING:
    from rosz.node import Node
    from rosz.security import KeyFolder

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


class ServerAccess(msgspec.Struct, frozen=True):
    """The address of a server, its password and origins, and the rights of its clients.

    Attributes:
        host: Address that it listens at.
        policy: Access policy of the clients.
        shown: Whether the password is part of the address, as no file has it.
        tls: Settings of TLS, if links are encrypted.
    """

    host: str = "127.0.0.1"
    policy: AccessPolicy = AccessPolicy()
    shown: bool = False
    tls: ssl.SSLContext | None = None

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
        password = self.policy.password
        lines = [f"{address}/?token={password}" if self.shown else address]
        if password and self.tls is None and not is_loopback(self.host):
            lines.append(
                "the password is sent unencrypted; keys (ROSZ_KEYS) or --certificate change that"
            )
        return lines


def open_access(
    node: Node,
    settings: ServerSettings,
    holder: str,
    policy: AccessPolicy = AccessPolicy(),  # noqa: B008  # frozen
    *,
    authenticate: bool = False,
) -> ServerAccess:
    """Return the access that settings and the keys of the machine grant.

    Args:
        node: Node of the server.
        settings: The settings.
        holder: Name of the clients in the rules of the machine.
        policy: The policy without password and rules, which are added.
        authenticate: Whether clients need a password also on this machine.

    Raises:
        UsageError: A setting is not valid.
    """
    if not 0 <= settings.port <= _LAST_PORT:
        raise UsageError(f"port {settings.port}: expected 0 to {_LAST_PORT}")
    if bool(settings.certificate) != bool(settings.key):
        raise UsageError("a certificate for TLS and its private key go together: give both")
    host = present_loopback(settings.host)
    local = is_loopback(host)
    keys = keys_of(node.context.environment)
    password = ""
    if settings.password_file:
        password = _read_password(Path(settings.password_file))
    elif authenticate or not local:
        password = secrets.token_urlsafe(18)
    rules = keys.rules if keys else None
    policy = msgspec.structs.replace(
        policy,
        permit=None if rules is None else rules.permit_at_bridge(holder),
        read_only=settings.read_only,
        password=password,
    )
    tls = _server_tls(None if local else keys, settings.certificate, settings.key)
    return ServerAccess(host, policy, bool(password) and not settings.password_file, tls)


def _read_password(file: Path) -> str:
    """Return the first line of a file."""
    try:
        password = file.read_text().partition("\n")[0].strip()
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"cannot read the password in '{file}': {error}") from error
    if not password:
        raise UsageError(f"'{file}' has no password in its first line")
    return password


def _server_tls(keys: KeyFolder | None, certificate: str, key: str) -> ssl.SSLContext | None:
    """Return the settings of TLS with a certificate, or else that of keys; None without both."""
    if certificate or key:
        files = certificate, key
    elif keys is not None:
        files = str(keys.certificate), str(keys.key)
    else:
        return None
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    # A ticket comes while clients send their first request. A client in Python that receives on one
    # thread and sends on another can lose the request then, since OpenSSL has no lock for them.
    context.num_tickets = 0
    try:
        context.load_cert_chain(*files)
    except (OSError, ValueError) as error:
        raise UsageError(f"cannot use '{files[0]}' and '{files[1]}' for TLS: {error}") from error
    return context
