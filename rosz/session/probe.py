"""Finding out whether somebody listens at an endpoint, without Zenoh."""

from __future__ import annotations

import socket
import threading
from collections.abc import Sequence
from itertools import takewhile

from rosz.wire import Endpoint

__all__ = ("first_listening", "is_listening", "why_refused")

_TIMEOUT = 0.5
_AGAIN_SECONDS = 0.1
_LONGEST_PAUSE = 1.0
_GRACE_SECONDS = 0.3
"""Seconds that a less preferred endpoint waits for the result of a more preferred one."""


def first_listening(endpoints: Sequence[str], timeout: float) -> str:
    """Return the first of some endpoints where somebody accepts connections; empty for none.

    All are tried at once, so that one that cannot be reached does not delay the others for long.

    Args:
        endpoints: The endpoints, the most preferred one first.
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
        """Tell whether an endpoint answered, and all that are preferred to it have been tried."""
        known = list(takewhile(answers.__contains__, endpoints))
        return any(answers[endpoint] for endpoint in known)

    for endpoint in endpoints:
        name = f"rosz-probe {endpoint}"
        threading.Thread(target=try_endpoint, args=(endpoint,), name=name, daemon=True).start()
    with changed:
        if not changed.wait_for(preferred, min(_GRACE_SECONDS, timeout)):
            changed.wait_for(lambda: any(answers.values()), max(0.0, timeout - _GRACE_SECONDS))
        over.set()
        return next((endpoint for endpoint in endpoints if answers.get(endpoint)), "")


def is_listening(endpoint: str, timeout: float = _TIMEOUT) -> bool:
    """Tell whether somebody accepts connections at a Zenoh endpoint.

    Args:
        endpoint: The endpoint; for a protocol without connections the result is true.
        timeout: Time limit in seconds.
    """
    return not why_refused(endpoint, timeout)


def why_refused(endpoint: str, timeout: float = _TIMEOUT) -> str:
    """Return why nobody can connect to an endpoint; empty if one can, or if that is unknown.

    Args:
        endpoint: The endpoint.
        timeout: Time limit for each of its addresses, in seconds.
    """
    place = Endpoint(endpoint)
    if place.is_unix:
        return _connect(socket.AF_UNIX, place.address, timeout)
    if not (place.is_tcp or place.protocol == "ws"):
        return ""
    if place.port is None:
        return f"'{endpoint}' has no port"
    try:
        found = socket.getaddrinfo(place.host, place.port, type=socket.SOCK_STREAM)
    except (OSError, ValueError) as error:
        return f"the name '{place.host}' is not known: {getattr(error, 'strerror', error)}"
    reasons = []
    for family, _, _, _, address in found:
        if not (reason := _connect(family, address, timeout)):
            return ""
        reasons.append(reason)
    return reasons[0]


def _connect(family: int, address: object, timeout: float) -> str:
    """Return why a connection fails; empty if it succeeds."""
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.settimeout(timeout)
        try:
            probe.connect(address)  # type: ignore[arg-type]  # differs by family
        except TimeoutError:
            return f"no answer within {timeout:g} s: no such machine, or a firewall"
        except OSError as error:
            return error.strerror or str(error)
    return ""
