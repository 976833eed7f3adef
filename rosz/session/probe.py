"""Checking whether a program listens at an endpoint, without Zenoh."""

from __future__ import annotations

import socket
import threading
from collections.abc import Sequence
from contextlib import suppress
from itertools import takewhile

from rosz.wire import Endpoint

_TIMEOUT = 0.5
_AGAIN_SECONDS = 0.1
_LONGEST_PAUSE = 1.0
_GRACE_SECONDS = 0.3
"""Seconds for which an answer waits for the results of more preferred endpoints."""
SILENT = "it accepts connections and says nothing: it hangs, is busy, or is not Zenoh"


def first_listening(endpoints: Sequence[str], timeout: float) -> str:
    """Return the first endpoint that accepts connections; empty for none.

    All endpoints are tried at once, so that an unreachable one hardly delays the others.

    Args:
        endpoints: The endpoints, the most preferred first.
        timeout: Time limit in seconds.
    """
    answers: dict[str, bool] = {}
    changed = threading.Condition()
    over = threading.Event()

    def try_endpoint(endpoint: str) -> None:
        pause = _AGAIN_SECONDS
        while not over.is_set():
            answer = is_listening(endpoint, timeout)
            with changed:
                answers[endpoint] = answer
                changed.notify()
            if answer:
                return
            over.wait(pause)
            pause = min(1.2 * pause, _LONGEST_PAUSE)

    def preferred() -> bool:
        """Return whether an endpoint accepted, and all more preferred ones have been tried."""
        tried = takewhile(answers.__contains__, endpoints)
        return any(answers[endpoint] for endpoint in tried)

    for endpoint in endpoints:
        name = f"rosz-probe {endpoint}"
        threading.Thread(target=try_endpoint, args=(endpoint,), name=name, daemon=True).start()
    with changed:
        if not changed.wait_for(preferred, min(_GRACE_SECONDS, timeout)):
            changed.wait_for(lambda: any(answers.values()), max(0.0, timeout - _GRACE_SECONDS))
        over.set()
        return next((endpoint for endpoint in endpoints if answers.get(endpoint)), "")


def is_listening(endpoint: str, timeout: float = _TIMEOUT) -> bool:
    """Return whether a Zenoh endpoint accepts connections.

    Args:
        endpoint: The endpoint; the result is true for a protocol that cannot be checked.
        timeout: Time limit in seconds.
    """
    return not why_refused(endpoint, timeout)


def present_loopback(host: str) -> str:
    """Return ``::1`` for an IPv4 loopback that this machine does not have; else the host itself."""
    if host not in {"localhost", "127.0.0.1"}:
        return host
    for family, address in ((socket.AF_INET, "127.0.0.1"), (socket.AF_INET6, "::1")):
        with suppress(OSError), socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.bind((address, 0))
            return host if family is socket.AF_INET else address
    return host


def why_refused(endpoint: str, timeout: float = _TIMEOUT) -> str:
    """Return why a connection to an endpoint fails; empty if it succeeds or cannot be checked.

    Args:
        endpoint: The endpoint.
        timeout: Time limit in seconds for each address of the host.
    """
    place = Endpoint(endpoint)
    if place.is_unix:
        return _connect(socket.AF_UNIX, place.address, timeout)
    if not (place.is_tcp or place.protocol == "ws"):
        return ""
    if place.port is None:
        return f"'{endpoint}' has no port"
    try:
        host = present_loopback(place.host)
        entries = socket.getaddrinfo(host, place.port, type=socket.SOCK_STREAM)
    except (OSError, ValueError) as error:
        return f"the name '{place.host}' is not known: {getattr(error, 'strerror', error)}"
    reasons = []
    for family, _, _, _, address in entries:
        if not (reason := _connect(family, address, timeout)):
            return ""
        reasons.append(reason)
    return reasons[0]


def _connect(family: int, address: object, timeout: float) -> str:
    """Return why a connection to an address fails; empty if it succeeds."""
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.settimeout(timeout)
        try:
            probe.connect(address)  # type: ignore[arg-type]  # differs by family
        except TimeoutError:
            return f"no answer within {timeout:g} s: no such machine, or a firewall"
        except OSError as error:
            return error.strerror or str(error)
    return ""
