"""Where to listen and to connect: which endpoints stay on the machine, and which need keys."""

from __future__ import annotations

import socket
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from rosz.errors import UsageError

__all__ = ("dialled", "is_local", "listening", "loopback", "secured")

_EVERYWHERE = {"0.0.0.0": "127.", "[::]": ""}  # noqa: S104  # told apart, not listened at
"""Addresses that mean all of the machine's, with what those of the machine alone begin with."""
_INTERFACES = Path("/sys/class/net")
_LOOPBACK = "772"
"""What Linux calls the kind of such an interface (ARPHRD_LOOPBACK)."""


class _Parts(NamedTuple):
    protocol: str
    host: str
    port: str


def is_local(endpoint: str) -> bool:
    """Tell whether an endpoint stays on this machine, by what it says."""
    protocol, host, _ = _parts(endpoint)
    host = host.strip("[]")
    return protocol.startswith("unix") or host in {"localhost", "::1"} or host.startswith("127.")


def secured(endpoint: str) -> str:
    """Return what an endpoint is called where links beyond the machine need keys.

    Raises:
        UsageError: Its protocol knows none.
    """
    protocol, _, place = endpoint.partition("/")
    if protocol in {"tls", "unixsock-stream"} or (protocol == "tcp" and is_local(endpoint)):
        return endpoint
    if protocol == "tcp":
        return f"tls/{place}"
    raise UsageError(
        f"'{endpoint}': with ROSZ_KEYS, links beyond this machine are tls; expected 'tls/{place}'"
    )


def dialled(endpoint: str) -> str:
    """Return what to connect to where links beyond the machine need keys.

    A machine that is told to connect to itself, as all of several machines may be, stays at home.

    Raises:
        UsageError: Its protocol knows no keys.
    """
    place = secured(endpoint)
    protocol, host, port = _parts(place)
    return f"tcp/localhost:{port}" if protocol == "tls" and _is_own(host) else place


def listening(rendezvous: str, listen: Sequence[str], *, keys: bool = False) -> tuple[str, ...]:
    """Return where to listen so that the rendezvous is held at all addresses of its name.

    ``tcp/0.0.0.0:7447`` holds ``127.0.0.1:7447`` already, and nobody can listen there twice; but
    where ``localhost`` is ``::1`` as well, that has to be held too, or the next node would. With
    keys the port is plain for this machine and TLS for others: Linux has them share it when each
    keeps to its network interfaces, whatever addresses these have or will have.

    Args:
        rendezvous: Where the sessions of this machine meet.
        listen: Further endpoints.
        keys: Whether links beyond the machine need keys.

    Raises:
        UsageError: A protocol knows no keys.
    """
    if keys:
        rendezvous, listen = secured(rendezvous), [secured(endpoint) for endpoint in listen]
    protocol, host, port = _parts(rendezvous)
    wide = {endpoint for endpoint in listen if _is_wide(endpoint, port)}
    addresses = _addresses(host, port) if wide and protocol == "tcp" else []
    if not addresses:
        return tuple(dict.fromkeys((rendezvous, *listen)))
    if any(endpoint.startswith("tls/") for endpoint in wide) and sys.platform == "linux":
        parted = [one for endpoint in listen for one in _parted(endpoint, endpoint in wide)]
        own = [f"tcp/{one}:{port}#iface={name}" for one in addresses for name in loopback()]
        return tuple(dict.fromkeys((*parted, *own)))
    held = tuple(_EVERYWHERE[_parts(endpoint).host] for endpoint in wide)
    rest = [f"tcp/{one}:{port}" for one in addresses if not one.startswith(held)]
    return tuple(dict.fromkeys((*listen, *rest)))


def loopback() -> list[str]:
    """Return the network interfaces that lead nowhere else."""
    names = [name for _, name in socket.if_nameindex()]
    if not _INTERFACES.is_dir():
        return [name for name in names if name.startswith("lo0")]
    return [name for name in names if _kind(name) == _LOOPBACK]


def _parts(endpoint: str) -> _Parts:
    protocol, _, place = endpoint.partition("#")[0].partition("/")
    host, _, port = place.partition("?")[0].rpartition(":")
    return _Parts(protocol, host, port)


def _is_wide(endpoint: str, port: str) -> bool:
    """Tell whether an endpoint is a port at all addresses."""
    protocol, host, at = _parts(endpoint)
    return protocol in {"tcp", "tls"} and host in _EVERYWHERE and at == port and "#" not in endpoint


def _parted(endpoint: str, wide: bool) -> Iterator[str]:
    """Yield an endpoint of all addresses once for each network interface that leads somewhere."""
    if not wide:
        yield endpoint
        return
    for _, name in socket.if_nameindex():
        # Part of a bridge, it has no addresses of its own.
        if _kind(name) != _LOOPBACK and not (_INTERFACES / name / "master").exists():
            yield f"{endpoint}#iface={name}"


def _kind(interface: str) -> str:
    try:
        return (_INTERFACES / interface / "type").read_text().strip()
    except OSError:  # it is gone
        return ""


def _addresses(host: str, port: str) -> list[str]:
    try:
        found = socket.getaddrinfo(host.strip("[]"), int(port), type=socket.SOCK_STREAM)
    except (OSError, ValueError):  # Zenoh says better what is wrong with it
        return []
    names = dict.fromkeys(str(entry[4][0]) for entry in found)
    return [f"[{name}]" if ":" in name else name for name in names]


def _is_own(host: str) -> bool:
    """Tell whether a name is of this machine, however others reach it there."""
    found = _addresses(host, "0")
    return bool(found) and all(map(_can_bind, found))


def _can_bind(address: str) -> bool:
    family = socket.AF_INET6 if address.startswith("[") else socket.AF_INET
    with suppress(OSError), socket.socket(family, socket.SOCK_DGRAM) as probe:
        probe.bind((address.strip("[]"), 0))
        return True
    return False
