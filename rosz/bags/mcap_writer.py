"""Writing MCAP files."""

from __future__ import annotations

import os
import struct
import sys
import zlib
from array import array
from collections.abc import Mapping
from functools import partial

from rosz.bags import mcap_records as mcap
from rosz.bags.bag import Attachment, Channel, Compression
from rosz.bags.chunk_writer import ChunkWriter, FilledChunk
from rosz.bags.mcap_records import MESSAGE, Op

__all__ = ("McapWriter",)

_MESSAGE_BODY = MESSAGE.size - mcap.HEAD.size
_CHUNK_HEAD = struct.Struct("<QQQI")
_CHUNK_INDEX = struct.Struct("<QQQQ")
_LARGEST = (1 << 64) - 1


class McapWriter(ChunkWriter):
    """A bag in MCAP that is written; see `rosz.bags.BagWriter`.

    Args:
        path: Path of the file.
        compression: ``none``, ``lz4`` or ``zstd``.
        chunk_size: Bytes of messages that are written, and compressed, together.
        replace: Whether a file that exists is replaced; otherwise it is an error.
        capacity: Bytes that may wait for the disk; `write` waits while there are more.
        checksums: Whether chunks have checksums.

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
        chunk_size: int = 768 << 10,
        replace: bool = False,
        capacity: int = 64 << 20,
        checksums: bool = True,
    ) -> None:
        super().__init__(
            path,
            compression=compression,
            chunk_size=chunk_size,
            replace=replace,
            capacity=capacity,
            checksums=checksums,
        )
        self._schemas: dict[bytes, int] = {}
        self._definitions: list[bytes] = []
        self._chunk_indexes: list[bytes] = []
        self._extra_indexes: list[tuple[int, bytes]] = []
        self._start, self._end = _LARGEST, 0
        self._profile = ""

    def _check_compression(self, name: str) -> None:
        mcap.check_compression(name)

    def _define(self, handle: int, channel: Channel) -> None:
        self._profile = self._profile or {"cdr": "ros2"}.get(channel.encoding, channel.encoding)
        key = mcap.schema_body(0, channel)
        number = self._schemas.get(key)
        if number is None:
            number = self._schemas[key] = len(self._schemas) + 1
            self._add_record(Op.SCHEMA, mcap.schema_body(number, channel))
        self._add_record(Op.CHANNEL, mcap.channel_body(handle, number, channel))

    def _add_record(self, op: int, body: bytes) -> None:
        record = mcap.record(op, body)
        self._definitions.append(record)
        self._chunk.add(record)

    def _message_head(self, handle: int, stamp: int, size: int, sent: int, sequence: int) -> bytes:
        number = sequence & 0xFFFFFFFF
        return MESSAGE.pack(Op.MESSAGE, _MESSAGE_BODY + size, handle, number, stamp, sent)

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
            self._submit_chunk()
            record = mcap.record(op, body)
            self._submit(len(record), partial(self._write_extra, record, about))

    def _header(self) -> bytes:
        body = mcap.text(self._profile or "ros2") + mcap.text("rosz")
        return mcap.MAGIC + mcap.record(Op.HEADER, body)

    def _write_extra(self, record: bytes, about: bytes) -> None:
        offset = self._offset
        self._append(record)
        place = struct.pack("<QQ", offset, len(record))
        kinds = {Op.METADATA: Op.METADATA_INDEX, Op.ATTACHMENT: Op.ATTACHMENT_INDEX}
        self._extra_indexes.append((kinds[record[0]], place + about))

    def _write_chunk(self, chunk: FilledChunk) -> None:
        checksum = 0
        for part in chunk.parts if self._checksums else ():
            checksum = zlib.crc32(part, checksum)
        parts, size = chunk.parts, chunk.size
        name = "" if self._compression == "none" else self._compression
        if name:
            packed = mcap.compress(self._compression, b"".join(parts))
            parts, size = [packed], len(packed)
        start, end = chunk.start, chunk.end
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

    def _tail(self) -> list[bytes]:
        """Return the end of the data, the summary and the footer."""
        end = mcap.record(Op.DATA_END, bytes(4))
        summary_start = self._offset + len(end)
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
        return [end, bytes(summary), mcap.footer(bytes(summary), summary_start, offsets_start)]

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


def _little_endian(index: array[int]) -> bytes:
    if sys.byteorder == "big":
        index.byteswap()
    return index.tobytes()
