"""Looking at endpoints from outside: does anybody listen there, and is it Zenoh?"""

from __future__ import annotations

import fcntl
import os
import stat
from collections.abc import Iterator
from pathlib import Path

from rosz.doctor.finding import Finding, error, warning
from rosz.environment import Environment
from rosz.errors import TransportError
from rosz.session import Session, SessionConfig, keys_of, why_refused
from rosz.wire import Endpoint

__all__ = ("check_connect", "check_rendezvous", "check_socket_files")

_CONNECT_SECONDS = 1.0
_GREETING_SECONDS = 1.0
_PLAIN = frozenset({"tcp", "unixsock-stream"})


def check_rendezvous(environment: Environment) -> Iterator[Finding]:
    """Find out whether what holds the meeting point is no Zenoh."""
    endpoint = environment.rendezvous
    if not why_refused(endpoint, _CONNECT_SECONDS) and not _greets(endpoint, environment):
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
        reason = why_refused(endpoint, _CONNECT_SECONDS)
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
        place = Endpoint(endpoint)
        path = Path(place.address)
        if not place.is_unix or not _is_socket(path) or not why_refused(endpoint, _CONNECT_SECONDS):
            continue
        lock = Path(f"{path}.lock")
        ours = os.access(path.parent, os.W_OK) and _is_free(lock)
        make = warning if ours else error
        yield make(
            "stale-lock",
            f"the process that listened at {path} died and left its socket",
            [
                f"{path}: {why_refused(endpoint, _CONNECT_SECONDS)}",
                f"{lock}: {'not locked' if ours else 'held by another process or user'}",
            ],
            f"rm {path} {lock}" + ("; the next process to start does it" if ours else ""),
        )


def _greets(endpoint: str, environment: Environment) -> bool:
    """Tell whether a Zenoh session opens at an endpoint; yes where it would need certificates."""
    if Endpoint(endpoint).protocol not in _PLAIN:
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
