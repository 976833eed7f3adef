"""Closing a session next to processes that are stopped, without waiting for them.

Zenoh ends when the links that it is about to open have come about or failed, and all that is queued
for those that it has is sent: next to a process that is stopped, after ten seconds. To end the
connection below makes either fail at once. What the system has been given already is there for the
process when it goes on.
"""

from __future__ import annotations

import logging
import socket
import struct
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from ipaddress import ip_address
from typing import Any

import msgspec
import zenoh

from rosz.session.presence import marks, stopped_holder
from rosz.session.sockets import connections
from rosz.session.stopped import peer_of, ports_of
from rosz.wire import Endpoint
from rosz.worker import start_thread

__all__ = ("close", "parting_from_stopped")

_NO_WAIT = struct.pack("ii", 0, 0)
_GRACE_SECONDS = 0.1
_AGAIN_SECONDS = 0.01
"""After one place of a process, Zenoh tries the next."""

_log = logging.getLogger("rosz.session")


class _Stopped(msgspec.Struct, frozen=True):
    """How the connections to stopped processes are known.

    Attributes:
        ports: Their ends, on the loopback.
        path: The unix socket where all meet; empty if that is none.
        processes: Their ids.
    """

    ports: set[int]
    path: str
    processes: set[int]

    def is_other_end(self, connection: socket.socket) -> bool:
        """Tell whether a connection leads to one of them.

        Raises:
            OSError: It leads nowhere.
        """
        there = connection.getpeername()
        if connection.family == socket.AF_UNIX:
            ends = (there, connection.getsockname())
            return bool(self.path) and self.path in ends and peer_of(connection) in self.processes
        return (
            connection.family in {socket.AF_INET, socket.AF_INET6}
            and there[1] in self.ports
            and ip_address(there[0].partition("%")[0]).is_loopback
        )


def close(raw: Any, rendezvous: str) -> None:
    """Close a session; links to who is stopped are given up if they hold that up.

    Args:
        raw: The session of Zenoh's.
        rendezvous: Endpoint where the sessions of this machine meet.
    """
    with parting_from_stopped(raw, rendezvous):
        try:
            raw.close()
        except zenoh.ZError as error:
            _log.warning(
                "a link took no more data when its session closed, and what was still queued for it"
                " is lost: %s",
                str(error).partition(" at ")[0],
            )


def parting_from_stopped(raw: Any, rendezvous: str) -> AbstractContextManager[None]:
    """Return within what links to who is stopped are given up if they hold things up.

    Args:
        raw: The session of Zenoh's.
        rendezvous: Endpoint where the sessions of this machine meet.
    """
    stopped = _look(raw, rendezvous)
    return nullcontext() if stopped is None else _giving_up(stopped)


@contextmanager
def _giving_up(stopped: _Stopped) -> Iterator[None]:
    """Cut the links to who is stopped if this takes longer than it should."""
    # Zenoh would have the system wait until the other end has taken in all, for ten seconds.
    _change(stopped, lambda one: one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _NO_WAIT))
    over = threading.Event()

    def give_up() -> None:
        pause = _GRACE_SECONDS
        while not over.wait(pause):
            _change(stopped, lambda one: one.shutdown(socket.SHUT_RDWR))
            pause = _AGAIN_SECONDS

    helper = threading.Thread(target=give_up, name="rosz-parting", daemon=True)
    helps = start_thread(helper)
    if not helps:
        _change(stopped, lambda one: one.shutdown(socket.SHUT_RDWR))
    try:
        yield
    finally:
        over.set()
        if helps:
            helper.join()


def _look(raw: Any, rendezvous: str) -> _Stopped | None:
    """Return who of this machine is stopped, if anybody is."""
    there = [mark for mark in marks(rendezvous) if mark.is_stopped]
    if not there:
        return None
    sessions = {mark.zid for mark in there}
    ports = {mark.port for mark in there}.union(*(ports_of(mark.pid) for mark in there))
    ports |= {
        Endpoint(link.dst).port or 0 for link in raw.info.links() if str(link.zid) in sessions
    }
    meeting = Endpoint(rendezvous)
    if stopped_holder(rendezvous, there) is not None:
        ports.add(meeting.port or 0)
    return _Stopped(
        ports=ports - {0},
        path=meeting.address if meeting.is_unix else "",
        processes={mark.pid for mark in there},
    )


def _change(stopped: _Stopped, change: Callable[[socket.socket], None]) -> None:
    """Change the connections of this process to those that are stopped, which Zenoh hides."""
    for connection, _, _ in connections():
        with suppress(OSError):  # it has ended meanwhile
            if stopped.is_other_end(connection):
                change(connection)
