"""Many node processes on one machine, or on several made of namespaces."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Self

import msgspec

__all__ = ("Crowd", "Sight")

_ROOT = Path(__file__).parents[3]
_WORKER = Path(__file__).parent / "worker.py"
_IDLE_SECONDS = 4.0
_TICKS = os.sysconf("SC_CLK_TCK")
_PAGE = os.sysconf("SC_PAGE_SIZE")


class Sight(msgspec.Struct):
    """What was measured of one crowd.

    Attributes:
        mode: ``mesh`` or ``star``.
        count: Nodes, each a process.
        complete: Seconds from the first start until everybody sees everybody.
        memory: Megabytes of a node, its share of what is shared among them counted in.
        cpu: Percent of a core that an idle node takes.
        traffic: Kilobytes over the loopback for each node, until all is complete.
        set_ms: Milliseconds of a set that all acknowledge.
    """

    mode: str
    count: int
    complete: float
    memory: float
    cpu: float
    traffic: float
    set_ms: float


class Crowd:
    """Nodes in a domain of their own.

    Args:
        mode: ``mesh``: peers, each linked to each; ``star``: clients of a core.
        count: How many.
    """

    def __init__(self, mode: str, count: int) -> None:
        self.mode = mode
        self.count = count
        self._folder = tempfile.TemporaryDirectory(prefix="rosz-")
        self._env = {
            **os.environ,
            "HOME": self._folder.name,
            "PYTHONPATH": str(_ROOT),
            "ROSZ_RENDEZVOUS": f"unixsock-stream/{self._folder.name}/z",
            "ROSZ_MODE": "client" if mode == "star" else "peer",
        }
        self._processes: list[subprocess.Popen[str]] = []
        self._core: subprocess.Popen[str] | None = None

    def measure(self, timeout: float) -> Sight | None:
        """Start all and measure; nothing when they are not complete in time."""
        if self.mode == "star":
            self._core = self._start(("-m", "rosz", "core"))
            while "started" not in _out(self._core).readline():
                continue
        before = _loopback_bytes()
        began = time.monotonic()
        for number in range(self.count):
            words = (str(_WORKER), str(number), str(self.count))
            self._processes.append(self._start(words))
        complete = self._complete(began + timeout)
        if complete is None:
            return None
        traffic = (_loopback_bytes() - before) / self.count / 1e3
        memory = sum(map(_memory, self._processes)) / self.count / 1e6
        cpu = self._idle()
        return Sight(
            self.mode, self.count, complete - began, memory, cpu, traffic, self._set() * 1e3
        )

    def _start(self, words: Sequence[str]) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, "-P", *words],
            env=self._env,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )

    def _complete(self, deadline: float) -> float | None:
        """Return when the last of them saw all."""
        latest = 0.0
        for process in self._processes:
            line = _read(process, deadline)
            if not line.startswith("complete"):
                return None
            latest = max(latest, float(line.split()[1]))
        return latest

    def _idle(self) -> float:
        before = sum(map(_cpu, self._processes))
        time.sleep(_IDLE_SECONDS)
        used = sum(map(_cpu, self._processes)) - before
        return used / _IDLE_SECONDS / self.count * 100

    def _set(self) -> float:
        process = self._processes[0]
        assert process.stdin is not None
        process.stdin.write("set\n")
        process.stdin.flush()
        return float(_out(process).readline().split()[1])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exc: object) -> None:
        for process in (*self._processes, self._core):
            if process is not None:
                process.kill()
        for process in (*self._processes, self._core):
            if process is not None:
                process.wait()
                for stream in (process.stdin, process.stdout):
                    if stream is not None:
                        stream.close()
        self._folder.cleanup()


def _out(process: subprocess.Popen[str]) -> IO[str]:
    assert process.stdout is not None
    return process.stdout


def _read(process: subprocess.Popen[str], deadline: float) -> str:
    """Return a line that a process says, or nothing when the time is over."""
    import select

    left = max(0.0, deadline - time.monotonic())
    ready, _, _ = select.select([_out(process)], [], [], left)
    return _out(process).readline() if ready else ""


def _memory(process: subprocess.Popen[str]) -> int:
    """Return the bytes of a process, with its share of shared pages."""
    rollup = Path(f"/proc/{process.pid}/smaps_rollup").read_text()
    line = next(line for line in rollup.splitlines() if line.startswith("Pss:"))
    return int(line.split()[1]) * 1024


def _cpu(process: subprocess.Popen[str]) -> float:
    fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS


def _loopback_bytes() -> int:
    rows = Path("/proc/net/dev").read_text().splitlines()
    loopback = next(row for row in rows if row.strip().startswith("lo:"))
    return int(loopback.split()[1])
