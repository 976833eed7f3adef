"""Writing MCAP files."""

from __future__ import annotations

import struct
import sys
import zlib
from collections.abc import Mapping

from rosz.bags.bag import Attachment, Channel, compression_library
from rosz.bags.formats import mcap_records as mcap
from rosz.bags.formats.chunk_writer import ChunkWriter, FilledChunk
from rosz.bags.formats.mcap_records import MESSAGE, Op
from rosz.errors import UsageError

_MESSAGE_BODY = MESSAGE.size - mcap.HEAD.size


class McapWriter(ChunkWriter):
    """A bag in MCAP that is written; see `rosz.bags.BagWriter`.

    Its compression is ``none``, ``lz4`` or ``zstd``.
    """

    format = "mcap"

    def _prepare(self, compression: str) -> None:
        if compression not in mcap.COMPRESSIONS.values():
            raise UsageError(f"MCAP has no compression '{compression}'; it has lz4, zstd and none")
        if compression != "none":
            compression_library(compression)
        self._schemas: dict[bytes, int] = {}
        self._definitions: list[bytes] = []
        self._chunk_indexes: list[bytes] = []
        self._extra_indexes: list[tuple[int, bytes]] = []
        self._start, self._end = mcap.LATEST, 0
        self._profile = ""

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
        number, sent = sequence & 0xFFFFFFFF, max(sent, 0)  # whatever the publisher says
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
            self._end_chunk()
            self._begin()
            offset, record = self._offset, mcap.record(op, body)
            self._append(record)
        place = struct.pack("<QQ", offset, len(record))
        kinds = {Op.METADATA: Op.METADATA_INDEX, Op.ATTACHMENT: Op.ATTACHMENT_INDEX}
        self._extra_indexes.append((kinds[op], place + about))

    def _header(self) -> bytes:
        body = mcap.text(self._profile or "ros2") + mcap.text("rosz")
        return mcap.MAGIC + mcap.record(Op.HEADER, body)

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
        body = mcap.CHUNK_HEAD.pack(start, end, chunk.size, checksum) + mcap.text(name)
        body += struct.pack("<Q", size)
        head = mcap.HEAD.pack(Op.CHUNK, len(body) + size) + body
        indexes, places, position = [], [], self._offset + len(head) + size
        for handle, index in chunk.index.items():
            if sys.byteorder == "big":
                index.byteswap()
            data = index.tobytes()
            places.append(struct.pack("<HQ", handle, position))
            indexes.append(
                mcap.record(Op.MESSAGE_INDEX, struct.pack("<HI", handle, len(data)) + data)
            )
            position += len(indexes[-1])
        offset = self._offset
        self._append(head, *parts, *indexes)
        self._start, self._end = min(self._start, start), max(self._end, end)
        self._chunk_indexes.append(
            mcap.CHUNK_INDEX.pack(start, end, offset, len(head) + size)
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
            (Op.CHUNK_INDEX, [mcap.record(Op.CHUNK_INDEX, index) for index in self._chunk_indexes]),
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
