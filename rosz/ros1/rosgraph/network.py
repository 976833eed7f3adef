"""rosgraph.network: the addresses of this machine.

The handshake and XML-RPC functions of ROS 1 are missing, since rosz does not use these protocols.
"""

from __future__ import annotations

import os
import socket
from urllib.parse import urlsplit

from rosz.ros1.rosgraph.names import find_option

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
"""No packet is sent there: connecting a UDP socket only chooses the local address."""


def parse_http_host_and_port(url: str) -> tuple[str, int]:
    """Return host and port of a URL such as ``http://localhost:11311/``.

    Raises:
        ValueError: The text is not such a URL.
    """
    parts = urlsplit(url)
    if not parts.hostname:
        raise ValueError(f"not a valid URL: '{url}'")
    return parts.hostname, parts.port or 80


def get_address_override() -> str | None:
    """Return the value of ``__hostname:=``, ``__ip:=``, ``ROS_HOSTNAME`` or ``ROS_IP``, or None."""
    given = find_option(("__hostname:=", "__ip:="))
    if given is not None:
        return given
    return os.environ.get("ROS_HOSTNAME") or os.environ.get("ROS_IP") or None


def get_host_name() -> str:
    """Return the name by which other machines reach this one."""
    override = get_address_override()
    if override:
        return override
    name = socket.gethostname()
    return get_local_address() if not name or name == "localhost" else name


def get_local_address() -> str:
    """Return the address by which other machines most likely reach this one."""
    override = get_address_override()
    if override:
        return override
    found = [address for address in get_local_addresses() if not address.startswith("127.")]
    return found[0] if found else "127.0.0.1"


def get_local_addresses() -> list[str]:
    """Return the IPv4 addresses of this machine that the standard library can find."""
    found: dict[str, None] = {}
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(_NOWHERE)
            found[probe.getsockname()[0]] = None
        except OSError:  # no network
            pass
    try:
        known = socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)
    except OSError:  # the name cannot be resolved
        known = []
    found.update((str(entry[4][0]), None) for entry in known)
    return [*found, *(() if "127.0.0.1" in found else ("127.0.0.1",))]


def is_local_address(hostname: str) -> bool:
    """Return whether a name or address is that of this machine."""
    try:
        known = {str(entry[4][0]) for entry in socket.getaddrinfo(hostname, None)}
    except OSError:
        return False
    return any(each.startswith("127.") or each == "::1" for each in known) or bool(
        known & set(get_local_addresses())
    )


def use_ipv6() -> bool:
    """Return whether ``ROS_IPV6`` is on."""
    return os.environ.get("ROS_IPV6") == "on"
