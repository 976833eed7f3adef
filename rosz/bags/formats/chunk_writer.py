"""Writing files of chunks, which MCAP and ROS 1's bags are.

Messages are collected into a chunk. A full one is compressed and written at once; without
compression it is not copied. Flushed data are readable even if the process is killed or the disk is
full: a chunk that could not be written whole is cut off again.
"""

from __future__ import annotations

import os
import threading
from array import array
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from rosz.bags import bag
from rosz.bags.formats.writing import BagUnfinished, mark_written
from rosz.errors import BagError, ClosedError
from rosz.lifecycle import Closing

_PIECES = 1000
"""Buffers for one call of writev, which takes at most IOV_MAX of them."""


class FilledChunk:
    """Records that are written together; `index` has stamps and offsets of messages, by handle."""

    def __init__(self) -> None:
        self.parts: list[bag.Payload] = []
        self.size = 0
        self.index: dict[int, array[int]] = {}
        self._joined: bytearray | None = None  # the last part, if more is appended to it

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

    def add_message(self, head: bytes, data: bag.Payload) -> None:
        """Add a message; the payloads of large ones are not copied."""
        self._join(head)
        if len(data) < bag.SMALL:
            self._join(data)
        else:
            self.parts.append(data)
            self._joined = None
        self.size += len(head) + len(data)

    def _join(self, data: bag.Payload) -> None:
        if self._joined is None:
            self._joined = bytearray()
            self.parts.append(self._joined)
        self._joined += data


class ChunkWriter(Closing):
    """A bag that is written in chunks; see `rosz.bags.BagWriter`. Several threads may use it.

    The class of a format defines its records.

    Args:
        chunk_size: Bytes of messages that are written, and compressed, together.
        replace: Whether a file that exists is replaced; otherwise it is an error.
        checksums: Whether chunks have checksums, in a format that has them.

    Attributes:
        complete: Whether the file has been closed with its index.
        latest: Latest stamp that the format can hold; later ones become it.
    """

    format: str
    latest = (1 << 64) - 1

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        compression: bag.Compression = "none",
        chunk_size: int = 768 << 10,
        replace: bool = False,
        checksums: bool = True,
    ) -> None:
        self._checksums = checksums
        self._prepare(compression)
        self.path = Path(path)
        self._compression = compression
        self._chunk_size = chunk_size
        flags = os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC | (os.O_TRUNC if replace else os.O_EXCL)
        with bag.FileErrors(path, "cannot create it"):
            self._file = os.open(path, flags, 0o666)
        mark_written(self._file)
        self._lock = threading.Lock()
        self._error: BagError | None = None
        self._closed = False
        self._chunk = FilledChunk()
        self._handles: dict[bag.Channel, int] = {}
        self._counts: dict[int, int] = {}
        self._offset = 0
        self._begun = False
        self.complete: bool = False

    @property
    def size(self) -> int:
        """Bytes written so far, and those that wait for their chunk to be full."""
        return self._offset + self._chunk.size

    @property
    def message_count(self) -> int:
        """Number of messages in the file, without those that wait for their chunk to be full."""
        return sum(self._counts.values())

    def add(self, channel: bag.Channel) -> int:
        """Add a channel, and return its handle; equal channels share one."""
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
        self, handle: int, stamp: int, data: bag.Payload, sent: int | None = None, sequence: int = 0
    ) -> None:
        """Write a message; see `rosz.bags.BagWriter.write`."""
        size, stamp = len(data), min(max(stamp, 0), self.latest)
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
                self._end_chunk()

    def add_metadata(self, name: str, texts: Mapping[str, str]) -> None:
        """Write named texts; a format that has none leaves them out."""

    def add_attachment(self, attachment: bag.Attachment) -> None:
        """Write a file into the bag; a format that has none leaves it out."""

    def flush(self) -> None:
        """Write everything so far to the file."""
        with self._lock:
            self._check()
            self._end_chunk()

    def close(self) -> None:
        """Finish the file with its index.

        The index is written even if messages could not be: it may still fit on a full disk.
        """
        with self._lock:
            if self._closed:
                return
            self._closed = True
            with suppress(BagError):
                if self._error is None:
                    self._end_chunk()
            error = self._error
            try:
                self._begin()
                self._append(*self._tail())
                self._finish()
                self.complete = True
            except BagError as last:
                error = error or last
            finally:
                os.close(self._file)
        if error is not None:
            raise error

    # What a format defines.

    def _prepare(self, compression: str) -> None:
        """Check the compression, and set the attributes of the format, before the file is created.

        Raises:
            UsageError: The format has no such compression, or its library is missing.
        """
        raise NotImplementedError(compression)

    def _define(self, handle: int, channel: bag.Channel) -> None:
        """Add the records of a channel to the chunk."""
        raise NotImplementedError

    def _message_head(self, handle: int, stamp: int, size: int, sent: int, sequence: int) -> bytes:
        """Return what stands before a payload."""
        raise NotImplementedError

    def _header(self) -> bytes:
        """Return the beginning of the file."""
        raise NotImplementedError

    def _write_chunk(self, chunk: FilledChunk) -> None:
        """Write a chunk, and remember its place."""
        raise NotImplementedError

    def _tail(self) -> list[bytes]:
        """Return the end of the file."""
        raise NotImplementedError

    def _finish(self) -> None:
        """Change what stands at the beginning of the file."""

    # Writing.

    def _check(self) -> None:
        if self._error is not None:
            raise self._error
        if self._closed:
            raise ClosedError(f"the bag '{self.path}' is closed")

    def _end_chunk(self) -> None:
        """Write the chunk, if there are messages in it, and start a new one."""
        chunk = self._chunk
        if chunk.index:
            self._chunk = FilledChunk()
            self._begin()
            self._write_chunk(chunk)
            for handle, index in chunk.index.items():
                self._counts[handle] += len(index) // 2

    def _begin(self) -> None:
        """Write the beginning of the file once; it may depend on the first channel."""
        if not self._begun:
            self._append(self._header())
            self._begun = True

    def _append(self, *parts: bag.Payload) -> None:
        """Write bytes to the file, all of them or none."""
        done = 0
        try:
            for first in range(0, len(parts), _PIECES):
                done += self._write_pieces(list(parts[first : first + _PIECES]))
        except OSError as error:
            with suppress(OSError):  # a pipe, or a disk that is gone
                os.ftruncate(self._file, self._offset)
                os.lseek(self._file, self._offset, os.SEEK_SET)
            cause = error.strerror or str(error)
            self._error = BagUnfinished(cause, str(self.path), self._offset)
            raise self._error from error
        self._offset += done

    def _write_pieces(self, parts: list[bag.Payload]) -> int:
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
