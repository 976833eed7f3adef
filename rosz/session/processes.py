"""What Linux says about the processes of this machine: which are stopped, and where they listen.

A process is stopped by Ctrl-Z or a debugger. The kernel still accepts connections for it, but
nothing ever answers, so checking first avoids a long wait. A process that cannot be examined, for
example in another container, counts as running.
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from rosz.wire import Endpoint

__all__ = (
    "describe_process",
    "how_to_resume",
    "is_stopped",
    "pid_namespace",
    "pid_of_peer",
    "tcp_ports",
    "which_listens",
)

_PROC = Path("/proc")
_STOPPED = frozenset("Tt")
"""The states of a process stopped by a signal, and by a debugger."""
_LISTENS = "0A"
_CREDENTIALS = struct.Struct("3i")
_MAX_COMMAND = 60


def is_stopped(pid: int) -> bool:
    """Tell whether a process of this machine is stopped; false if that is unknown."""
    try:
        line = (_PROC / str(pid) / "stat").read_text(errors="replace")
    except OSError:
        return False
    return line.rpartition(")")[2].split()[0] in _STOPPED


@cache
def pid_namespace() -> str:
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


def which_listens(endpoint: Endpoint, candidates: Iterable[int]) -> int | None:
    """Return the process that listens at an endpoint of this machine, if it is a candidate.

    Args:
        endpoint: The endpoint.
        candidates: The ids of the processes to consider.
    """
    if endpoint.is_unix:
        pid = _unix_listener(endpoint.address)
        return pid if pid in candidates else None
    if not endpoint.is_tcp or endpoint.port is None:
        return None
    wanted = {
        name for name, port, state in _tcp_sockets() if state == _LISTENS and port == endpoint.port
    }
    return next((pid for pid in candidates if not wanted.isdisjoint(_open_files(pid))), None)


def _unix_listener(path: str) -> int:
    """Return the process that listens at a unix socket; 0 if that is unknown."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.setblocking(False)
        if probe.connect_ex(path):
            return 0
        return pid_of_peer(probe)


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
    """Yield what the open files of a process link to, as far as they may be read."""
    try:
        files = list((_PROC / str(pid) / "fd").iterdir())
    except OSError:
        return
    for file in files:
        try:
            yield str(file.readlink())
        except OSError:
            continue
