"""Looking at endpoints from outside: does anybody listen there, and is it Zenoh?"""

from __future__ import annotations

import fcntl
import os
import socket
import stat
from collections.abc import Iterator
from pathlib import Path

from rosz.doctor.finding import Finding, error, warning
from rosz.environment import Environment
from rosz.errors import TransportError
from rosz.session import Session, SessionConfig
from rosz.session.config import keys_of

__all__ = ("check_connect", "check_rendezvous", "check_socket_files", "why_refused")

_CONNECT_SECONDS = 1.0
_GREETING_SECONDS = 1.0
_TCP = frozenset({"tcp", "tls", "ws"})
_PLAIN = frozenset({"tcp", "unixsock-stream"})


def check_rendezvous(environment: Environment) -> Iterator[Finding]:
    """Find out whether what holds the meeting point is no Zenoh."""
    endpoint = environment.rendezvous
    if not why_refused(endpoint) and not _greets(endpoint, environment):
        yield error(
            "rendezvous-held",
            f"something that is not Zenoh, or hangs, holds the rendezvous {endpoint}",
            [f"it accepts connections and says nothing within {_GREETING_SECONDS:g} s"],
            f"find it with 'ss -ltnp' and end it, or set ROSZ_RENDEZVOUS to another endpoint for"
            f" all processes in place of {endpoint}",
        )


def check_connect(environment: Environment) -> Iterator[Finding]:
    """Find out whether nobody listens where ``ROSZ_CONNECT`` points."""
    for endpoint in environment.connect:
        reason = why_refused(endpoint)
        if not reason and not _greets(endpoint, environment):
            reason = f"what listens there says nothing within {_GREETING_SECONDS:g} s: it hangs, or"
            reason += " it is not Zenoh"
        if reason:
            yield error(
                "nobody-listens",
                f"ROSZ_CONNECT names {endpoint}, where no Zenoh answers",
                [reason],
                "on that machine run 'rosz core --listen tcp/0.0.0.0:7447', or set ROSZ_LISTEN"
                " there; check the name, the port, and the firewalls between",
            )


def check_socket_files(environment: Environment) -> Iterator[Finding]:
    """Find sockets that dead processes left where others are to listen."""
    for endpoint in (environment.rendezvous, *environment.listen):
        protocol, address = _parts(endpoint)
        path = Path(address)
        if protocol != "unixsock-stream" or not _is_socket(path) or not why_refused(endpoint):
            continue
        lock = Path(f"{path}.lock")
        ours = os.access(path.parent, os.W_OK) and _is_free(lock)
        make = warning if ours else error
        yield make(
            "stale-lock",
            f"the process that listened at {path} died and left its socket",
            [
                f"{path}: {why_refused(endpoint)}",
                f"{lock}: {'not locked' if ours else 'held by another process or user'}",
            ],
            f"rm {path} {lock}" + ("; the next process to start does it" if ours else ""),
        )


def why_refused(endpoint: str) -> str:
    """Say why nobody can connect to an endpoint; empty if one can, or if it cannot be known."""
    protocol, address = _parts(endpoint)
    if protocol == "unixsock-stream":
        return _try(socket.AF_UNIX, address)
    if protocol not in _TCP:
        return ""
    host, _, port = address.rpartition(":")
    try:
        places = socket.getaddrinfo(host.strip("[]"), int(port), type=socket.SOCK_STREAM)
    except ValueError:
        return f"'{endpoint}' has no port"
    except OSError as fault:
        return f"the name '{host}' is not known: {fault.strerror}"
    reasons = [_try(family, place) for family, _, _, _, place in places]
    return "" if "" in reasons else reasons[0]


def _try(family: int, address: object) -> str:
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.settimeout(_CONNECT_SECONDS)
        try:
            probe.connect(address)  # type: ignore[arg-type]  # differs by family
        except TimeoutError:
            return f"no answer within {_CONNECT_SECONDS:g} s: no such machine, or a firewall"
        except OSError as fault:
            return fault.strerror or str(fault)
    return ""


def _greets(endpoint: str, environment: Environment) -> bool:
    """Tell whether a Zenoh session opens at an endpoint; yes where it would need certificates."""
    if _parts(endpoint)[0] not in _PLAIN:
        return True
    config = SessionConfig(
        mode="client",
        rendezvous=endpoint,
        must_connect=True,
        open_timeout=_GREETING_SECONDS,
        keys=keys_of(environment),
        override=environment.zenoh_override,
    )
    try:
        Session.open(config).close()
    except TransportError:
        return False
    return True


def _parts(endpoint: str) -> tuple[str, str]:
    protocol, _, address = endpoint.partition("#")[0].partition("/")
    return protocol, address.partition("?")[0]


def _is_socket(path: Path) -> bool:
    try:
        return stat.S_ISSOCK(path.stat().st_mode)
    except OSError:
        return False


def _is_free(lock: Path) -> bool:
    try:
        file = os.open(lock, os.O_RDWR)
    except FileNotFoundError:
        return True
    except OSError:
        return False
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    finally:
        os.close(file)
    return True
