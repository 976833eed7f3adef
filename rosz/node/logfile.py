"""The log file of a node, which never outgrows its bound."""

from __future__ import annotations

import logging
import os
import stat
from collections.abc import Callable
from contextlib import suppress
from io import FileIO
from pathlib import Path

from rosz.node.sink import Sink

__all__ = ("BACKUPS", "MAX_BYTES", "FileSink", "log_file_name")

MAX_BYTES = 10_000_000
"""Bytes that a log file grows to before it is put aside."""

BACKUPS = 4
"""Files put aside that are kept."""

_FORMAT = "[%(name)s][%(levelname)s] %(asctime)s: %(message)s"
_CUT = b" [cut]\n"


def log_file_name(node: str) -> str:
    """Return the name of a node's log file: ``/ns/talker`` writes ``ns-talker.log``."""
    return f"{node.strip('/').replace('/', '-')}.log"


class FileSink(Sink):
    """Append to a file; when it is full, put it aside as ``.1``, that one as ``.2``, and so on.

    The file, and its folder, are made with the first record. Each record is handed to the system
    at once, so that a killed process has logged all. While the file cannot be written, records are
    lost, which is told once; the next record tries anew. Where another process put the file aside,
    or somebody removed it, the next record goes to a new one.

    Args:
        path: The file. What is no regular file, such as ``/dev/null``, is never put aside.
        on_trouble: See `Sink`.
        max_bytes: Most bytes in one file; a longer record is cut.
        backups: How many full files to keep.
    """

    def __init__(
        self,
        path: Path,
        on_trouble: Callable[[str], object],
        *,
        max_bytes: int = MAX_BYTES,
        backups: int = BACKUPS,
    ) -> None:
        super().__init__(on_trouble)
        self.path = path
        self.setFormatter(logging.Formatter(_FORMAT))
        self._max_bytes = max_bytes
        self._backups = backups
        self._file: FileIO | None = None
        self._size = 0
        self._identity = (0, 0)
        self._regular = True
        self._torn = False
        self._told = False

    def close(self) -> None:
        """Close the file; a later record opens it again.

        Configuring logging anew closes all handlers of a process, also those that it does not know.
        """
        self.acquire()
        try:
            self._close_file()
        finally:
            self.release()
        super().close()

    def _write(self, record: logging.LogRecord) -> None:
        data = self.format(record).encode("utf-8", "backslashreplace") + b"\n"
        if len(data) > self._max_bytes:
            whole = data[: max(self._max_bytes - len(_CUT), 0)].decode("utf-8", "ignore")
            data = whole.encode() + _CUT
        try:
            self._append(data)
        except OSError as error:
            self._close_file()
            if not self._told:
                self._told = True
                self._on_trouble(
                    f"cannot write log file '{self.path}': {error.strerror or error};"
                    " the program goes on without it"
                )

    def _append(self, data: bytes) -> None:
        file = self._current() or self._open()
        if self._regular and self._size and self._size + len(data) > self._max_bytes:
            self._close_file()
            self._put_aside()
            file = self._open()
        data = b"\n" + data if self._torn else data
        while data:
            self._torn = True
            written = file.write(data)
            data = data[written:]
        self._torn = False

    def _current(self) -> FileIO | None:
        """Return the open file, unless its name has become that of another, or of none."""
        if self._file is not None and self._regular:
            with suppress(FileNotFoundError):
                status = self.path.stat()
                self._size = status.st_size
                if (status.st_dev, status.st_ino) == self._identity:
                    return self._file
            self._close_file()
        return self._file

    def _open(self) -> FileIO:
        with suppress(FileExistsError):  # a file is in the way, which opening tells better
            self.path.parent.mkdir(parents=True, exist_ok=True)
        self._file = FileIO(self.path, "a")
        status = os.fstat(self._file.fileno())
        self._size = status.st_size
        self._identity = (status.st_dev, status.st_ino)
        self._regular = stat.S_ISREG(status.st_mode)
        return self._file

    def _close_file(self) -> None:
        file, self._file = self._file, None
        if file is not None:
            file.close()

    def _put_aside(self) -> None:
        if not self._backups:
            self.path.unlink(missing_ok=True)
        for number in range(self._backups, 0, -1):
            source = self._numbered(number - 1)
            try:
                source.replace(self._numbered(number))
            except FileNotFoundError:
                continue

    def _numbered(self, number: int) -> Path:
        return self.path.with_name(f"{self.path.name}.{number}") if number else self.path
