"""Shared memory: is there room in it, and did dead processes leave any?"""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from rosz.doctor.finding import Finding, error, warning
from rosz.session import SEGMENTS

__all__ = ("LEAST_FREE", "check_room", "check_segments")

LEAST_FREE = 8 << 20
"""Bytes below which a few images no longer fit."""

_MIB = 1 << 20
_BORN = 2.0
"""Seconds that a segment's maker has between creating and locking it."""


def check_room(folder: Path = SEGMENTS, least: int = LEAST_FREE) -> Iterator[Finding]:
    """Find out whether shared memory is full.

    Args:
        folder: Where it is.
        least: Bytes that must be free.
    """
    try:
        found = os.statvfs(folder)
    except OSError:
        return  # no Linux: shared memory is somewhere else
    free, size = found.f_bavail * found.f_frsize, found.f_blocks * found.f_frsize
    if free < least:
        yield error(
            "shared-memory-full",
            f"{folder} is full: {free / _MIB:.0f} MiB of {size / _MIB:.0f} MiB are free",
            _largest(folder),
            f"remove what is left over there, or give it more: mount -o remount,size=1G {folder}"
            " (docker run --shm-size=1g); without ROSZ_SHM nothing of rosz needs it",
        )


def check_segments(folder: Path = SEGMENTS, born: float = _BORN) -> Iterator[Finding]:
    """Find segments of Zenoh's that no process holds any more.

    Args:
        folder: Where segments are.
        born: Seconds for which a segment is left alone, lest it be one that is just being made.
    """
    left: list[str] = []
    with suppress(OSError):
        for path in sorted(folder.glob("*.zenoh")):
            with suppress(OSError):  # gone meanwhile, or not for us to open
                if path.stat().st_ctime < time.time() - born and _is_unused(path):
                    left.append(f"{path}, {path.stat().st_size} bytes")
    if left:
        count = "1 segment" if len(left) == 1 else f"{len(left)} segments"
        yield warning(
            "stale-lock",
            f"{count} of shared memory left by processes that died",
            left,
            "they go when the next rosz process of their owner starts; or remove them by hand",
        )


def _is_unused(path: Path) -> bool:
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return False
    return True


def _largest(folder: Path) -> list[str]:
    sizes: list[tuple[int, str]] = []
    with suppress(OSError):
        for path in folder.iterdir():
            with suppress(OSError):
                sizes.append((path.stat().st_size, path.name))
    return [f"{folder / name}: {size / _MIB:.1f} MiB" for size, name in sorted(sizes)[:-4:-1]]
