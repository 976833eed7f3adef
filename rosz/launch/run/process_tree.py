"""The processes of a launch, found by a variable that descendants inherit.

Everything that a launch starts carries a tag in its environment, which descendants inherit. Where
the system shows environments (``/proc``), a `ProcessTree` finds them by it, also those that left
their process group or whose parent has ended.

The relay loads this file alone, so it imports only the standard library.
"""

from __future__ import annotations

import math
import os
import signal
import time
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

TAG = "ROSZ_LAUNCH"
"""Environment variable with the tag by which descendants of a launched process are found."""

_PROC = Path("/proc")
_TICKS = os.sysconf("SC_CLK_TCK")
_PAGE = os.sysconf("SC_PAGE_SIZE")
_STATE, _GROUP, _UTIME, _STIME, _VSIZE, _RSS = 0, 2, 11, 12, 20, 21
_CACHE_SECONDS = 0.05  # a scan reads the environment of every process of the machine
_KILL_ATTEMPTS, _KILL_INTERVAL = 10, 0.002
"""How often to look again for processes without an environment; some never have one."""
_GRACE_SECONDS = 0.75
"""Time from SIGINT to SIGTERM, and to SIGKILL, for the processes of a launch that was killed."""


@dataclass(frozen=True)
class Usage:
    """The resources that a process and its descendants use.

    Attributes:
        processes: Number of processes.
        cpu: Processor time so far in seconds.
        memory: Memory held now in bytes.
    """

    processes: int = 0
    cpu: float = 0.0
    memory: int = 0


class ProcessTree:
    """The processes that carry a tag, or one below it, in their environment."""

    def __init__(self, tag: str) -> None:
        self.tag = tag
        self._cached_at = -math.inf
        self._cached: dict[int, str] = {}

    def tags(self) -> dict[int, str]:
        """Return the whole tags of the processes by process id."""
        return self._scan()[0]

    def below(self, tag: str) -> list[int]:
        """Return the processes that carry a tag or one below it, from a scan a moment ago."""
        if time.monotonic() - self._cached_at > _CACHE_SECONDS:
            self._cached = self.tags()
            self._cached_at = time.monotonic()
        return [pid for pid, other in self._cached.items() if _is_below(other, tag)]

    def kill(self) -> None:
        """Kill all processes, including those that appear meanwhile."""
        killed: set[int] = set()
        attempts = _KILL_ATTEMPTS
        while attempts:
            tags, unclear = self._scan()
            fresh = set(tags) - killed
            for pid in fresh:
                _send(pid, signal.SIGKILL)
            killed |= fresh
            if not fresh:
                if not unclear:
                    return
                attempts -= 1
                time.sleep(_KILL_INTERVAL)

    def usage(self) -> dict[str, Usage]:
        """Return the resources used by the processes, by whole tag."""
        totals: dict[str, Usage] = {}
        for pid, tag in self.tags().items():
            with suppress(OSError, IndexError, ValueError):  # it ended meanwhile
                fields = _stat(str(pid))
                before = totals.get(tag, Usage())
                totals[tag] = Usage(
                    before.processes + 1,
                    before.cpu + (int(fields[_UTIME]) + int(fields[_STIME])) / _TICKS,
                    before.memory + int(fields[_RSS]) * _PAGE,
                )
        return totals

    def _scan(self) -> tuple[dict[int, str], bool]:
        """Return the whole tags, and whether some process shows no environment at the moment.

        That is so in the instant in which a process executes another program.
        """
        tags: dict[int, str] = {}
        unclear = False
        name = TAG.encode() + b"="
        wanted = name + self.tag.encode()
        for pid in _processes():
            with suppress(OSError):  # it ended meanwhile, or belongs to another user
                environ = Path(_PROC, pid, "environ").read_bytes()
                # Ended processes and threads of the kernel have no environment and no memory.
                unclear = unclear or (not environ and _stat(pid)[_VSIZE] != "0")
                if wanted not in environ:
                    continue
                for variable in environ.split(b"\0"):
                    tag = variable.removeprefix(name).decode(errors="replace")
                    if variable.startswith(wanted) and _is_below(tag, self.tag):
                        tags[int(pid)] = tag
        return tags, unclear


def end_processes(tag: str, groups: Collection[int]) -> None:
    """End the processes of a launch that was killed: SIGINT, then SIGTERM, then SIGKILL.

    Args:
        tag: Tag of the nodes.
        groups: Process groups of the nodes, for nodes that do not show their environment.
    """
    tree = ProcessTree(tag)
    for number in (signal.SIGINT, signal.SIGTERM):
        deadline = time.monotonic() + _GRACE_SECONDS
        signalled: set[int] = set()
        # A process may appear at any moment; one that was being started shows no tag yet.
        while time.monotonic() < deadline:
            pids = {*tree.tags(), *_members(groups)} - signalled
            for pid in pids:
                _send(pid, number)
            signalled |= pids
            time.sleep(_CACHE_SECONDS)
    tree.kill()
    for pid in _members(groups):
        _send(pid, signal.SIGKILL)


def _send(pid: int, number: signal.Signals) -> None:
    # It may have ended meanwhile, or belong to another user.
    with suppress(ProcessLookupError, PermissionError):
        os.kill(pid, number)


def _members(groups: Collection[int]) -> list[int]:
    return [int(pid) for pid in _processes() if any(_runs_in(pid, group) for group in groups)]


def _is_below(tag: str, parent: str) -> bool:
    return tag == parent or tag.startswith(f"{parent}:")


def group_alive(group: int) -> bool:
    """Return whether a process group, whose leader has been reaped, has running members.

    Members that have ended but have not been reaped by their new parent do not count.
    """
    with suppress(ChildProcessError):
        while os.waitpid(-group, os.WNOHANG)[0]:
            pass
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    pids = _processes()
    return not pids or any(_runs_in(pid, group) for pid in pids)


def _runs_in(pid: str, group: int) -> bool:
    try:
        fields = _stat(pid)
    except OSError:  # it ended meanwhile
        return False
    return int(fields[_GROUP]) == group and fields[_STATE] not in {"Z", "X"}


def _stat(pid: str) -> list[str]:
    """Return the fields of ``/proc/PID/stat`` after the name of the program."""
    text = Path(_PROC, pid, "stat").read_text(errors="replace")
    return text.rpartition(")")[2].split()


def _processes() -> list[str]:
    try:
        return [entry.name for entry in _PROC.iterdir() if entry.name.isdigit()]
    except FileNotFoundError:  # a system without /proc: only process groups are known
        return []
