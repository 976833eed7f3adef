"""Writing files of chunks, which MCAP and ROS 1's bags are.

Messages are collected into a chunk. A full one goes to a worker, which compresses and writes it,
with no copy where it is not compressed. What has been flushed is read back even if the process is
killed or the disk is full: a chunk that could not be written whole is cut off again.
"""

from __future__ import annotations

import os
import threading
from array import array
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Self

from rosz.bags.bag import SMALL, Attachment, Channel, Compression, Payload
from rosz.bags.writing import BagUnfinished, mark_written
from rosz.errors import BagError, ClosedError
from rosz.worker import Worker

__all__ = ("ChunkWriter", "FilledChunk")

_PIECES = 1000
"""Buffers for one call of writev, which takes at most IOV_MAX of them."""
_MOST_WAITING = 64 << 20
_CLOSE_TIMEOUT = 600.0


class FilledChunk:
    """Records that are written together.

    Attributes:
        parts: Their bytes.
        size: Number of their bytes.
        index: Stamp and place in the chunk of each message, by handle.
    """

    def __init__(self) -> None:
        self.parts: list[Payload] = []
        self.size = 0
        self.index: dict[int, array[int]] = {}
        self._joined: bytearray | None = None  # the last part, if it takes more

    @property
    def start(self) -> int:
        """Stamp of the earliest message."""
        return min(min(index[::2]) for index in self.index.values())

    @property
    def end(self) -> int:
        """Stamp of the latest message."""
        return max(max(index[::2]) for index in self.index.values())

    def add(self, record: bytes) -> None:
        """Add a record of another kind than a message."""
        self._join(record)
        self.size += len(record)

    def add_message(self, head: bytes, data: Payload) -> None:
        """Add a message; the payloads of large ones are not copied."""
        self._join(head)
        if len(data) < SMALL:
            self._join(data)
        else:
            self.parts.append(data)
            self._joined = None
        self.size += len(head) + len(data)

    def _join(self, data: Payload) -> None:
        if self._joined is None:
            self._joined = bytearray()
            self.parts.append(self._joined)
        self._joined += data


_Item = tuple[int, Callable[[], None]]
"""Bytes that wait, and the function that writes them."""


class ChunkWriter:
    """A bag that is written in chunks; see `rosz.bags.BagWriter`.

    It may be used by several threads. A class for a format says what its records are.

    Args:
        path: Path of the file.
        compression: Name of the compression.
        chunk_size: Bytes of messages that are written, and compressed, together.
        replace: Whether a file that exists is replaced; otherwise it is an error.
        capacity: Bytes that may wait for the disk; `write` waits while there are more.
        checksums: Whether chunks have checksums, in a format that has them.

    Attributes:
        path: As given.

    Raises:
        BagError: The file cannot be created.
        UsageError: The compression is not known, or its library is missing.
    """

    format: str

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        compression: Compression = "none",
        chunk_size: int = 768 << 10,
        replace: bool = False,
        capacity: int = _MOST_WAITING,
        checksums: bool = True,
    ) -> None:
        self._checksums = checksums
        self._check_compression(compression)
        self.path = Path(path)
        self._compression = compression
        self._chunk_size = chunk_size
        self._capacity = capacity
        flags = os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC | (os.O_TRUNC if replace else os.O_EXCL)
        try:
            self._file = os.open(path, flags, 0o666)
        except OSError as error:
            raise BagError(f"cannot create it: {error.strerror}", str(path)) from error
        mark_written(self._file)
        self._lock = threading.Lock()
        self._room = threading.Condition(self._lock)
        self._error: BagError | None = None
        self._closed = False
        self._chunk = FilledChunk()
        self._waiting = 0
        self._handles: dict[Channel, int] = {}
        self._counts: dict[int, int] = {}
        self._offset = 0
        self._begun = False
        self._complete = False
        self._worker: Worker[_Item] = Worker("rosz-bag-writer", self._write_item)

    @property
    def size(self) -> int:
        """Bytes written so far, and those that wait for the disk."""
        return self._offset + self._waiting + self._chunk.size

    @property
    def waiting(self) -> int:
        """Bytes that wait for the disk, or for their chunk to be full."""
        return self._waiting + self._chunk.size

    @property
    def written(self) -> int:
        """Number of messages in the file."""
        return sum(self._counts.values())

    def wait_for_room(self, most: int) -> None:
        """Wait while more than so many bytes wait for the disk.

        Args:
            most: The number of bytes.
        """
        if self._waiting > most:
            with self._lock:
                self._room.wait_for(lambda: self._waiting <= most or self._error is not None)

    @property
    def complete(self) -> bool:
        """Whether the file has been closed with its index."""
        return self._complete

    def add(self, channel: Channel) -> int:
        """Add a channel; one that equals an earlier one is the same."""
        with self._lock:
            handle = self._handles.get(channel)
            if handle is None:
                self._check()
                handle = len(self._handles) + 1
                self._define(handle, channel)
                self._handles[channel] = handle
                self._counts[handle] = 0
            return handle

    def write(
        self, handle: int, stamp: int, data: Payload, sent: int | None = None, sequence: int = 0
    ) -> None:
        """Write a message; see `rosz.bags.BagWriter.write`."""
        size = len(data)
        head = self._message_head(handle, stamp, size, stamp if sent is None else sent, sequence)
        with self._lock:
            self._check()
            chunk = self._chunk
            index = chunk.index.get(handle)
            if index is None:
                index = chunk.index[handle] = array("Q")
            index.append(stamp)
            index.append(chunk.size)
            chunk.add_message(head, data)
            if chunk.size >= self._chunk_size:
                self._submit_chunk()
                while self._waiting >= self._capacity and self._error is None:
                    self._room.wait()

    def add_metadata(self, name: str, texts: Mapping[str, str]) -> None:
        """Write named texts; a format that has none leaves them out."""

    def add_attachment(self, attachment: Attachment) -> None:
        """Write a file into the bag; a format that has none leaves it out."""

    def flush(self) -> None:
        """Write everything so far to the file."""
        self.start_flush()
        self._worker.flush(_CLOSE_TIMEOUT)
        with self._lock:
            self._check()

    def start_flush(self) -> None:
        """Begin to write everything so far to the file, without waiting for it.

        Raises:
            BagError: The file cannot be written; also for earlier messages.
        """
        with self._lock:
            self._check()
            self._submit_chunk()

    def close(self) -> None:
        """Finish the file with its index.

        The index is written even if messages could not be, as it may find room.
        """
        with self._lock:
            if self._closed:
                return
            self._closed = True
            self._submit_chunk()
        self._worker.close(_CLOSE_TIMEOUT)
        error = self._error
        try:
            if not self._begun:
                self._append(self._header())
            self._append(*self._tail())
            self._finish()
            self._complete = True
        except BagError as last:
            error = error or last
        finally:
            os.close(self._file)
        if error is not None:
            raise error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc_info: object) -> None:
        self.close()

    # What a format defines.

    def _check_compression(self, name: str) -> None:
        """Raise UsageError if the format has no such compression, or its library is missing."""
        raise NotImplementedError(name)

    def _define(self, handle: int, channel: Channel) -> None:
        """Add the records of a channel to the chunk."""
        raise NotImplementedError

    def _message_head(self, handle: int, stamp: int, size: int, sent: int, sequence: int) -> bytes:
        """Return what stands before a payload."""
        raise NotImplementedError

    def _header(self) -> bytes:
        """Return the begin of the file."""
        raise NotImplementedError

    def _write_chunk(self, chunk: FilledChunk) -> None:
        """Write a chunk, and remember its place."""
        raise NotImplementedError

    def _tail(self) -> list[bytes]:
        """Return the end of the file."""
        raise NotImplementedError

    def _finish(self) -> None:
        """Change what stands at the begin of the file."""

    # Handing over.

    def _check(self) -> None:
        if self._error is not None:
            raise self._error
        if self._closed:
            raise ClosedError(f"the bag '{self.path}' is closed")

    def _submit_chunk(self) -> None:
        """Hand the chunk to the worker, if there are messages in it."""
        chunk = self._chunk
        if chunk.index:
            self._chunk = FilledChunk()
            self._submit(chunk.size, partial(self._write_messages, chunk))

    def _submit(self, size: int, write: Callable[[], None]) -> None:
        self._waiting += size
        self._worker.submit((size, write))

    # On the worker's thread, and at the end on that of `close`.

    def _write_messages(self, chunk: FilledChunk) -> None:
        self._write_chunk(chunk)
        for handle, index in chunk.index.items():
            self._counts[handle] += len(index) // 2

    def _write_item(self, item: _Item) -> None:
        size, write = item
        try:
            if self._error is None:
                if not self._begun:
                    self._append(self._header())
                    self._begun = True
                write()
        except BagError as error:
            self._error = error  # the next call of `write`, `flush` or `close` raises it
        finally:
            with self._lock:
                self._waiting -= size
                self._room.notify_all()

    def _append(self, *parts: Payload) -> None:
        """Write bytes to the file, all of them or none.

        Raises:
            BagError: They cannot be written.
        """
        done = 0
        try:
            for first in range(0, len(parts), _PIECES):
                done += self._write_pieces(list(parts[first : first + _PIECES]))
        except OSError as error:
            with suppress(OSError):  # a pipe, or a disk that is gone
                os.ftruncate(self._file, self._offset)
                os.lseek(self._file, self._offset, os.SEEK_SET)
            raise BagUnfinished(
                error.strerror or str(error), str(self.path), self._offset
            ) from error
        self._offset += done

    def _write_pieces(self, parts: list[Payload]) -> int:
        total = sum(map(len, parts))
        left = total
        while left:
            done = os.writev(self._file, parts)
            left -= done
            while parts and done >= len(parts[0]):
                done -= len(parts.pop(0))
            if done:
                parts[0] = memoryview(parts[0])[done:]
        return total
