"""Knowing which processes of this machine are stopped, as by Ctrl-Z, and what to say of them.

The kernel still accepts connections for one, and nothing ever answers; so whoever looks before it
connects need not find out by waiting. What cannot be seen, as in another container, counts as
running.
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from rosz.wire import Endpoint

__all__ = ("describe", "is_stopped", "listener", "namespace", "peer_of", "ports_of", "remedy")

_PROC = Path("/proc")
_STOPPED = frozenset("Tt")
"""By a signal, and by a debugger."""
_LISTENS = "0A"
_CREDENTIALS = struct.Struct("3i")
_SHOWN = 60


def is_stopped(pid: int) -> bool:
    """Tell whether a process of this machine is stopped; one that cannot be seen is not."""
    try:
        line = (_PROC / str(pid) / "stat").read_text(errors="replace")
    except OSError:
        return False
    return line.rpartition(")")[2].split()[0] in _STOPPED


@cache
def namespace() -> str:
    """Return what all have in common to whom a process id means the same; empty if unknown."""
    try:
        return str((_PROC / "self/ns/pid").stat().st_ino)
    except OSError:  # another system than Linux
        return ""


def describe(pid: int) -> str:
    """Return the command of a process as people know it, with its id."""
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
    return f"'{line if len(line) <= _SHOWN else line[: _SHOWN - 1] + '…'}' (pid {pid})"


def remedy(pid: int) -> str:
    """Return what to do about a process that is stopped."""
    return (
        f"let it go on with 'fg' in its terminal or 'kill -CONT {pid}', or end it with"
        f" 'kill -9 {pid}'"
    )


def listener(endpoint: Endpoint, candidates: Iterable[int]) -> int | None:
    """Return the process that listens at an endpoint of this machine, if it is one of some.

    Args:
        endpoint: The endpoint.
        candidates: Ids of the processes that it may be.
    """
    if endpoint.is_unix:
        pid = _unix_listener(endpoint.address)
        return pid if pid in candidates else None
    if not endpoint.is_tcp or endpoint.port is None:
        return None
    wanted = set(_tcp_listeners(endpoint.port))
    return next((pid for pid in candidates if not wanted.isdisjoint(_sockets(pid))), None)


def _unix_listener(path: str) -> int:
    """Return the process that listens at a unix socket; 0 if that is not known."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.setblocking(False)
        if probe.connect_ex(path):
            return 0
        return peer_of(probe)


def peer_of(connection: socket.socket) -> int:
    """Return the process at the other end of a connected unix socket, or that listens there."""
    told = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    pid: int = _CREDENTIALS.unpack(told)[0]
    return pid


def ports_of(pid: int) -> set[int]:
    """Return the TCP ports at which a process has sockets, as far as they may be seen."""
    own = set(_sockets(pid))
    return {port for name, port, _ in _tcp_sockets() if name in own}


def _tcp_listeners(port: int) -> Iterator[str]:
    """Yield the sockets that listen at a port of this machine, as links of open files name them."""
    for name, here, state in _tcp_sockets():
        if state == _LISTENS and here == port:
            yield name


def _tcp_sockets() -> Iterator[tuple[str, int, str]]:
    """Yield the TCP sockets of this machine, as links of open files name them, port and state."""
    for table in ("net/tcp", "net/tcp6"):
        try:
            lines = (_PROC / table).read_text().splitlines()[1:]
        except OSError:
            continue
        for line in lines:
            place, _, state, *rest = line.split()[1:]
            yield f"socket:[{rest[5]}]", int(place.rpartition(":")[2], 16), state


def _sockets(pid: int) -> Iterator[str]:
    """Yield the open files of a process, as far as they may be seen."""
    try:
        files = list((_PROC / str(pid) / "fd").iterdir())
    except OSError:
        return
    for file in files:
        try:
            yield str(file.readlink())
        except OSError:
            continue
