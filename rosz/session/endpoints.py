"""Where to listen and where to connect, by the network interfaces of this machine."""

from __future__ import annotations

import socket
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

from rosz.wire import Endpoint

__all__ = ("connect_endpoint", "listen_endpoints", "loopback_interfaces")

_INTERFACES = Path("/sys/class/net")
_LOOPBACK = "772"
"""The type of a loopback interface on Linux (ARPHRD_LOOPBACK)."""


def connect_endpoint(text: str) -> str:
    """Return the endpoint to connect to where links beyond this machine need keys.

    A machine that is told to connect to itself, as when several machines share one setting, uses
    the loopback.

    Args:
        text: The endpoint as it was configured.

    Raises:
        UsageError: The protocol cannot use keys.
    """
    endpoint = Endpoint(text).secured()
    if endpoint.protocol == "tls" and endpoint.port is not None and _is_own(endpoint.host):
        return str(Endpoint.of("tcp", "localhost", endpoint.port))
    return str(endpoint)


def listen_endpoints(
    rendezvous: str, listen: Sequence[str], *, keys: bool = False
) -> tuple[str, ...]:
    """Return where to listen so that the rendezvous is held at all addresses of its name.

    ``tcp/0.0.0.0:7447`` includes ``127.0.0.1:7447``, and a second listener there would fail. Where
    ``localhost`` is also ``::1``, that address has to be held too, or the next node would hold it.
    With keys, one port serves this machine without TLS and other machines with TLS. Linux lets both
    listeners share the port when each is bound to its network interfaces.

    Args:
        rendezvous: The endpoint where the sessions of this machine meet.
        listen: Further endpoints.
        keys: Whether links beyond the machine need keys.

    Raises:
        UsageError: A protocol cannot use keys.
    """
    meeting, others = Endpoint(rendezvous), [Endpoint(text) for text in listen]
    if keys:
        meeting, others = meeting.secured(), [endpoint.secured() for endpoint in others]
    wide = [endpoint for endpoint in others if _covers(endpoint, meeting.port)]
    held = _tcp_endpoints(meeting) if wide and meeting.protocol == "tcp" else []
    if not held:
        return _texts(meeting, *others)
    if any(endpoint.protocol == "tls" for endpoint in wide) and sys.platform == "linux":
        split = [
            one
            for endpoint in others
            for one in (_on_each_interface(endpoint) if endpoint in wide else [endpoint])
        ]
        own = [one.on_interface(name) for one in held for name in loopback_interfaces()]
        return _texts(*split, *own)
    all_v4 = any(endpoint.host == "0.0.0.0" for endpoint in wide)  # noqa: S104
    all_v6 = any(endpoint.host == "::" for endpoint in wide)  # on Linux, it serves IPv4 as well
    rest = [one for one in held if not (all_v6 or (all_v4 and one.host.startswith("127.")))]
    return _texts(*others, *rest)


def loopback_interfaces() -> list[str]:
    """Return the names of the network interfaces whose traffic stays on this machine."""
    names = [name for _, name in socket.if_nameindex()]
    if not _INTERFACES.is_dir():
        return [name for name in names if name.startswith("lo0")]
    return [name for name in names if _interface_type(name) == _LOOPBACK]


def _texts(*endpoints: Endpoint) -> tuple[str, ...]:
    return tuple(dict.fromkeys(map(str, endpoints)))


def _covers(endpoint: Endpoint, port: int | None) -> bool:
    """Tell whether an endpoint is a port at all addresses of this machine."""
    return (
        endpoint.is_tcp
        and endpoint.is_any_address
        and endpoint.port == port
        and not endpoint.configuration
    )


def _on_each_interface(endpoint: Endpoint) -> Iterator[Endpoint]:
    """Yield an endpoint of all addresses once for each interface to other machines."""
    for _, name in socket.if_nameindex():
        # An interface that is part of a bridge has no addresses of its own.
        if _interface_type(name) != _LOOPBACK and not (_INTERFACES / name / "master").exists():
            yield endpoint.on_interface(name)


def _interface_type(name: str) -> str:
    try:
        return (_INTERFACES / name / "type").read_text().strip()
    except OSError:  # the interface is gone
        return ""


def _tcp_endpoints(endpoint: Endpoint) -> list[Endpoint]:
    """Return an endpoint once for each address of its host name."""
    if (port := endpoint.port) is None:
        return []
    return [Endpoint.of("tcp", address, port) for address in _addresses(endpoint.host)]


def _addresses(host: str) -> list[str]:
    try:
        found = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)
    except (OSError, ValueError):  # Zenoh's own error says what is wrong with the host
        return []
    return list(dict.fromkeys(str(entry[4][0]) for entry in found))


def _is_own(host: str) -> bool:
    """Tell whether all addresses of a host name belong to this machine."""
    addresses = _addresses(host)
    return bool(addresses) and all(map(_can_bind, addresses))


def _can_bind(address: str) -> bool:
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    with suppress(OSError), socket.socket(family, socket.SOCK_DGRAM) as probe:
        probe.bind((address, 0))
        return True
    return False
