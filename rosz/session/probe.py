"""Looking whether anybody listens at an endpoint, without Zenoh."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Sequence

__all__ = ("first_answered", "is_answered")

_TIMEOUT = 0.5
_AGAIN_SECONDS = 0.1
_GRACE_SECONDS = 0.3
"""How long an endpoint that is less wanted waits for word of one that is wanted more."""


def first_answered(endpoints: Sequence[str], timeout: float) -> str:
    """Return the first of some endpoints where somebody accepts connections; empty for none.

    All are tried at once, so that one that is out of reach holds up nothing for long.

    Args:
        endpoints: The most wanted one first.
        timeout: Seconds to go on trying.
    """
    began = time.monotonic()
    answers: dict[str, bool] = {}
    changed = threading.Condition()
    over = threading.Event()

    def look(endpoint: str) -> None:
        while not over.is_set():
            answer = is_answered(endpoint, timeout)
            with changed:
                answers[endpoint] = answer
                changed.notify()
            if answer:
                return
            over.wait(_AGAIN_SECONDS)

    def first() -> str:
        late = time.monotonic() - began > _GRACE_SECONDS
        for endpoint in endpoints:
            if answers.get(endpoint):
                return endpoint
            if endpoint not in answers and not late:
                return ""
        return ""

    for endpoint in endpoints:
        name = f"rosz looks at {endpoint}"
        threading.Thread(target=look, args=(endpoint,), name=name, daemon=True).start()
    with changed:
        changed.wait_for(first, min(_GRACE_SECONDS, timeout))
        changed.wait_for(first, max(0.0, timeout - _GRACE_SECONDS))
        over.set()
        return next((endpoint for endpoint in endpoints if answers.get(endpoint)), "")


def is_answered(endpoint: str, timeout: float = _TIMEOUT) -> bool:
    """Tell whether somebody accepts connections at a Zenoh endpoint.

    Args:
        endpoint: Such as ``tcp/localhost:7447`` or ``unixsock-stream//run/z.sock``; for a protocol
            without connections the answer is yes, as it cannot be known.
        timeout: Seconds to wait for an answer.
    """
    protocol, _, address = endpoint.partition("#")[0].partition("/")
    address = address.partition("?")[0]
    if protocol == "unixsock-stream":
        return _connects(socket.AF_UNIX, address, timeout)
    if protocol in {"tcp", "tls"}:
        host, _, port = address.rpartition(":")
        try:
            found = socket.getaddrinfo(host.strip("[]"), int(port), type=socket.SOCK_STREAM)
        except (OSError, ValueError):
            return False
        return any(_connects(family, place, timeout) for family, _, _, _, place in found)
    return True


def _connects(family: int, address: object, timeout: float) -> bool:
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.settimeout(timeout)
        return probe.connect_ex(address) == 0  # type: ignore[arg-type]  # differs by family
