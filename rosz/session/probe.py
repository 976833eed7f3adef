"""Looking whether anybody listens at an endpoint, without Zenoh."""

from __future__ import annotations

import socket

__all__ = ("is_answered",)

_TIMEOUT = 0.5


def is_answered(endpoint: str) -> bool:
    """Tell whether somebody accepts connections at a Zenoh endpoint of this machine.

    Args:
        endpoint: Such as ``tcp/localhost:7447`` or ``unixsock-stream//run/z.sock``; for a protocol
            without connections the answer is yes, as it cannot be known.
    """
    protocol, _, address = endpoint.partition("#")[0].partition("/")
    address = address.partition("?")[0]
    if protocol == "unixsock-stream":
        return _connects(socket.AF_UNIX, address)
    if protocol in {"tcp", "tls"}:
        host, _, port = address.rpartition(":")
        try:
            found = socket.getaddrinfo(host.strip("[]"), int(port), type=socket.SOCK_STREAM)
        except (OSError, ValueError):
            return False
        return any(_connects(family, place) for family, _, _, _, place in found)
    return True


def _connects(family: int, address: object) -> bool:
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.settimeout(_TIMEOUT)
        return probe.connect_ex(address) == 0  # type: ignore[arg-type]  # differs by family
