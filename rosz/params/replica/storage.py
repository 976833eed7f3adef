"""Storage of parameters in a file, which survives kills and power cuts.

The file holds a table of writes and the horizon of the history, in SQLite's write-ahead mode with
full synchronisation: when `StoreFile.save` returns, the writes are on the disk. The file is checked
before it is used. A damaged file is refused by name and left unchanged, so that its content can be
rescued.

`Storage` saves the writes that a replica applies, on a thread of its own.
"""

from __future__ import annotations

import sqlite3
import threading
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final

from rosz.errors import DecodeError, RoszError, StoreError
from rosz.params.replica.core.effects import Compact, Save
from rosz.params.replica.core.events import Saved
from rosz.params.wire import decode_value, encode_value, join_path, split_path
from rosz.params.writes import DELETED, Write, put
from rosz.worker import Worker

_APPLICATION: Final = 0x726F737A
"""SQLite's application id of a file of parameters: "rosz" in ASCII."""

_VERSION: Final = 2
_WITHOUT_HORIZON: Final = 1
_CHOOSE: Final = "name another file"
_SCHEMA: Final = """
CREATE TABLE writes (
    path TEXT PRIMARY KEY,
    time INTEGER NOT NULL,
    clock TEXT NOT NULL,
    origin TEXT NOT NULL,
    value BLOB,
    sum INTEGER NOT NULL
) WITHOUT ROWID
"""
_HORIZON_SCHEMA: Final = "CREATE TABLE horizon (time INTEGER NOT NULL)"
_HEADER: Final = b"SQLite format 3\0"
_LOAD: Final = "SELECT path, time, clock, origin, value, sum FROM writes"
_DELETE_HIDDEN: Final = """
DELETE FROM writes
WHERE path > :low AND path < :high AND (time, clock) < (:time, :clock)
"""
_INSERT: Final = """
INSERT INTO writes VALUES (:path, :time, :clock, :origin, :value, :sum)
ON CONFLICT (path) DO UPDATE
SET time = :time, clock = :clock, origin = :origin, value = :value, sum = :sum
WHERE (time, clock) <= (:time, :clock)
"""


class StoreFile:
    """A file of writes, which is created if it does not exist. Safe for threads.

    Args:
        path: Path of the file.

    Attributes:
        path: Path of the file.

    Raises:
        StoreError: The file is damaged, holds something else, cannot be written, or is in use by
            another process.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock = threading.Lock()
        self._closed = False
        with self._errors("open"):
            self._check_header()
            self._base = sqlite3.connect(
                path, timeout=0.0, isolation_level=None, check_same_thread=False
            )
        try:
            with self._errors("open"):
                self._prepare()
        except BaseException:
            self._base.close()
            raise

    def load(self) -> tuple[list[Write], int]:
        """Return the writes in the file, and the time up to which deletions may be forgotten.

        Raises:
            StoreError: The file is damaged.
        """
        with self._lock, self._errors("read"):
            rows = self._base.execute(_LOAD).fetchall()
            (horizon,) = self._base.execute("SELECT ifnull(max(time), 0) FROM horizon").fetchone()
        try:
            return [self._write(*row) for row in rows], horizon
        except DecodeError as error:
            raise self._damaged(str(error)) from error

    def save(self, writes: list[Write]) -> None:
        """Add writes, all or none of them; when this returns they are on the disk.

        Raises:
            StoreError: The writes cannot be saved.
        """
        with self._transaction():
            for write in writes:
                self._insert(write)

    def replace(self, writes: list[Write], horizon: int = 0) -> None:
        """Replace everything in the file; when this returns the writes are on the disk.

        Args:
            writes: All writes.
            horizon: Time up to which deletions may be forgotten.

        Raises:
            StoreError: The writes cannot be saved.
        """
        with self._transaction():
            self._base.execute("DELETE FROM writes")
            self._base.execute("DELETE FROM horizon")
            self._base.execute("INSERT INTO horizon VALUES (?)", (horizon,))
            for write in writes:
                self._insert(write)

    def close(self) -> None:
        """Close the file; a second call has no effect."""
        with self._lock:
            self._closed = True
            self._base.close()

    def _check_header(self) -> None:
        """Refuse a file that SQLite would overwrite because it is too short for a database."""
        try:
            with self.path.open("rb") as file:
                start = file.read(len(_HEADER))
        except FileNotFoundError:
            return
        except OSError as error:
            raise StoreError(f"cannot open '{self.path}': {error.strerror}") from error
        if start and start != _HEADER:
            raise self._damaged("it is not an SQLite database")

    def _prepare(self) -> None:
        base = self._base
        base.execute("PRAGMA locking_mode = EXCLUSIVE")
        base.execute("BEGIN IMMEDIATE")
        (application,) = base.execute("PRAGMA application_id").fetchone()
        (version,) = base.execute("PRAGMA user_version").fetchone()
        if not application and not base.execute("SELECT name FROM sqlite_master").fetchall():
            base.execute(_SCHEMA)
            base.execute(_HORIZON_SCHEMA)
            base.execute(f"PRAGMA application_id = {_APPLICATION}")
            base.execute(f"PRAGMA user_version = {_VERSION}")
        elif application != _APPLICATION:
            raise StoreError(f"'{self.path}' is a database, but not of parameters; {_CHOOSE}")
        elif version == _WITHOUT_HORIZON:
            base.execute(_HORIZON_SCHEMA)
            base.execute(f"PRAGMA user_version = {_VERSION}")
        elif version != _VERSION:
            raise StoreError(
                f"'{self.path}' is of version {version}, expected {_VERSION}; {_CHOOSE}, or "
                "use the version of rosz that wrote it"
            )
        (verdict,) = base.execute("PRAGMA integrity_check(1)").fetchone()
        if verdict != "ok":
            raise self._damaged(verdict)
        base.execute("COMMIT")
        base.execute("PRAGMA journal_mode = WAL")
        base.execute("PRAGMA synchronous = FULL")

    def _insert(self, write: Write) -> None:
        path = join_path(write.path)
        # Paths below "a/b" sort between "a/b/" and "a/b0", because "0" follows "/".
        low, high = (f"{path}/", f"{path}0") if path else ("", "\U0010ffff")
        stamp = {"time": write.time, "clock": write.clock}
        self._base.execute(_DELETE_HIDDEN, {"low": low, "high": high, **stamp})
        value = None if write.value is DELETED else encode_value(write.value)
        row = (path, write.time, write.clock, write.origin, value)
        values = {"path": path, "origin": write.origin, "value": value, "sum": _checksum(*row)}
        self._base.execute(_INSERT, {**values, **stamp})

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        with self._lock, self._errors("write"):
            self._base.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._base.execute("COMMIT")
            except BaseException:
                with suppress(sqlite3.Error):
                    self._base.execute("ROLLBACK")
                raise

    def _write(self, path: str, time: int, clock: str, origin: str, *rest: Any) -> Write:
        value, checksum = rest
        if checksum != _checksum(path, time, clock, origin, value):
            raise DecodeError("parameter", -1, f"the checksum of '/{path}' is not {checksum}")
        content = DELETED if value is None else decode_value(value)
        return put(split_path(path), (time, clock), content, origin)

    @contextmanager
    def _errors(self, what: str) -> Iterator[None]:
        """Raise SQLite's errors as `StoreError`, which names the file."""
        try:
            yield
        except sqlite3.OperationalError as error:
            if "locked" in str(error):
                raise StoreError(
                    f"'{self.path}' is in use by another process; {_CHOOSE}"
                ) from error
            raise StoreError(f"cannot {what} '{self.path}': {error}") from error
        except sqlite3.ProgrammingError as error:
            if not self._closed:
                raise
            raise StoreError(f"cannot {what} '{self.path}': it is closed") from error
        except sqlite3.DatabaseError as error:
            raise self._damaged(str(error)) from error

    def _damaged(self, why: str) -> StoreError:
        return StoreError(
            f"'{self.path}' is damaged ({why}); it is left unchanged: move it away, or {_CHOOSE}"
        )


def _checksum(path: str, time: int, clock: str, origin: str, value: bytes | None) -> int:
    """Return the checksum of a row, which detects damage that SQLite does not."""
    text = f"{path}\0{time}\0{clock}\0{origin}\0{value is None}"
    return zlib.crc32(value or b"", zlib.crc32(text.encode()))


class Storage:
    """Saves the writes of a replica on a thread of its own, many at a time.

    Args:
        file: File that the writes are saved in.

    Attributes:
        on_saved: Function called on that thread with what is done; see `Saved`.
    """

    def __init__(self, file: StoreFile) -> None:
        self.on_saved: Callable[[Saved], object] = bool
        self._file = file
        self._worker: Worker[Callable[[], object]] = Worker("rosz-params-save")
        self._batch: list[Save] = []

    def load(self) -> tuple[list[Write], int]:
        """Return the stored writes, and the time up to which deletions may be forgotten.

        Raises:
            StoreError: The file is damaged.
        """
        return self._file.load()

    def save(self, effect: Save | Compact) -> None:
        """Save writes soon."""
        self._worker.submit(lambda: self._do(effect))

    def close(self) -> None:
        """Save the last writes and close the file; a second call has no effect."""
        self._worker.submit(self._flush)
        self._worker.close()
        self._file.close()

    def _do(self, effect: Save | Compact) -> None:
        if isinstance(effect, Save):
            self._batch.append(effect)
            if not self._worker.waiting:  # else the next task saves these as well
                self._flush()
            return
        self._flush()
        self._report(effect.number, lambda: self._file.replace(effect.writes, effect.horizon))

    def _flush(self) -> None:
        batch, self._batch = self._batch, []
        if batch:
            writes = [write for save in batch for write in save.writes]
            self._report(batch[-1].number, lambda: self._file.save(writes))

    def _report(self, number: int, save: Callable[[], object]) -> None:
        reason = ""
        try:
            save()
        except RoszError as error:
            reason = str(error)
        self.on_saved(Saved(number, reason))
