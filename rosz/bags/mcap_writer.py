"""Writing MCAP files.

Messages are collected into a chunk. A full one goes to a worker, which compresses it, computes its
checksum and writes it, with no copy where it is not compressed. What has been flushed is read back
even if the process is killed or the disk is full: a chunk that could not be written whole is cut
off again.
"""

from __future__ import annotations

import os
import struct
import threading
import zlib
from array import array
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Self

from rosz.bags import mcap_records as mcap
from rosz.bags.bag import Attachment, Channel, Compression, Payload
from rosz.bags.mcap_records import MESSAGE, Op
from rosz.errors import BagError, ClosedError
from rosz.worker import Worker

__all__ = ("McapWriter",)

_PIECES = 1000
"""Buffers for one call of writev, which takes at most IOV_MAX of them."""
_MOST_WAITING = 64 << 20
_CLOSE_TIMEOUT = 600.0
_MESSAGE_BODY = MESSAGE.size - mcap.HEAD.size
_CHUNK_HEAD = struct.Struct("<QQQI")
_CHUNK_INDEX = struct.Struct("<QQQQ")
_LARGEST = (1 << 64) - 1


class _Chunk:
    """The chunk that is being filled."""

    def __init__(self) -> None:
        self.parts: list[Payload] = []
        self.size = 0
        self.index: dict[int, array[int]] = {}
        """Stamp and place in the chunk of each message, by handle."""

    def add(self, record: bytes) -> None:
        self.parts.append(record)
        self.size += len(record)


class McapWriter:
    """A bag in MCAP that is written; see `rosz.bags.BagWriter`.

    It may be used by several threads.

    Args:
        path: Path of the file.
        compression: ``none``, ``lz4`` or ``zstd``.
        chunk_size: Bytes of messages that are written, and compressed, together.
        replace: Whether a file that exists is replaced; otherwise it is an error.
        capacity: Bytes that may wait for the disk; `write` waits while there are more.

    Raises:
        BagError: The file cannot be created.
        UsageError: The compression is not known, or its library is missing.
    """

    format = "mcap"

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        compression: Compression = "none",
        chunk_size: int = 1 << 20,
        replace: bool = False,
        capacity: int = _MOST_WAITING,
    ) -> None:
        mcap.check_compression(compression)
        self.path = Path(path)
        self._compression = compression
        self._chunk_size = chunk_size
        self._capacity = capacity
        flags = os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC | (os.O_TRUNC if replace else os.O_EXCL)
        try:
            self._file = os.open(path, flags, 0o666)
        except OSError as error:
            raise BagError(f"cannot create it: {error.strerror}", str(path)) from error
        self._lock = threading.Lock()
        self._room = threading.Condition(self._lock)
        self._error: BagError | None = None
        self._closed = False
        self._chunk = _Chunk()
        self._waiting = 0
        self._submitted = 0
        self._handles: dict[Channel, int] = {}
        self._schemas: dict[bytes, int] = {}
        self._definitions: list[bytes] = []
        self._counts: dict[int, int] = {}
        self._offset = 0
        self._chunk_indexes: list[bytes] = []
        self._extra_indexes: list[tuple[int, bytes]] = []
        self._start, self._end = _LARGEST, 0
        self._worker: Worker[_Chunk | list[bytes]] = Worker("rosz-bag-writer", self._write_item)
        self._profile = ""
        self._begun = False

    @property
    def size(self) -> int:
        """Bytes written so far, and those that wait for the disk."""
        return self._offset + self._waiting + self._chunk.size

    @property
    def waiting(self) -> int:
        """Bytes that wait for the disk."""
        return self._waiting + self._chunk.size

    @property
    def full(self) -> bool:
        """Whether so many bytes wait for the disk that `write` would wait too."""
        return self._waiting >= self._capacity

    def add(self, channel: Channel) -> int:
        """Add a channel; one that equals an earlier one is the same."""
        with self._lock:
            handle = self._handles.get(channel)
            if handle is not None:
                return handle
            self._check()
            self._profile = self._profile or {"cdr": "ros2"}.get(channel.encoding, channel.encoding)
            schema = self._add_schema(channel)
            handle = self._handles[channel] = len(self._handles) + 1
            self._counts[handle] = 0
            self._define(mcap.record(Op.CHANNEL, mcap.channel_body(handle, schema, channel)))
            return handle

    def _add_schema(self, channel: Channel) -> int:
        key = mcap.schema_body(0, channel)
        number = self._schemas.get(key)
        if number is None:
            number = self._schemas[key] = len(self._schemas) + 1
            self._define(mcap.record(Op.SCHEMA, mcap.schema_body(number, channel)))
        return number

    def _define(self, record: bytes) -> None:
        self._definitions.append(record)
        self._chunk.add(record)

    def write(
        self, handle: int, stamp: int, data: Payload, sent: int | None = None, sequence: int = 0
    ) -> None:
        """Write a message; see `rosz.bags.BagWriter.write`."""
        size = len(data)
        head = MESSAGE.pack(
            Op.MESSAGE,
            _MESSAGE_BODY + size,
            handle,
            sequence & 0xFFFFFFFF,
            stamp,
            stamp if sent is None else sent,
        )
        with self._lock:
            self._check()
            chunk = self._chunk
            index = chunk.index.get(handle)
            if index is None:
                index = chunk.index[handle] = array("Q")
            index.append(stamp)
            index.append(chunk.size)
            chunk.parts.append(head)
            chunk.parts.append(data)
            chunk.size += MESSAGE.size + size
            self._counts[handle] += 1
            if chunk.size >= self._chunk_size:
                self._submit()
                while self._waiting >= self._capacity and self._error is None:
                    self._room.wait()

    def add_metadata(self, name: str, texts: Mapping[str, str]) -> None:
        """Write named texts."""
        self._add_extra(Op.METADATA, mcap.text(name) + mcap.texts(texts), mcap.text(name))

    def add_attachment(self, attachment: Attachment) -> None:
        """Write a file into the bag."""
        stamp, size = struct.pack("<Q", attachment.stamp), struct.pack("<Q", len(attachment.data))
        names = mcap.text(attachment.name) + mcap.text(attachment.media_type)
        body = stamp + stamp + names + size + attachment.data
        checksum = struct.pack("<I", zlib.crc32(body))
        self._add_extra(Op.ATTACHMENT, body + checksum, stamp + stamp + size + names)

    def _add_extra(self, op: int, body: bytes, about: bytes) -> None:
        with self._lock:
            self._check()
            self._submit()
            item = [mcap.record(op, body), about]
            self._waiting += len(item[0])
            self._worker.submit(item)

    def flush(self) -> None:
        """Write everything so far to the file."""
        with self._lock:
            self._check()
            self._submit()
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
            self._submit()

    def close(self) -> None:
        """Finish the file with its index."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            self._submit()
        self._worker.close(_CLOSE_TIMEOUT)
        try:
            if self._error is None:
                with suppress(BagError):  # it is in self._error
                    self._append(self._header() if not self._begun else b"", self._tail())
        finally:
            os.close(self._file)
        if self._error is not None:
            raise self._error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc_info: object) -> None:
        self.close()

    def _check(self) -> None:
        if self._error is not None:
            raise self._error
        if self._closed:
            raise ClosedError(f"the bag '{self.path}' is closed")

    def _submit(self) -> None:
        """Hand the chunk to the worker, if there are messages in it."""
        chunk = self._chunk
        if chunk.index:
            self._chunk = _Chunk()
            self._waiting += chunk.size
            self._worker.submit(chunk)

    # On the worker's thread, and at the end on that of `close`.

    def _write_item(self, item: _Chunk | list[bytes]) -> None:
        try:
            if self._error is None:
                if not self._begun:
                    self._begun = True
                    self._append(self._header())
                if isinstance(item, _Chunk):
                    self._write_chunk(item)
                else:
                    self._write_extra(*item)
        except BagError:
            pass  # the next call of `write`, `flush` or `close` raises it
        finally:
            with self._lock:
                self._waiting -= item.size if isinstance(item, _Chunk) else len(item[0])
                self._room.notify_all()

    def _header(self) -> bytes:
        body = mcap.text(self._profile) + mcap.text("rosz")
        return mcap.MAGIC + mcap.record(Op.HEADER, body)

    def _write_extra(self, record: bytes, about: bytes) -> None:
        offset = self._offset
        self._append(record)
        place = struct.pack("<QQ", offset, len(record))
        kinds = {Op.METADATA: Op.METADATA_INDEX, Op.ATTACHMENT: Op.ATTACHMENT_INDEX}
        self._extra_indexes.append((kinds[record[0]], place + about))

    def _write_chunk(self, chunk: _Chunk) -> None:
        checksum = 0
        for part in chunk.parts:
            checksum = zlib.crc32(part, checksum)
        parts, size = chunk.parts, chunk.size
        name = "" if self._compression == "none" else self._compression
        if name:
            packed = mcap.compress(self._compression, b"".join(parts))
            parts, size = [packed], len(packed)
        start = min(min(index[::2]) for index in chunk.index.values())
        end = max(max(index[::2]) for index in chunk.index.values())
        body = _CHUNK_HEAD.pack(start, end, chunk.size, checksum) + mcap.text(name)
        body += struct.pack("<Q", size)
        head = mcap.HEAD.pack(Op.CHUNK, len(body) + size) + body
        indexes, places, position = [], [], self._offset + len(head) + size
        for handle, index in chunk.index.items():
            data = _little_endian(index)
            places.append(struct.pack("<HQ", handle, position))
            indexes.append(
                mcap.record(Op.MESSAGE_INDEX, struct.pack("<HI", handle, len(data)) + data)
            )
            position += len(indexes[-1])
        offset = self._offset
        self._append(head, *parts, *indexes)
        self._start, self._end = min(self._start, start), max(self._end, end)
        self._chunk_indexes.append(
            _CHUNK_INDEX.pack(start, end, offset, len(head) + size)
            + struct.pack("<I", 10 * len(places))
            + b"".join(places)
            + struct.pack("<Q", sum(map(len, indexes)))
            + mcap.text(name)
            + struct.pack("<QQ", size, chunk.size)
        )

    def _tail(self) -> bytes:
        """Return the end of the data, the summary and the footer."""
        end = mcap.record(Op.DATA_END, bytes(4))
        summary_start = self._offset + len(end) + (0 if self._begun else len(self._header()))
        groups = [
            (Op.SCHEMA, [r for r in self._definitions if r[0] == Op.SCHEMA]),
            (Op.CHANNEL, [r for r in self._definitions if r[0] == Op.CHANNEL]),
            (Op.STATISTICS, [mcap.record(Op.STATISTICS, self._statistics())]),
            (Op.CHUNK_INDEX, [mcap.record(Op.CHUNK_INDEX, one) for one in self._chunk_indexes]),
        ]
        for kind in (Op.ATTACHMENT_INDEX, Op.METADATA_INDEX):
            rows = [mcap.record(kind, body) for op, body in self._extra_indexes if op == kind]
            groups.append((kind, rows))
        summary, offsets = bytearray(), bytearray()
        for op, records in groups:
            start = len(summary)
            summary += b"".join(records)
            if records:
                place = struct.pack("<BQQ", op, summary_start + start, len(summary) - start)
                offsets += mcap.record(Op.SUMMARY_OFFSET, place)
        offsets_start = summary_start + len(summary)
        summary += offsets
        return end + summary + mcap.footer(bytes(summary), summary_start, offsets_start)

    def _statistics(self) -> bytes:
        counts = b"".join(struct.pack("<HQ", *row) for row in self._counts.items() if row[1])
        extras = [op for op, _ in self._extra_indexes]
        numbers = struct.pack(
            "<QHIIIIQQ",
            sum(self._counts.values()),
            len(self._schemas),
            len(self._handles),
            extras.count(Op.ATTACHMENT_INDEX),
            extras.count(Op.METADATA_INDEX),
            len(self._chunk_indexes),
            self._start if self._chunk_indexes else 0,
            self._end,
        )
        return numbers + struct.pack("<I", len(counts)) + counts

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
            self._error = BagError(
                f"cannot write to it: {error.strerror}; what was written before can be read,"
                " and 'rosz bag reindex' gives it an index",
                str(self.path),
                self._offset,
            )
            raise self._error from error
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


def _little_endian(index: array[int]) -> bytes:
    import sys

    if sys.byteorder == "big":
        index.byteswap()
    return index.tobytes()
