"""Locks that distinguish a bag that is being written from one whose writer was killed.

A writer locks its file, and the system unlocks it when the process ends in whatever way.
"""

from __future__ import annotations

import fcntl
import os
from contextlib import suppress

from rosz.errors import BagError, BagUnindexed

__all__ = ("mark_written", "refuse_written", "unindexed")


def mark_written(file: int) -> None:
    """Lock a file that this process writes, where the file system has locks.

    Args:
        file: Descriptor of the file.
    """
    with suppress(OSError):
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _is_written(file: int) -> bool:
    try:
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        fcntl.flock(file, fcntl.LOCK_UN)
    except BlockingIOError:
        return True
    except OSError:  # a file system without locks
        return False
    return False


def unindexed(path: str, file: int) -> BagUnindexed:
    """Return the error of a bag without an index, which says why it has none.

    Args:
        path: Path of the bag.
        file: Descriptor of the file.
    """
    if _is_written(file):
        return BagUnindexed("it is being recorded, and gets its index at the end", path)
    return BagUnindexed("it has no index, as after a recorder was killed", path)


def refuse_written(path: str) -> None:
    """Check that nobody writes a file.

    Raises:
        BagError: Somebody does.
    """
    try:
        file = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return  # reading it says what is wrong
    try:
        if _is_written(file):
            raise BagError("it is being recorded; end the recorder first", path)
    finally:
        os.close(file)
