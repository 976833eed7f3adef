"""rosgraph.network: addresses of this machine, which programs show and log.

ROS 1's handshake and XML-RPC functions are not there: nothing here speaks them.
"""

from __future__ import annotations

import os
import socket
import sys
from urllib.parse import urlsplit

__all__ = (
    "get_address_override",
    "get_host_name",
    "get_local_address",
    "get_local_addresses",
    "is_local_address",
    "parse_http_host_and_port",
    "use_ipv6",
)

_NOWHERE = ("10.255.255.255", 1)
"""No packet goes there: a socket that is only connected tells which address it would use."""


def parse_http_host_and_port(url: str) -> tuple[str, int]:
    """Return host and port of an address such as ``http://localhost:11311/``.

    Raises:
        ValueError: It is no such address.
    """
    parts = urlsplit(url)
    if not parts.hostname:
        raise ValueError(f"not a valid URL: '{url}'")
    return parts.hostname, parts.port or 80


def get_address_override() -> str | None:
    """Return what ``__hostname:=``, ``__ip:=``, ``ROS_HOSTNAME`` or ``ROS_IP`` says; else None."""
    for word in sys.argv:
        if word.startswith(("__hostname:=", "__ip:=")):
            return word.partition(":=")[2]
    return os.environ.get("ROS_HOSTNAME") or os.environ.get("ROS_IP") or None


def get_host_name() -> str:
    """Return what others may call this machine."""
    override = get_address_override()
    if override:
        return override
    name = socket.gethostname()
    return get_local_address() if not name or name == "localhost" else name


def get_local_address() -> str:
    """Return the address that others most likely reach this machine at."""
    override = get_address_override()
    if override:
        return override
    found = [address for address in get_local_addresses() if not address.startswith("127.")]
    return found[0] if found else "127.0.0.1"


def get_local_addresses() -> list[str]:
    """Return the IPv4 addresses of this machine that can be told without further libraries."""
    found: dict[str, None] = {}
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(_NOWHERE)
            found[probe.getsockname()[0]] = None
        except OSError:  # a machine without a network
            pass
    try:
        known = socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)
    except OSError:  # a name that nobody resolves
        known = []
    found.update((str(entry[4][0]), None) for entry in known)
    return [*found, *(() if "127.0.0.1" in found else ("127.0.0.1",))]


def is_local_address(hostname: str) -> bool:
    """Tell whether a name or address means this machine."""
    try:
        known = {str(entry[4][0]) for entry in socket.getaddrinfo(hostname, None)}
    except OSError:
        return False
    return any(each.startswith("127.") or each == "::1" for each in known) or bool(
        known & set(get_local_addresses())
    )


def use_ipv6() -> bool:
    """Tell whether ``ROS_IPV6`` asks for IPv6."""
    return os.environ.get("ROS_IPV6") == "on"
