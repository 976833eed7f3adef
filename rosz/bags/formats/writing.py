"""Bags that are being written, and the remains of those that cannot be finished.

A writer locks its file, and the system unlocks it when the process ends in whatever way. So a bag
that is being written differs from one whose writer was killed.
"""

from __future__ import annotations

import fcntl
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rosz.errors import BagError, BagUnindexed


class BagUnfinished(BagError):
    """A bag that cannot be written any further; the offset is -1 if unknown."""

    def __init__(self, cause: str, path: str, offset: int = -1) -> None:
        self.cause = cause
        reason = f"cannot write to it: {cause}; what was written before can be read"
        super().__init__(reason, path, offset)


@contextmanager
def removed_unfinished(made: Path, target: str | os.PathLike[str]) -> Iterator[None]:
    """Return a context that removes a file or folder if the body fails.

    Args:
        made: The file or folder.
        target: The bag that it was to become.

    Raises:
        BagError: It cannot be written; the error names the bag that it was to become.
    """
    try:
        yield
    except BaseException as error:
        if made.is_dir():
            shutil.rmtree(made)
        else:
            made.unlink(missing_ok=True)
        if isinstance(error, BagUnfinished):
            reason = f"cannot write it: {error.cause}; what was written has been removed"
            raise BagError(reason, os.fspath(target)) from error
        raise


def mark_written(file: int) -> None:
    """Lock a file that this process writes, where the file system has locks."""
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
    """Return the error of a bag without an index, which says why it has none."""
    if _is_written(file):
        return BagUnindexed("it is being recorded, and gets its index at the end", path)
    return BagUnindexed("it has no index, as after a recorder was killed", path)


def refuse_written(path: str) -> None:
    """Raise a `BagError` if somebody writes a file."""
    try:
        file = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return  # reading it raises an error with the reason
    try:
        if _is_written(file):
            raise BagError("it is being recorded; end the recorder first", path)
    finally:
        os.close(file)
