"""rosgraph.network: the addresses of this machine.

The handshakes of TCPROS are texts here; rosz itself does not use that protocol.
"""

from __future__ import annotations

import os
import socket
import struct
from collections.abc import Mapping
from urllib.parse import urlsplit

from rosz.ros1.tools.rosgraph.names import find_option

_NOWHERE = ("10.255.255.255", 1)
"""No packet is sent there: connecting a UDP socket only chooses the local address."""


class ROSHandshakeException(Exception):
    """A header of TCPROS is damaged."""


def encode_ros_handshake_header(header: Mapping[str, str]) -> bytes:
    """Return the bytes of a header of TCPROS: lengths, names and values."""
    fields = [f"{name}={value}".encode() for name, value in header.items()]
    body = b"".join(struct.pack("<I", len(field)) + field for field in fields)
    return struct.pack("<I", len(body)) + body


def decode_ros_handshake_header(header_str: bytes) -> dict[str, str]:
    """Return the fields of a header of TCPROS.

    Raises:
        ROSHandshakeException: The bytes are damaged.
    """
    fields: dict[str, str] = {}
    try:
        (end,) = struct.unpack_from("<I", header_str)
        at, end = 4, end + 4
        if end > len(header_str):
            raise ROSHandshakeException(f"expected {end} bytes, got {len(header_str)}")
        while at < end:
            (size,) = struct.unpack_from("<I", header_str, at)
            at += 4 + size
            if at > end:
                raise ROSHandshakeException("a field is longer than the header")
            name, equals, value = header_str[at - size : at].decode().partition("=")
            if not equals:
                raise ROSHandshakeException(f"field '{name}' has no value")
            fields[name] = value
    except (struct.error, UnicodeDecodeError) as error:
        raise ROSHandshakeException(f"the header is damaged: {error}") from error
    return fields


def create_local_xmlrpc_uri(port: int) -> str:
    """Return the URI of an XML-RPC server of this machine."""
    return f"http://{get_host_name()}:{port}/"


def get_bind_address(address: str | None = None) -> str:
    """Return the address at which a server of this machine should listen.

    Args:
        address: The address by which others reach it; by the environment when not given.
    """
    own = address or get_address_override()
    loopback = own is not None and (own == "localhost" or own.startswith("127."))
    return "127.0.0.1" if loopback else "0.0.0.0"  # noqa: S104  # what ROS 1 answers


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
    name = get_address_override() or socket.gethostname()
    return get_local_address() if name in {"", "localhost"} else name


def get_local_address() -> str:
    """Return the address by which other machines most likely reach this one."""
    override = get_address_override()
    if override:
        return override
    addresses = [address for address in get_local_addresses() if not address.startswith("127.")]
    return addresses[0] if addresses else "127.0.0.1"


def get_local_addresses() -> list[str]:
    """Return the IPv4 addresses of this machine that the standard library can find."""
    addresses: dict[str, None] = {}
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(_NOWHERE)
            addresses[probe.getsockname()[0]] = None
        except OSError:  # no network
            pass
    try:
        entries = socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)
    except OSError:  # the name cannot be resolved
        entries = []
    addresses.update((str(entry[4][0]), None) for entry in entries)
    return [*addresses, *(() if "127.0.0.1" in addresses else ("127.0.0.1",))]


def is_local_address(hostname: str) -> bool:
    """Return whether a name or address is that of this machine."""
    try:
        addresses = {str(entry[4][0]) for entry in socket.getaddrinfo(hostname, None)}
    except OSError:
        return False
    return any(each.startswith("127.") or each == "::1" for each in addresses) or bool(
        addresses & set(get_local_addresses())
    )


def use_ipv6() -> bool:
    """Return whether ``ROS_IPV6`` is on."""
    return os.environ.get("ROS_IPV6") == "on"
