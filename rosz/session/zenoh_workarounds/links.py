"""Links whose other end does not answer, because a cable was cut or its process is stopped.

Seen with eclipse-zenoh 1.10.2. Not reported upstream yet.

When Zenoh closes a TCP connection, it makes the system wait up to ten seconds until the other end
has received what was sent (SO_LINGER, socket(7)), and that on the thread that receives for the
whole session. Without `close_links_at_once`, a new link to a machine that was cut off would be up
long before any data came through it. Nothing is lost by not waiting: the system goes on sending.

Closing a session waits until the links that it is about to open have come about or failed, and
until all that is queued for its links is sent. Without `close_links`, that takes ten seconds next
to a process that is stopped. Ending the connection below makes either fail at once. What the system
has accepted for the process is there when it resumes.
"""

from __future__ import annotations

import os
import re
import socket
import stat
import struct
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from ipaddress import ip_address
from pathlib import Path
from typing import Any, Final

import msgspec
import zenoh

from rosz.lifecycle import Closable
from rosz.session.declared import CallbackThread, open_channel
from rosz.session.local_peers import LocalPeers
from rosz.session.processes import pid_of_peer, tcp_ports
from rosz.wire import Endpoint
from rosz.worker import start_thread

__all__ = ("close_links", "close_links_at_once")

_OPEN_FILES: Final = Path("/dev/fd")
_TCP: Final = re.compile(r"(?:tcp|tls)/([^%#?\]]+)(?:%\w+)?(\]?:\d+)")
_NO_WAIT: Final = struct.pack("ii", 0, 0)
_GRACE_SECONDS: Final = 0.1
_AGAIN_SECONDS: Final = 0.01
"""The pause between attempts: after one address of a process, Zenoh tries the next."""


class _StoppedPeers(msgspec.Struct, frozen=True):
    """How to recognise the connections to stopped processes.

    Attributes:
        ports: The loopback ports of the processes.
        path: The unix socket where all sessions meet; empty if they meet elsewhere.
        pids: The ids of the processes.
    """

    ports: set[int]
    path: str
    pids: set[int]

    def is_other_end(self, connection: socket.socket) -> bool:
        """Tell whether a connection leads to one of the processes.

        Raises:
            OSError: The connection has ended.
        """
        there = connection.getpeername()
        if connection.family == socket.AF_UNIX:
            ends = (there, connection.getsockname())
            return bool(self.path) and self.path in ends and pid_of_peer(connection) in self.pids
        return (
            connection.family in {socket.AF_INET, socket.AF_INET6}
            and there[1] in self.ports
            and ip_address(there[0].partition("%")[0]).is_loopback
        )

    def change(self, change: Callable[[socket.socket], None]) -> None:
        """Change all connections of this process to the stopped ones."""
        for connection, _, _ in _connections():
            with suppress(OSError):  # it has ended meanwhile
                if self.is_other_end(connection):
                    change(connection)


def close_links_at_once(raw: Any) -> Closable:
    """Return a watch that makes a session close its TCP links at once, now and in the future."""
    listener = raw.info.declare_link_events_listener(open_channel(), history=True)
    return CallbackThread("watch of links", listener, _set_no_wait)


def _set_no_wait(event: Any) -> None:
    ends = [_TCP.match(locator) for locator in (event.link.src, event.link.dst)]
    if event.kind != zenoh.SampleKind.PUT or None in ends:
        return
    wanted = ["".join(end.groups()) for end in ends if end is not None]
    with suppress(OSError):  # no file can be opened any more: closing the link will take long
        for connection, *addresses in _connections():
            if addresses == wanted:
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _NO_WAIT)
                return


def close_links(raw: Any, rendezvous: str) -> AbstractContextManager[None]:
    """Return a context in which links to stopped processes are closed if they delay its end."""
    peers = LocalPeers.read(rendezvous)
    return _cut_if_late(_stopped_peers(raw, peers)) if peers.stopped else nullcontext()


@contextmanager
def _cut_if_late(stopped: _StoppedPeers) -> Iterator[None]:
    stopped.change(lambda one: one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _NO_WAIT))
    over = threading.Event()

    def cut() -> None:
        stopped.change(lambda one: one.shutdown(socket.SHUT_RDWR))

    def cut_repeatedly() -> None:
        pause = _GRACE_SECONDS
        while not over.wait(pause):
            cut()
            pause = _AGAIN_SECONDS

    thread = threading.Thread(target=cut_repeatedly, name="rosz-close-links", daemon=True)
    runs = start_thread(thread)
    if not runs:
        cut()
    try:
        yield
    finally:
        over.set()
        if runs:
            thread.join()


def _stopped_peers(raw: Any, peers: LocalPeers) -> _StoppedPeers:
    sessions = {peer.zid for peer in peers.stopped}
    ports = {peer.port for peer in peers.stopped}
    ports = ports.union(*(tcp_ports(peer.pid) for peer in peers.stopped))
    links = [link for link in raw.info.links() if str(link.zid) in sessions]
    ports |= {Endpoint(link.dst).port or 0 for link in links}
    meeting = Endpoint(peers.rendezvous)
    if peers.stopped_holder is not None:
        ports.add(meeting.port or 0)
    return _StoppedPeers(
        ports=ports - {0},
        path=meeting.address if meeting.is_unix else "",
        pids={peer.pid for peer in peers.stopped},
    )


def _connections() -> Iterator[tuple[socket.socket, str, str]]:
    """Yield each connected socket of this process with its own and the other address.

    Zenoh does not hand out its sockets. The newest comes first. Addresses are written as in
    endpoints: ``127.0.0.1:7447``, ``[::1]:7447``, ``/run/z.sock``. A socket is a copy, which is
    valid until the next one is yielded.

    Raises:
        OSError: No file can be opened any more.
    """
    for number in sorted((int(file.name) for file in _OPEN_FILES.iterdir()), reverse=True):
        # Not all sockets are connected, and any file may be closed meanwhile.
        with suppress(OSError):
            # Closing the copy of a file would release all locks of this process on it (fcntl(2)).
            if not stat.S_ISSOCK(os.fstat(number).st_mode):
                continue
            with socket.socket(fileno=os.dup(number)) as found:
                yield found, _address(found.getsockname()), _address(found.getpeername())


def _address(address: Any) -> str:
    if not isinstance(address, tuple):
        return str(address)
    return Endpoint.of("tcp", str(address[0]).partition("%")[0], address[1]).address
