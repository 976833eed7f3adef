"""Shared memory that killed processes left behind.

Each process that uses a segment of Zenoh's keeps a shared lock on its file, which ends with the
process however it ends. So who gets the exclusive lock knows that nobody is left, in other
containers neither. Zenoh looks itself, but only as a session with shared memory opens.
"""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

__all__ = ("SEGMENTS", "sweep")

SEGMENTS = Path("/dev/shm")  # noqa: S108  # where Linux has it
_SUFFIX = ".zenoh"
_BORN = 2.0
"""Seconds that a segment's maker has between creating and locking it."""


def sweep(folder: Path = SEGMENTS, *, born: float = _BORN) -> list[str]:
    """Remove the segments that this user's processes made and nobody uses any more.

    Args:
        folder: Where segments are.
        born: Seconds for which a segment is left alone, lest it be one that is just being made.

    Returns:
        The names of the files removed.
    """
    return [path.name for path in _old(folder, time.time() - born) if _removed(path)]


def _old(folder: Path, before: float) -> Iterator[Path]:
    """Yield the segments of this user that were made before a time."""
    with suppress(OSError):  # no such folder: not Linux
        for path in folder.iterdir():
            if path.suffix == _SUFFIX:
                with suppress(FileNotFoundError):  # its owner was faster
                    found = path.stat()
                    if found.st_uid == os.getuid() and found.st_ctime < before:
                        yield path


def _removed(path: Path) -> bool:
    """Remove a segment if nobody holds a lock on it, and tell whether it was."""
    try:
        file = os.open(path, os.O_RDWR)
    except OSError:  # gone meanwhile, or not for us
        return False
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        path.unlink()
    except OSError:  # in use, or gone meanwhile
        return False
    finally:
        os.close(file)
    return True
