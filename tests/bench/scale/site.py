"""Where a part of a crowd runs: on this machine, or on a host made of namespaces."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import IO

from hosts.namespace import children
from hosts.world import Host, World

__all__ = ("Site", "sites")

_ROOT = Path(__file__).parents[3]
_OURS = ("ROS", "ZENOH", "RCUTILS")
_OCTETS_SENT = 9  # column of /proc/net/dev
_TICKS = os.sysconf("SC_CLK_TCK")


class Site:
    """One machine.

    Args:
        variables: The environment of what runs there.
        host: The host, if it is not this machine.
        interface: The one whose traffic is counted.
    """

    def __init__(
        self, variables: Mapping[str, str], host: Host | None = None, interface: str = "lo"
    ) -> None:
        self._variables = dict(variables)
        self._host = host
        self._interface = interface
        self._processes: list[subprocess.Popen[bytes]] = []

    def start(
        self, words: Sequence[str], variables: Mapping[str, str], out: int, err: IO[str]
    ) -> subprocess.Popen[bytes]:
        """Start Python, to end with its standard input at the latest."""
        command = [sys.executable, "-P", *words]
        process = subprocess.Popen(
            self._host.namespace.inside(command) if self._host else command,
            env=self._variables | dict(variables),
            stdin=subprocess.PIPE,
            stdout=out,
            stderr=err,
        )
        self._processes.append(process)
        return process

    def memory(self) -> int:
        """Return the bytes of all that runs here; what several share is counted once."""
        return sum(map(_memory, self._pids()))

    def cpu(self, process: subprocess.Popen[bytes] | None = None) -> float:
        """Return the seconds of a core that a process, or all that runs here, has taken."""
        return sum(map(_cpu, self._pids() if process is None else self._pids_of(process)))

    def kill(self, process: subprocess.Popen[bytes]) -> None:
        """Kill a process, as a crash does."""
        for pid in self._pids_of(process):
            os.kill(pid, signal.SIGKILL)

    def sent(self) -> int:
        """Return the bytes that went out by the interface."""
        owner = self._host.namespace.pid if self._host else os.getpid()
        rows = Path(f"/proc/{owner}/net/dev").read_text().replace(":", " ").splitlines()
        cells = next(row.split() for row in rows if row.split()[0] == self._interface)
        return int(cells[_OCTETS_SENT])

    def _pids(self) -> list[int]:
        return [pid for process in self._processes for pid in self._pids_of(process)]

    def _pids_of(self, process: subprocess.Popen[bytes]) -> list[int]:
        return list(children(process.pid)) if self._host else [process.pid]

    def close(self) -> None:
        """End all that was started here."""
        if self._host:
            self._host.kill()  # what brought a process there ends with it, and not before
        else:
            for process in self._processes:
                process.kill()
        for process in self._processes:
            process.wait()
            if process.stdin is not None:
                process.stdin.close()


@contextmanager
def sites(count: int, folder: Path) -> Iterator[list[Site]]:
    """Have so many hosts on one network, with nothing else on them; or this machine for none.

    Args:
        count: How many; their names are ``h0``, ``h1`` and so on.
        folder: For files.
    """
    with ExitStack() as stack:
        if count:
            interface = "eth0" if count > 1 else "lo"
            hosts = stack.enter_context(World()).hosts(*(f"h{number}" for number in range(count)))
            found = [Site(host.variables, host, interface) for host in hosts]
        else:
            found = [Site(_here(folder))]
        for site in found:
            stack.enter_context(closing(site))
        yield found


def _here(folder: Path) -> dict[str, str]:
    """Return an environment on this machine, with a free port to meet at."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    own = {name: text for name, text in os.environ.items() if not name.startswith(_OURS)}
    meeting = {"ROSZ_RENDEZVOUS": f"tcp/127.0.0.1:{port}"}
    return own | meeting | {"HOME": str(folder), "PYTHONPATH": str(_ROOT)}


def _memory(pid: int) -> int:
    """Return the bytes of a process, with its share of shared pages."""
    rows = _told(pid, "smaps_rollup").splitlines()
    return next((int(row.split()[1]) for row in rows if row.startswith("Pss:")), 0) * 1024


def _cpu(pid: int) -> float:
    fields = _told(pid, "stat").rpartition(")")[2].split()
    return sum(map(int, fields[11:13])) / _TICKS


def _told(pid: int, name: str) -> str:
    """Return what Linux tells of a process: nothing when it died, which others notice."""
    try:
        return Path(f"/proc/{pid}/{name}").read_text()
    except OSError:
        return ""
