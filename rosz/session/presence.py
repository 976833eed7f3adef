"""Knowing of the other processes of this machine before there is a link to any of them.

Whoever finds nobody at the meeting point may be the first, or come right after the death of the
process that held it, whose peers have not found the newcomer yet; and whoever holds it may be
stopped, so that nobody is introduced to anybody. So each leaves a mark that its death takes away: a
socket in Linux's abstract namespace, which nothing is ever sent to. Its name tells the process, and
the port of the loopback where its session can be reached directly.
"""

from __future__ import annotations

import errno
import os
import socket
import sys
from collections.abc import Container, Iterable
from pathlib import Path
from zlib import crc32

import msgspec

from rosz.errors import TransportError
from rosz.session.probe import is_listening
from rosz.session.stopped import describe, is_stopped, listener, namespace, remedy
from rosz.wire import Endpoint

__all__ = (
    "Mark",
    "Presence",
    "is_anybody_awake",
    "is_router_stopped",
    "marks",
    "stopped_holder",
    "why_silent",
    "why_unanswered",
)

_SOCKETS = Path("/proc/net/unix")
_LOOPBACK = "127.0.0.1"
_FIELDS = 4


class Mark(msgspec.Struct, frozen=True):
    """What the mark of a session tells.

    Attributes:
        space: Where its process id is one.
        pid: Its process.
        port: Where it listens on the loopback; 0 if nowhere.
        zid: It; empty as long as it is being opened.
    """

    space: str
    pid: int
    port: int
    zid: str = ""

    @property
    def is_stopped(self) -> bool:
        """Whether its process is stopped, as far as can be seen from here."""
        return self.space == namespace() and is_stopped(self.pid)

    @property
    def endpoint(self) -> str:
        """Where it can be reached; empty if nowhere."""
        return str(Endpoint.of("tcp", _LOOPBACK, self.port)) if self.port else ""


class Presence:
    """The mark of a session, until closed.

    It is there before the session is, so that of two that come at one time one sees the other.

    Args:
        rendezvous: Endpoint where it meets others.
        reachable: Whether a port is to be kept for it until it listens there itself.

    Raises:
        TransportError: There is one in this process that is not reachable either: a router.
    """

    def __init__(self, rendezvous: str, *, reachable: bool = True) -> None:
        self.rendezvous = rendezvous
        self.mark = Mark(namespace(), os.getpid(), 0)
        self._sockets: list[socket.socket] = []
        self._kept: socket.socket | None = None
        if sys.platform != "linux":
            return
        if reachable:
            self._kept = socket.socket()
            # Two that say so may have one port, as long as only one listens there.
            self._kept.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._kept.bind((_LOOPBACK, 0))
            port = self._kept.getsockname()[1]
            self.mark = msgspec.structs.replace(self.mark, port=port)
        self._leave(self.mark)

    def tell(self, zid: str) -> None:
        """Tell which session it is, now that it is open."""
        self.mark = msgspec.structs.replace(self.mark, zid=zid)
        if self._sockets:
            self._leave(self.mark)
        self._let_go()

    def others(self) -> list[Mark]:
        """Return the marks of the other sessions that meet at the same point."""
        own = (self.mark.space, self.mark.pid, self.mark.port)
        return [one for one in marks(self.rendezvous) if (one.space, one.pid, one.port) != own]

    def close(self) -> None:
        """Take the mark away; again is no error."""
        self._let_go()
        for mark in self._sockets:
            mark.close()

    def _let_go(self) -> None:
        if self._kept is not None:
            self._kept.close()

    def _leave(self, mark: Mark) -> None:
        made = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        parts = (mark.space, mark.pid, mark.port, mark.zid)
        try:
            made.bind(f"\0{_start(self.rendezvous)}{'/'.join(map(str, parts))}")
        except OSError as error:
            made.close()
            if error.errno != errno.EADDRINUSE:
                raise
            raise TransportError(
                f"this process has a router at {self.rendezvous} already, and there is one for"
                " each meeting point: close that one first"
            ) from error
        self._sockets.append(made)


def marks(rendezvous: str) -> list[Mark]:
    """Return the marks of all sessions of this machine that meet others at an endpoint."""
    start = f"@{_start(rendezvous)}"
    try:
        lines = _SOCKETS.read_text(errors="replace").splitlines()
    except OSError:  # another system than Linux has none
        return []
    found: dict[tuple[str, int, int], Mark] = {}
    for line in lines:
        _, here, told = line.partition(start)
        parts = told.split("/")
        if here and len(parts) == _FIELDS and parts[1].isdecimal() and parts[2].isdecimal():
            mark = Mark(parts[0], int(parts[1]), int(parts[2]), parts[3])
            known = found.get((mark.space, mark.pid, mark.port))
            if known is None or mark.zid:
                found[mark.space, mark.pid, mark.port] = mark
    return list(found.values())


def stopped_holder(rendezvous: str, there: Iterable[Mark]) -> int | None:
    """Return the process that holds a meeting point, if it is one of some and stopped."""
    stopped = [mark.pid for mark in there if mark.is_stopped]
    return listener(Endpoint(rendezvous), stopped) if stopped else None


def is_anybody_awake(rendezvous: str) -> bool:
    """Tell whether there is anybody to meet, rather than nobody or only who is stopped."""
    there = marks(rendezvous)
    if any(not mark.is_stopped for mark in there):
        return True
    return is_listening(rendezvous) and stopped_holder(rendezvous, there) is None


def is_router_stopped(rendezvous: str) -> bool:
    """Tell whether a router holds a meeting point, and is stopped.

    Peers ask their router for what lies beyond, so who asks one of them would wait for both.
    """
    there = marks(rendezvous)
    pid = stopped_holder(rendezvous, [mark for mark in there if not mark.port])
    return pid is not None


def why_unanswered(rendezvous: str) -> str:
    """Say that who holds a meeting point is stopped, and what to do; empty if that is not so."""
    pid = stopped_holder(rendezvous, marks(rendezvous))
    if pid is None:
        return ""
    return f"{describe(pid)} holds the meeting point {rendezvous} and is stopped: {remedy(pid)}"


def why_silent(rendezvous: str, sessions: Container[str]) -> str:
    """Say which of the processes of some sessions are stopped; empty if none is.

    Args:
        rendezvous: Endpoint where they meet.
        sessions: Their ids.
    """
    stopped = {one.pid for one in marks(rendezvous) if one.zid in sessions and one.is_stopped}
    return "; ".join(f"{describe(pid)} is stopped: {remedy(pid)}" for pid in sorted(stopped))


def _start(rendezvous: str) -> str:
    return f"rosz/{crc32(rendezvous.encode()):08x}/"
