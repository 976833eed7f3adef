"""The other sessions of this machine, and the states of their processes on Linux.

A process that finds nobody at the rendezvous may be the first one. But the process that held the
rendezvous may also have just died, before its peers could find the newcomer, or it may be stopped,
so that it does not introduce peers. So each session registers itself with a socket in Linux's
abstract namespace, which disappears with the process. Nothing is ever sent to it. Its name contains
the process id and the loopback port where the session can be reached directly.

If the rendezvous is a unix socket in a folder that nobody else can enter, it is private: sessions
can be reached directly at further unix sockets beside it, and at no port, which all users of the
machine could connect to. The number of such a socket takes the place of the port.

A process is stopped by Ctrl-Z or a debugger. The kernel still accepts connections for it, but
nothing ever answers, so checking first avoids a long wait. A process that cannot be examined, for
example in another container, counts as running.
"""

from __future__ import annotations

import errno
import os
import socket
import stat
import struct
import sys
from collections.abc import Container, Iterable, Iterator
from functools import cache, cached_property
from pathlib import Path
from zlib import crc32

import msgspec

from rosz.errors import TransportError
from rosz.session.probe import is_listening, present_loopback
from rosz.wire import Endpoint

_LOOPBACK = "127.0.0.1"
_MAX_PORT = 65535
_FIELDS = 4
_PROC = Path("/proc")
_STOPPED = frozenset("Tt")
"""The states of a process stopped by a signal, and by a debugger."""
_LISTENS = "0A"
_CREDENTIALS = struct.Struct("3i")
_MAX_COMMAND = 60


class LocalPeer(msgspec.Struct, frozen=True):
    """A session of this machine, as it is registered.

    Attributes:
        namespace: The namespace of its process id.
        pid: The id of its process.
        port: The loopback port that it listens at, or the number of its private socket; 0 for none.
        zid: The id of the session; empty while it is being opened.
    """

    namespace: str
    pid: int
    port: int
    zid: str = ""

    @property
    def is_stopped(self) -> bool:
        """Whether its process is stopped; false if that is unknown."""
        return self.namespace == _pid_namespace() and is_stopped(self.pid)


def is_private(rendezvous: str) -> bool:
    """Tell whether a rendezvous is a unix socket in a folder that nobody else can enter."""
    endpoint = Endpoint(rendezvous)
    if not endpoint.is_unix:
        return False
    try:
        mode = Path(endpoint.address).parent.stat().st_mode
    except OSError:  # there is no such folder, so there can be no socket
        return False
    return not mode & (stat.S_IRWXG | stat.S_IRWXO)


def direct_endpoint(rendezvous: str, peer: LocalPeer | None) -> str:
    """Return the endpoint where a session listens for direct links; empty if any will do.

    Args:
        rendezvous: The endpoint where sessions meet.
        peer: How the session is registered, if it is.
    """
    port = peer.port if peer is not None else 0
    if is_private(rendezvous):
        return f"{rendezvous}.{port or _private_number():x}"
    return str(Endpoint.of("tcp", present_loopback(_LOOPBACK), port)) if port else ""


def _private_number() -> int:
    """Return a number for a private socket, which no port has."""
    return _MAX_PORT + 1 + int.from_bytes(os.urandom(4))


class LocalPeers:
    """The sessions of this machine that meet at one endpoint, as they were at one moment.

    Args:
        rendezvous: The endpoint where they meet.
        peers: The sessions.
    """

    def __init__(self, rendezvous: str, peers: tuple[LocalPeer, ...]) -> None:
        self.rendezvous = rendezvous
        self._peers = peers

    @classmethod
    def read(cls, rendezvous: str, own: LocalPeer | None = None) -> LocalPeers:
        """Return the sessions that are registered now.

        Args:
            rendezvous: The endpoint where they meet.
            own: The session to leave out, as it is registered.
        """
        prefix = f"@{_prefix(rendezvous)}"
        try:
            lines = (_PROC / "net/unix").read_text(errors="replace").splitlines()
        except OSError:  # not Linux
            lines = []
        peers: dict[tuple[str, int, int], LocalPeer] = {}
        for line in lines:
            _, is_ours, rest = line.partition(prefix)
            parts = rest.split("/")
            if is_ours and len(parts) == _FIELDS and parts[1].isdecimal() and parts[2].isdecimal():
                peer = LocalPeer(parts[0], int(parts[1]), int(parts[2]), parts[3])
                key = (peer.namespace, peer.pid, peer.port)
                if key not in peers or peer.zid:
                    peers[key] = peer
        if own is not None:
            peers.pop((own.namespace, own.pid, own.port), None)
        return cls(rendezvous, tuple(peers.values()))

    def __iter__(self) -> Iterator[LocalPeer]:
        """Iterate over the sessions."""
        return iter(self._peers)

    @cached_property
    def stopped(self) -> tuple[LocalPeer, ...]:
        """The sessions whose processes are stopped."""
        return tuple(peer for peer in self._peers if peer.is_stopped)

    @property
    def running(self) -> list[str]:
        """The endpoints of the sessions whose processes are not stopped."""
        return [
            direct_endpoint(self.rendezvous, peer)
            for peer in self._peers
            if peer.port and not peer.is_stopped
        ]

    @cached_property
    def is_any_running(self) -> bool:
        """Whether there is a session whose process is not stopped."""
        return any(not peer.is_stopped for peer in self._peers)

    @property
    def has_peers(self) -> bool:
        """Whether there is anybody to meet, with a session of rosz or not, who is not stopped."""
        if self.is_any_running:
            return True
        return is_listening(self.rendezvous) and self.stopped_holder is None

    @cached_property
    def stopped_holder(self) -> int | None:
        """The id of the stopped process that listens at the rendezvous, if there is one."""
        pids = [peer.pid for peer in self.stopped]
        return find_listener(Endpoint(self.rendezvous), pids) if pids else None

    @property
    def is_router_stopped(self) -> bool:
        """Whether a router listens at the rendezvous and is stopped.

        Peers ask their router about sessions beyond themselves, so a client of such a peer would
        wait for both.
        """
        return any(peer.pid == self.stopped_holder and not peer.port for peer in self.stopped)

    @property
    def why_unanswered(self) -> str:
        """The reason why nobody answers at the rendezvous, and what to do, if it is stopped."""
        pid = self.stopped_holder
        if pid is None:
            return ""
        who = f"{describe_process(pid)} holds the meeting point {self.rendezvous}"
        return f"{who} and is stopped: {how_to_resume(pid)}"

    def why_silent(self, sessions: Container[str]) -> str:
        """Return which of some sessions are stopped, and what to do; empty if none is.

        Args:
            sessions: The ids of the sessions.
        """
        stopped = {peer.pid for peer in self.stopped if peer.zid in sessions}
        return "; ".join(
            f"{describe_process(pid)} is stopped: {how_to_resume(pid)}" for pid in sorted(stopped)
        )


class LocalRegistration:
    """The registration of a session of this process, until closed.

    It is made before the session reads the registrations of others, so that of two sessions that
    open at the same time one sees the other.

    Args:
        rendezvous: The endpoint where the session meets others.
        reachable: Whether to reserve a port that the session will listen at.

    Attributes:
        peer: Registration that others read.

    Raises:
        TransportError: This process has registered another session that is not reachable: a router.
    """

    def __init__(self, rendezvous: str, *, reachable: bool = True) -> None:
        self.peer: LocalPeer = LocalPeer(_pid_namespace(), os.getpid(), 0)
        self._rendezvous = rendezvous
        self._sockets: list[socket.socket] = []
        self._reserved: socket.socket | None = None
        if sys.platform != "linux":
            return
        if reachable and is_private(rendezvous):
            self.peer = msgspec.structs.replace(self.peer, port=_private_number())
        elif reachable:
            host = present_loopback(_LOOPBACK)
            self._reserved = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET)
            # Two sockets with this option may have one port, as long as only one of them listens.
            self._reserved.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._reserved.bind((host, 0))
            port = self._reserved.getsockname()[1]
            self.peer = msgspec.structs.replace(self.peer, port=port)
        self._bind()

    def opened(self, zid: str) -> None:
        """Add the id of the session, which is open now, and release its port."""
        self.peer = msgspec.structs.replace(self.peer, zid=zid)
        if self._sockets:
            self._bind()
        if self._reserved is not None:
            self._reserved.close()

    def close(self) -> None:
        """Remove the registration; a second call has no effect."""
        for socket_ in (self._reserved, *self._sockets):
            if socket_ is not None:
                socket_.close()

    def _bind(self) -> None:
        made = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        parts = map(str, msgspec.structs.astuple(self.peer))
        try:
            made.bind(f"\0{_prefix(self._rendezvous)}{'/'.join(parts)}")
        except OSError as error:
            made.close()
            if error.errno != errno.EADDRINUSE:
                raise
            raise TransportError(
                f"this process has a router at {self._rendezvous} already, and there is one for"
                " each meeting point: close that one first"
            ) from error
        self._sockets.append(made)


class CoreLock:
    """The right to be the core of a domain at a rendezvous, until closed; Linux only.

    Args:
        rendezvous: The endpoint where the sessions of this machine meet.
        domain: The ROS domain.

    Raises:
        TransportError: Another core has it.
    """

    def __init__(self, rendezvous: str, domain: int) -> None:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        if sys.platform != "linux":
            return
        name = f"\0{_prefix(rendezvous)}core/{domain}"
        try:
            self._socket.bind(name)
            self._socket.listen()
        except OSError as error:
            self._socket.close()
            if error.errno != errno.EADDRINUSE:
                raise
            raise TransportError(
                f"a core of domain {domain} runs already at {rendezvous}: {_listener_of(name)};"
                " nodes use it, or end it and start the core again"
            ) from error

    def close(self) -> None:
        """Give it up; a second call has no effect."""
        self._socket.close()


def _listener_of(name: str) -> str:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.setblocking(False)
        refused = probe.connect_ex(name)
        return "it has just ended" if refused else describe_process(pid_of_peer(probe))


def _prefix(rendezvous: str) -> str:
    return f"rosz/{crc32(rendezvous.encode()):08x}/"


def is_stopped(pid: int) -> bool:
    """Tell whether a process of this machine is stopped; false if that is unknown."""
    try:
        line = (_PROC / str(pid) / "stat").read_text(errors="replace")
    except OSError:
        return False
    return line.rpartition(")")[2].split()[0] in _STOPPED


@cache
def _pid_namespace() -> str:
    """Return the id of the namespace of this process's id; empty if unknown."""
    try:
        return str((_PROC / "self/ns/pid").stat().st_ino)
    except OSError:  # not Linux
        return ""


def describe_process(pid: int) -> str:
    """Return the command line of a process as a user would type it, and its id."""
    try:
        words = (_PROC / str(pid) / "cmdline").read_bytes().decode(errors="replace").split("\0")
    except OSError:
        words = []
    words = [word for word in words if word]
    if len(words) > 1 and "python" in Path(words[0]).name and not words[1].startswith("-"):
        del words[0]
    if not words:
        return f"process {pid}"
    line = " ".join((Path(words[0]).name, *words[1:])).replace("\n", " ")
    return f"'{line if len(line) <= _MAX_COMMAND else line[: _MAX_COMMAND - 1] + '…'}' (pid {pid})"


def how_to_resume(pid: int) -> str:
    """Return the advice for a process that is stopped."""
    return (
        f"let it go on with 'fg' in its terminal or 'kill -CONT {pid}', or end it with"
        f" 'kill -9 {pid}'"
    )


def find_listener(endpoint: Endpoint, candidates: Iterable[int]) -> int | None:
    """Return the process that listens at an endpoint of this machine, if it is a candidate.

    Args:
        endpoint: The endpoint.
        candidates: The ids of the processes to consider.
    """
    if endpoint.is_unix:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
            probe.setblocking(False)
            pid = 0 if probe.connect_ex(endpoint.address) else pid_of_peer(probe)
        return pid if pid in candidates else None
    if not endpoint.is_tcp or endpoint.port is None:
        return None
    wanted = {
        name for name, port, state in _tcp_sockets() if state == _LISTENS and port == endpoint.port
    }
    return next((pid for pid in candidates if not wanted.isdisjoint(_open_files(pid))), None)


def find_holder(endpoint: str) -> int | None:
    """Return the process that listens at an endpoint of this machine; ``None`` if unknown."""
    pids = [int(entry.name) for entry in _PROC.iterdir() if entry.name.isdecimal()]
    return find_listener(Endpoint(endpoint), pids)


def pid_of_peer(connection: socket.socket) -> int:
    """Return the process at the other end of a connected unix socket."""
    credentials = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    pid: int = _CREDENTIALS.unpack(credentials)[0]
    return pid


def tcp_ports(pid: int) -> set[int]:
    """Return the TCP ports of a process's sockets, as far as they may be read."""
    own = set(_open_files(pid))
    return {port for name, port, _ in _tcp_sockets() if name in own}


def _tcp_sockets() -> Iterator[tuple[str, int, str]]:
    """Yield the name (as in links of open files), local port and state of each TCP socket."""
    for table in ("net/tcp", "net/tcp6"):
        try:
            lines = (_PROC / table).read_text().splitlines()[1:]
        except OSError:
            continue
        for line in lines:
            address, _, state, *rest = line.split()[1:]
            yield f"socket:[{rest[5]}]", int(address.rpartition(":")[2], 16), state


def _open_files(pid: int) -> Iterator[str]:
    """Yield the targets of the open files of a process, as far as they may be read."""
    try:
        files = list((_PROC / str(pid) / "fd").iterdir())
    except OSError:
        return
    for file in files:
        try:
            yield str(file.readlink())
        except OSError:
            continue
