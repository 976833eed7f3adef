"""Shared memory that killed processes left behind.

Seen with eclipse-zenoh 1.10.2: Zenoh removes abandoned segments only when a session with shared
memory opens. Without this module, the memory of a process that was killed stays allocated until
then. Not reported upstream yet.

Each process that uses a segment holds a shared lock on its file. The kernel releases the lock when
the process ends, in whatever way. So whoever gets the exclusive lock knows that no process uses the
segment, not even in another container.
"""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

__all__ = ("SEGMENTS", "remove_abandoned_segments")

SEGMENTS = Path("/dev/shm")  # noqa: S108  # the place on Linux
"""The folder of the segments."""
_SUFFIX = ".zenoh"
_MIN_AGE = 2.0
"""Seconds that the maker of a segment has between creating and locking it."""


def remove_abandoned_segments(folder: Path = SEGMENTS, *, min_age: float = _MIN_AGE) -> list[str]:
    """Remove the segments that this user's processes made and that nobody uses any more.

    Args:
        folder: The folder of the segments.
        min_age: Age in seconds below which a segment is left alone, because it may be in the
            making.

    Returns:
        The names of the files removed.
    """
    return [path.name for path in _old_segments(folder, time.time() - min_age) if _remove(path)]


def _old_segments(folder: Path, before: float) -> Iterator[Path]:
    """Yield the segments of this user that were made before a time."""
    with suppress(OSError):  # no such folder: not Linux
        for path in folder.iterdir():
            if path.suffix == _SUFFIX:
                with suppress(FileNotFoundError):  # its owner was faster
                    found = path.stat()
                    if found.st_uid == os.getuid() and found.st_ctime < before:
                        yield path


def _remove(path: Path) -> bool:
    """Remove a segment if nobody holds a lock on it; return whether it was removed."""
    try:
        file = os.open(path, os.O_RDWR)
    except OSError:  # gone meanwhile, or of another user
        return False
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        path.unlink()
    except OSError:  # in use, or gone meanwhile
        return False
    finally:
        os.close(file)
    return True
