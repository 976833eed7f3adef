"""Check whether a client may connect to a bridge: its password, or the origin of its page."""

from __future__ import annotations

import base64
import binascii
import hmac
import ipaddress
import secrets
import ssl
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

import msgspec

from rosz.errors import UsageError

if TYPE_CHECKING:
    from rosz.security import KeyFolder

__all__ = ("Admission", "is_loopback", "new_password", "read_password", "server_tls")

_LOCAL = "localhost"


class Admission(msgspec.Struct, frozen=True):
    """The conditions under which a client may connect.

    A browser sends the origin of the page that opens a connection. Pages of this machine and of
    the listed origins may connect. Clients that send the password may connect from any page.

    Attributes:
        password: Password of the clients; empty if they need none.
        origins: Origins of pages that may connect without it, such as ``http://robot:8000``; ``*``
            for all, ``null`` for pages that are files.
    """

    password: str = ""
    origins: tuple[str, ...] = ()

    def objection(self, path: str, headers: Mapping[str, str]) -> str:
        """Return why a request may not connect; empty if it may.

        Args:
            path: Path and query of the request.
            headers: Its headers.
        """
        given = _given(path, headers)
        if self.password:
            if given and not self._is_password(given):
                return "the password is wrong"
            if given:
                return ""
        origin = headers.get("Origin", "")
        if origin and not self._is_welcome(origin):
            return (
                f"pages of '{origin}' may not connect; --origin '{origin}' lets them,"
                " and a password does"
            )
        return ""

    def is_known(self, request: Any) -> bool:
        """Return whether a request shows the password, or needs none."""
        if not self.password:
            return True
        given = _given(request.path, request.headers)
        return bool(given) and self._is_password(given)

    def _is_password(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), self.password.encode())

    def _is_welcome(self, origin: str) -> bool:
        if "*" in self.origins or origin in self.origins:
            return True
        host = urlsplit(origin).hostname or ""
        return is_loopback(host)


def _given(path: str, headers: Mapping[str, str]) -> str:
    """Return the password in a request: in ``?token=``, or as Basic or Bearer authorization."""
    query = parse_qs(urlsplit(path).query)
    if query.get("token"):
        return query["token"][0]
    scheme, _, value = headers.get("Authorization", "").partition(" ")
    if scheme.lower() == "bearer":
        return value.strip()
    if scheme.lower() == "basic":
        try:
            return base64.b64decode(value, validate=True).decode().partition(":")[2]
        except (binascii.Error, UnicodeDecodeError):
            return ""
    return ""


def is_loopback(host: str) -> bool:
    """Return whether a host or address is this machine alone."""
    if host == _LOCAL or host.endswith(f".{_LOCAL}"):
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def new_password() -> str:
    """Return a random password."""
    return secrets.token_urlsafe(18)


def read_password(file: Path) -> str:
    """Return the first line of a file.

    Raises:
        UsageError: The file cannot be read, or is empty.
    """
    try:
        password = file.read_text().partition("\n")[0].strip()
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"cannot read the password in '{file}': {error}") from error
    if not password:
        raise UsageError(f"'{file}' has no password in its first line")
    return password


def server_tls(
    keys: KeyFolder | None, certificate: str = "", key: str = ""
) -> ssl.SSLContext | None:
    """Return the settings of TLS for a server.

    Args:
        keys: Keys of the machine.
        certificate: File of another certificate.
        key: File of its private key.

    Returns:
        An SSL context, or None if neither keys nor a certificate are given.

    Raises:
        UsageError: A file cannot be read, or is not a certificate or key.
    """
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
