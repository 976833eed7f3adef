"""The checks of a request to connect: its password, and the origin of the page that makes it.

A browser sends the origin of the page that makes a request (``Origin``), and the host that it
believes to talk to (``Host``).
"""

from __future__ import annotations

import base64
import binascii
import hmac
import ipaddress
import threading
import time
from collections.abc import Callable, Mapping
from urllib.parse import parse_qs, urlsplit

_LOCAL = "localhost"
_FREE_GUESSES = 5
_LONGEST_PAUSE = 60.0
_FORGET_SECONDS = 900.0
_MOST_NETWORKS = 10_000


def is_loopback(host: str) -> bool:
    """Return whether a host or address is this machine alone."""
    if host == _LOCAL or host.endswith(f".{_LOCAL}"):
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def is_password(given: str, password: str) -> bool:
    """Return whether a text is the password; the time that it takes does not depend on either."""
    return hmac.compare_digest(given.encode(), password.encode())


class PasswordGuesses:
    """Slows those down who guess a password: each wrong one of a network doubles the pause.

    The network is an address of IPv4, or the /64 of an address of IPv6, since a host has all of
    that and may use another address for each guess.

    A few are free, since people mistype. In the pause the right one is refused, too: an answer
    would tell it from wrong ones.

    Args:
        clock: Function that returns the time in seconds.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._wrong: dict[str, tuple[int, float]] = {}
        """Number of wrong passwords and end of the pause, by network, in the order of use."""

    def pause(self, address: str, right: bool) -> float:
        """Count a password, and return the seconds for which it is refused, or 0.

        Args:
            address: Address that it comes from.
            right: Whether it is the right one.
        """
        network = _network_of(address)
        with self._lock:
            now = self._clock()
            count, until = self._wrong.get(network, (0, 0.0))
            if now < until:
                return until - now
            self._wrong.pop(network, None)
            if not right:
                count = 1 if now > until + _FORGET_SECONDS else count + 1
                doubled = 2.0 ** min(count - _FREE_GUESSES, 10)
                pause = min(doubled, _LONGEST_PAUSE) if count >= _FREE_GUESSES else 0.0
                self._wrong[network] = count, now + pause
                if len(self._wrong) > _MOST_NETWORKS:
                    del self._wrong[next(iter(self._wrong))]
            return 0.0


def _network_of(address: str) -> str:
    """Return the network whose wrong passwords count together; other texts are unchanged."""
    try:
        parsed = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return address
    if not isinstance(parsed, ipaddress.IPv6Address):
        return address
    if parsed.ipv4_mapped is not None:
        return str(parsed.ipv4_mapped)
    return str(ipaddress.ip_network((int(parsed) >> 64 << 64, 64)))


def password_in(path: str, headers: Mapping[str, str]) -> str:
    """Return the password in a request: in ``?token=``, or as Basic or Bearer authorization.

    Raises:
        ValueError: The path is malformed.
    """
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


def origin_objection(origin: str, origins: tuple[str, ...]) -> str:
    """Return why pages of an origin may not connect to a bridge; empty if they may.

    Args:
        origin: Origin of the page; empty if the client is not a page.
        origins: Origins that may connect beside those of this machine; ``*`` for all.

    Raises:
        ValueError: The origin is malformed.
    """
    if not origin or "*" in origins or origin in origins:
        return ""
    parts = urlsplit(origin)
    if parts.scheme != "file" and is_loopback(parts.hostname or ""):
        return ""
    return (
        f"pages of '{origin}' may not connect; --origin '{origin}' lets them, and a password does"
    )


def page_objection(host: str, origin: str, *, local: bool) -> str:
    """Return why a request may not use the page; empty if it may.

    Only the page itself may. A foreign host name that leads to this machine is refused as well,
    because a page from there would have the same origin.

    Args:
        host: Host that the browser believes to talk to.
        origin: Origin of the page that makes the request; empty if there is none.
        local: Whether the page is served at loopback addresses only.

    Raises:
        ValueError: The host or the origin is malformed.
    """
    if local and not is_loopback(urlsplit(f"//{host}").hostname or ""):
        return (
            f"'{host}' is not this machine alone: open the page as localhost, or start it with"
            " --listen to reach it from other machines"
        )
    if origin and urlsplit(origin).netloc != host:
        return f"pages of '{origin}' may not use this page"
    return ""
