"""Who of this machine is stopped, as by Ctrl-Z: it is there, and answers nobody."""

from __future__ import annotations

import socket
from collections.abc import Iterator

from rosz.doctor.finding import Finding, error
from rosz.environment import Environment
from rosz.session import LocalPeers, describe_process, is_stopped
from rosz.wire import ProcessToken

__all__ = ("check_stopped", "state")


def check_stopped(environment: Environment) -> Iterator[Finding]:
    """Find processes that are stopped, before anybody waits for their answers."""
    peers = LocalPeers.read(environment.rendezvous)
    stopped = sorted({peer.pid for peer in peers.stopped})
    if not stopped:
        return
    held = f", which holds the meeting point {environment.rendezvous}"
    ids = " ".join(map(str, stopped))
    yield error(
        "stopped-process",
        "what is stopped, as by Ctrl-Z, hears nothing and answers nobody",
        (
            f"{describe_process(pid)}{held if pid == peers.stopped_holder else ''}"
            for pid in stopped
        ),
        f"let it go on with 'fg' in its terminal or 'kill -CONT {ids}', or end it with"
        f" 'kill -9 {ids}'",
    )


def state(process: ProcessToken) -> str:
    """Say that the process of a node is stopped; empty if not, or if it cannot be seen here."""
    here = process.host == socket.gethostname()
    return ": it is stopped" if here and is_stopped(process.pid) else ""
