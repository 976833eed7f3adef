"""The descendants of a launched process, also those that left its process group.

What a launch starts carries a mark in its environment, which descendants inherit. Where the system
shows environments (``/proc``), they are found by it, wherever they moved and whoever adopted them.
"""

from __future__ import annotations

import math
import os
import signal
import time
from contextlib import suppress
from pathlib import Path

import msgspec

from rosz.launch.run.command import TAG

__all__ = ("Census", "Usage", "family", "group_lives", "kill_family", "usage")

_PROC = Path("/proc")
_TICKS = os.sysconf("SC_CLK_TCK")
_PAGE = os.sysconf("SC_PAGE_SIZE")
_CENSUS_SECONDS = 0.05
_STATE, _GROUP, _UTIME, _STIME, _VSIZE, _RSS = 0, 2, 11, 12, 20, 21
_LOOKS, _LOOK_SECONDS = 10, 0.002
"""How often those are looked at again that show no environment: some have none for good."""


class Usage(msgspec.Struct, frozen=True):
    """What a process and its descendants have used.

    Attributes:
        processes: How many there are.
        cpu: Seconds of processor time so far.
        memory: Bytes of memory held now.
    """

    processes: int = 0
    cpu: float = 0.0
    memory: int = 0


def group_lives(group: int) -> bool:
    """Tell whether a process group, whose leader has been reaped, has members that run.

    Those that have ended, and that whoever adopted them is slow to reap, do not count.
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
    """Return the fields of ``/proc/PID/stat`` behind the name of the program."""
    text = Path(_PROC, pid, "stat").read_text(errors="replace")
    return text.rpartition(")")[2].split()


def family(tag: str) -> dict[int, str]:
    """Return the processes whose mark is, or begins with, a text, with their whole marks."""
    return _look(tag)[0]


def _look(tag: str) -> tuple[dict[int, str], bool]:
    """Return the processes of a family, and whether some may be that show no environment now.

    That is so in the instant in which a process becomes another program.
    """
    found: dict[int, str] = {}
    unclear = False
    name = TAG.encode() + b"="
    wanted = name + tag.encode()
    for pid in _processes():
        with suppress(OSError):  # it ended meanwhile, or belongs to another user
            environ = Path(_PROC, pid, "environ").read_bytes()
            # What has ended, and threads of the kernel, hold no memory either.
            unclear = unclear or (not environ and _stat(pid)[_VSIZE] != "0")
            if wanted not in environ:
                continue
            for variable in environ.split(b"\0"):
                mark = variable.removeprefix(name).decode(errors="replace")
                if variable.startswith(wanted) and belongs(mark, tag):
                    found[int(pid)] = mark
    return found, unclear


def belongs(mark: str, tag: str) -> bool:
    """Tell whether a mark is a tag, or one given below it."""
    return mark == tag or mark.startswith(f"{tag}:")


def kill_family(tag: str) -> None:
    """Kill all processes that carry a mark; those that appear meanwhile too."""
    killed: set[int] = set()
    looks = _LOOKS
    while looks:
        found, unclear = _look(tag)
        fresh = set(found) - killed
        for pid in fresh:
            with suppress(ProcessLookupError, PermissionError):
                os.kill(pid, signal.SIGKILL)
        killed |= fresh
        if not fresh:
            if not unclear:
                return
            looks -= 1
            time.sleep(_LOOK_SECONDS)


class Census:
    """The descendants of a launch, counted anew when somebody asks and the count is old.

    Args:
        tag: What marks them.
    """

    def __init__(self, tag: str) -> None:
        self.tag = tag
        self._taken = -math.inf
        self._marks: dict[int, str] = {}

    def below(self, mark: str) -> list[int]:
        """Return the processes that carry a mark, or one below it."""
        if time.monotonic() - self._taken > _CENSUS_SECONDS:
            self._marks = family(self.tag)
            self._taken = time.monotonic()
        return [pid for pid, other in self._marks.items() if belongs(other, mark)]


def usage(tag: str) -> dict[str, Usage]:
    """Return what processes have used, by their whole marks."""
    totals: dict[str, Usage] = {}
    for pid, mark in family(tag).items():
        with suppress(OSError, IndexError, ValueError):  # it ended meanwhile
            fields = _stat(str(pid))
            before = totals.get(mark, Usage())
            totals[mark] = Usage(
                before.processes + 1,
                before.cpu + (int(fields[_UTIME]) + int(fields[_STIME])) / _TICKS,
                before.memory + int(fields[_RSS]) * _PAGE,
            )
    return totals


def _processes() -> list[str]:
    try:
        return [entry.name for entry in _PROC.iterdir() if entry.name.isdigit()]
    except FileNotFoundError:  # another system: only process groups are known there
        return []
