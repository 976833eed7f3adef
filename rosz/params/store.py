"""Parameters in a file, across kills and power cuts.

One SQLite table of writes, in SQLite's write-ahead mode with full synchronisation: what `save` has
returned from is on the disk. The file is checked before it is used; a damaged one is refused by its
name and left as it is, for whoever wants to rescue something.
"""

from __future__ import annotations

import sqlite3
import threading
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final

from rosz.errors import DecodeError, StoreError
from rosz.params.wire import decode_value, encode_value, join_path, split_path
from rosz.params.writes import DELETED, Write, delete, put

__all__ = ("Store",)

_APPLICATION: Final = 0x726F737A
"""Marks the file as ours: "rosz"."""

_VERSION: Final = 1
_BUSY_SECONDS: Final = 0.0
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
_HEADER: Final = b"SQLite format 3\0"
_LOAD: Final = "SELECT path, time, clock, origin, value, sum FROM writes"
_FORGET_BELOW: Final = """
DELETE FROM writes
WHERE path > :low AND path < :high AND (time, clock) < (:time, :clock)
"""
_KEEP: Final = """
INSERT INTO writes VALUES (:path, :time, :clock, :origin, :value, :sum)
ON CONFLICT (path) DO UPDATE
SET time = :time, clock = :clock, origin = :origin, value = :value, sum = :sum
WHERE (time, clock) <= (:time, :clock)
"""


class Store:
    """A file of writes; it is created if it is not there. Safe for threads.

    Args:
        path: The file.

    Attributes:
        path: The file.

    Raises:
        StoreError: It is damaged, is something else, cannot be written, or another process has it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock = threading.Lock()
        self._closed = False
        with self._named("open"):
            self._check_header()
            self._base = sqlite3.connect(
                path, timeout=_BUSY_SECONDS, isolation_level=None, check_same_thread=False
            )
        try:
            with self._named("open"):
                self._prepare()
        except BaseException:
            self._base.close()
            raise

    def load(self) -> list[Write]:
        """Return what was saved.

        Raises:
            StoreError: The file is damaged.
        """
        with self._lock, self._named("read"):
            rows = self._base.execute(_LOAD).fetchall()
        try:
            return [self._write(*row) for row in rows]
        except DecodeError as error:
            raise self._damaged(str(error)) from error

    def save(self, writes: list[Write]) -> None:
        """Keep writes, all or none; when it returns they are on the disk.

        Raises:
            StoreError: They cannot be written.
        """
        with self._transaction():
            for write in writes:
                self._keep(write)

    def replace(self, writes: list[Write]) -> None:
        """Keep these writes and nothing else; when it returns they are on the disk.

        Raises:
            StoreError: They cannot be written.
        """
        with self._transaction():
            self._base.execute("DELETE FROM writes")
            for write in writes:
                self._keep(write)

    def close(self) -> None:
        """Let go of the file; again is no error."""
        with self._lock:
            self._closed = True
            self._base.close()

    def _check_header(self) -> None:
        """Refuse what SQLite would write over because it is too short to be anything."""
        try:
            with self.path.open("rb") as file:
                start = file.read(len(_HEADER))
        except FileNotFoundError:
            return
        except OSError as error:
            raise StoreError(f"cannot open '{self.path}': {error.strerror}") from error
        if start and start != _HEADER:
            raise self._damaged("it is no SQLite database")

    def _prepare(self) -> None:
        base = self._base
        base.execute("PRAGMA locking_mode = EXCLUSIVE")
        base.execute("BEGIN IMMEDIATE")
        (application,) = base.execute("PRAGMA application_id").fetchone()
        (version,) = base.execute("PRAGMA user_version").fetchone()
        if not application and not base.execute("SELECT name FROM sqlite_master").fetchall():
            base.execute(_SCHEMA)
            base.execute(f"PRAGMA application_id = {_APPLICATION}")
            base.execute(f"PRAGMA user_version = {_VERSION}")
        elif application != _APPLICATION:
            raise StoreError(f"'{self.path}' is a database, but not one of parameters; {_CHOOSE}")
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

    def _keep(self, write: Write) -> None:
        path = join_path(write.path)
        # Below "a/b" lies what sorts between "a/b/" and "a/b0", as "0" follows "/".
        low, high = (f"{path}/", f"{path}0") if path else ("", "\U0010ffff")
        stamp = {"time": write.time, "clock": write.clock}
        self._base.execute(_FORGET_BELOW, {"low": low, "high": high, **stamp})
        value = None if write.value is DELETED else encode_value(write.value)
        row = (path, write.time, write.clock, write.origin, value)
        values = {"path": path, "origin": write.origin, "value": value, "sum": _sum(*row)}
        self._base.execute(_KEEP, {**values, **stamp})

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        with self._lock, self._named("write"):
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
        if checksum != _sum(path, time, clock, origin, value):
            raise DecodeError("parameter", -1, f"the sum of '/{path}' is not {checksum}")
        stamp = (time, clock)
        if value is None:
            return delete(split_path(path), stamp, origin)
        return put(split_path(path), stamp, decode_value(value), origin)

    @contextmanager
    def _named(self, what: str) -> Iterator[None]:
        """Turn SQLite's errors into ours, naming the file."""
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
            f"'{self.path}' is damaged ({why}); it is left as it is: move it away, or {_CHOOSE}"
        )


def _sum(path: str, time: int, clock: str, origin: str, value: bytes | None) -> int:
    """Return what tells a row that SQLite takes for whole from what was written."""
    text = f"{path}\0{time}\0{clock}\0{origin}\0{value is None}"
    return zlib.crc32(value or b"", zlib.crc32(text.encode()))


_CHOOSE: Final = "name another file"
