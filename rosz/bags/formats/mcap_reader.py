"""Reading MCAP files, by their index or, where that is missing or damaged, by a walk through them.

The walk goes from record to record. It reads the heads of chunks and the indexes behind them, and
unpacks a chunk only if these do not list its messages. A file without chunks is divided into spans
of some megabytes.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TypeAlias

import msgspec

from rosz.bags import bag
from rosz.bags.formats import mcap_records as mcap
from rosz.bags.formats.chunks import ChunkError, HeldChunks, too_many
from rosz.bags.formats.writing import unindexed
from rosz.errors import BagError
from rosz.lifecycle import Closing

_SPAN = 4 << 20
"""Bytes that are read together from a file without chunks."""
_PLACE = struct.Struct("<QQ")
_STATISTICS = struct.Struct("<QHIIIIQQ")
_COUNT = struct.Struct("<HQ")
_KINDS = range(1, 16)


class _Span(msgspec.Struct):
    """A part of the file with messages: a chunk, or records beside each other.

    Attributes:
        length: Bytes of its records, the head of a chunk included.
        size: Compressed bytes.
        uncompressed: Bytes that come out.
        channels: Numbers of the channels in it, if known.
    """

    offset: int
    length: int
    start: int
    end: int
    compression: str = ""
    size: int = 0
    uncompressed: int = 0
    channels: frozenset[int] | None = None
    chunk: bool = True


_Row: TypeAlias = tuple[int, int, bag.Entry]
"""Stamp, place in the order of the file, message."""


class McapReader(Closing):
    """A bag in MCAP that is read; see `rosz.bags.BagReader`.

    Args:
        path: Path of the file.
        scan: Whether to walk through the file although it has an index.

    Attributes:
        profile: Profile of the file, such as ``ros2``.
        metadata: Named texts by name of the record.
        problems: The errors that were found when the bag was opened.

    Raises:
        BagError: The file cannot be read, or is none of MCAP.
    """

    format = "mcap"
    version = "0"

    def __init__(self, path: str | os.PathLike[str], *, scan: bool = False) -> None:
        self.path = Path(path)
        with bag.FileErrors(path, "cannot open it"):
            self._file = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        self._closed = False
        self.indexed = False
        self.start, self.end = 0, 0
        self.profile = ""
        self._schemas: dict[int, mcap.Schema] = {}
        self._channels: dict[int, bag.Channel] = {}
        self._counts: Counter[int] = Counter()
        self._spans: list[_Span] = []
        self.metadata: dict[str, Mapping[str, str]] = {}
        self._attachments: list[tuple[int, int]] = []
        self.problems: list[BagError] = []
        try:
            self._open(scan=scan)
        except BaseException:
            os.close(self._file)
            raise

    @property
    def size(self) -> int:
        """Size in bytes."""
        return os.fstat(self._file).st_size

    @property
    def channels(self) -> Sequence[bag.Channel]:
        """All channels, in the order of the file."""
        return list(dict.fromkeys(self._channels.values()))

    @property
    def chunks(self) -> Sequence[bag.Chunk]:
        """All chunks."""
        return [
            bag.Chunk(
                span.offset,
                mcap.COMPRESSIONS.get(span.compression, "none"),
                span.size,
                span.uncompressed,
                span.start,
                span.end,
            )
            for span in self._spans
            if span.chunk
        ]

    def count(self, channel: bag.Channel | None = None) -> int:
        """Return the number of messages of a channel, or of all."""
        return self._counts.total() if channel is None else self._totals[channel]

    @cached_property
    def _totals(self) -> Counter[bag.Channel]:
        return bag.count_by_channel(self._counts, self._channels)

    def close(self) -> None:
        """Close the file; a second call has no effect."""
        if not self._closed:
            self._closed = True
            os.close(self._file)

    # The index.

    def _open(self, *, scan: bool) -> None:
        if os.pread(self._file, len(mcap.MAGIC), 0) != mcap.MAGIC:
            raise BagError("it does not begin as an MCAP file does", str(self.path), 0)
        if not scan:
            try:
                self.indexed = self._read_summary()
            except mcap.MissingSchema:
                pass  # the summary need not repeat schemas
            except mcap.DamagedRecord as error:
                self.problems.append(self._error(f"its index is damaged: {error}", -1))
        if not self.indexed:
            self._schemas, self._channels, self._counts = {}, {}, Counter()
            self._spans, self.metadata, self._attachments = [], {}, []
            self._scan()
            if not (scan or self._footer() or self.problems):
                self.problems.append(unindexed(str(self.path), self._file))
        for number in sorted(self._counts.keys() - self._channels.keys()):
            text = f"{self._counts.pop(number)} messages of channel {number}, which is not there"
            self.problems.append(self._error(f"{text}, are left out", -1))
        if self._spans and not self.end:
            self.start = min(span.start for span in self._spans)
            self.end = max(span.end for span in self._spans)

    def _error(self, reason: str, offset: int) -> BagError:
        return BagError(reason, str(self.path), offset)

    def _read(self, offset: int, size: int) -> bytes:
        """Return bytes of the file; raise `DamagedRecord` if it has less."""
        if offset + size > self.size:
            raise mcap.DamagedRecord(
                f"the file ends after {self.size} bytes, expected {offset + size}"
            )
        parts, left = [], size
        while left:
            try:
                part = os.pread(self._file, left, offset)
            except OSError as error:
                raise self._error(f"cannot read it: {error.strerror}", offset) from error
            if not part:
                raise mcap.DamagedRecord(f"the file ends after {offset} bytes")
            parts.append(part)
            offset += len(part)
            left -= len(part)
        return parts[0] if len(parts) == 1 else b"".join(parts)

    def _footer(self) -> bytes:
        """Return the footer, and the end of the file; empty if it was not finished."""
        end = self.size - mcap.FOOTER_SIZE
        tail = self._read(end, mcap.FOOTER_SIZE) if end >= len(mcap.MAGIC) else b""
        whole = tail.endswith(mcap.MAGIC) and mcap.HEAD.unpack_from(tail) == (mcap.Op.FOOTER, 20)
        return tail if whole else b""

    def _read_summary(self) -> bool:
        """Read the index; return whether there is one."""
        tail = self._footer()
        start, _, checksum = struct.unpack_from("<QQI", tail, mcap.HEAD.size) if tail else (0, 0, 0)
        if not start:
            return False
        end = self.size - mcap.FOOTER_SIZE
        if start > end:
            raise mcap.DamagedRecord(f"it begins at byte {start}, and ends at byte {end}")
        summary = self._read(start, end - start)
        if checksum and zlib.crc32(tail[: mcap.HEAD.size + 16], zlib.crc32(summary)) != checksum:
            raise mcap.DamagedRecord("its checksum is wrong")
        statistics: tuple[int, ...] = ()
        kinds: Counter[int] = Counter()
        for op, body in mcap.records_in(summary):
            kinds[op] += 1
            if op == mcap.Op.STATISTICS:
                statistics = mcap.Cursor(body).fields(_STATISTICS)
            self._index(op, body)
        # A summary need not repeat anything. The statistics tell whether all is there; if it is
        # not, or they are missing, or messages are in no chunk, the whole file is read.
        if not statistics:
            return False
        messages, _, channels, attachments, metadata, chunks, *_ = statistics
        return (
            self._counts.total() == messages
            and self._counts.keys() <= self._channels.keys()
            and kinds[mcap.Op.CHANNEL] >= channels
            and kinds[mcap.Op.ATTACHMENT_INDEX] >= attachments
            and kinds[mcap.Op.METADATA_INDEX] >= metadata
            and kinds[mcap.Op.CHUNK_INDEX] >= chunks
            and bool(self._spans or not messages)
        )

    def _index(self, op: int, body: memoryview) -> None:
        if op == mcap.Op.CHUNK_INDEX:
            self._spans.append(_parse_chunk_index(mcap.Cursor(body)))
        elif op == mcap.Op.STATISTICS:
            cursor = mcap.Cursor(body)
            *_, self.start, self.end = cursor.fields(_STATISTICS)
            for number, count in _COUNT.iter_unpack(cursor.take(cursor.u32() // 10 * 10)):
                self._counts[number] = count
        elif op == mcap.Op.METADATA_INDEX:
            offset, length = mcap.Cursor(body).fields(_PLACE)
            (_, inner), *_ = mcap.records_in(self._read(offset, length))
            self._add_metadata(inner)
        elif op == mcap.Op.ATTACHMENT_INDEX:
            offset, length = mcap.Cursor(body).fields(_PLACE)
            self._attachments.append((offset, length))
        else:
            self._define(op, body)

    def _add_metadata(self, body: memoryview) -> None:
        cursor = mcap.Cursor(body)
        name = cursor.text()
        self.metadata[name] = cursor.texts()

    def _define(self, op: int, body: memoryview) -> None:
        if op == mcap.Op.SCHEMA:
            number, schema = mcap.parse_schema(body)
            self._schemas[number] = schema
        elif op == mcap.Op.CHANNEL:
            number, channel = mcap.parse_channel(body, self._schemas)
            self._channels[number] = channel

    # The walk through a file.

    def _scan(self) -> None:
        """Find all spans, and count their messages."""
        offset = len(mcap.MAGIC)
        self._scanned = HeldChunks(self.size)
        run: _Span | None = None
        while offset < self.size:
            try:
                op, length = self._head(offset)
                if op in {mcap.Op.DATA_END, mcap.Op.FOOTER}:
                    return
                if op in {mcap.Op.MESSAGE, mcap.Op.SCHEMA, mcap.Op.CHANNEL}:
                    run = self._extend(run, offset, op, length)
                else:
                    run = None
                    self._scan_record(op, offset, length)
            except mcap.DamagedRecord as error:
                self.problems.append(
                    self._error(f"{error}; {self.size - offset} bytes are left out", offset)
                )
                return
            offset += mcap.HEAD.size + length

    def _head(self, offset: int) -> tuple[int, int]:
        op, length = mcap.HEAD.unpack(self._read(offset, mcap.HEAD.size))
        if op not in _KINDS or offset + mcap.HEAD.size + length > self.size:
            raise mcap.DamagedRecord(f"a record of kind {op} says that it has {length} bytes")
        return op, length

    def _extend(self, run: _Span | None, offset: int, op: int, length: int) -> _Span | None:
        """Add a record that is in no chunk to a span, or begin one with it."""
        whole = mcap.HEAD.size + length
        if op != mcap.Op.MESSAGE:
            self._define(op, memoryview(self._read(offset + mcap.HEAD.size, length)))
        elif length < mcap.MESSAGE.size - mcap.HEAD.size:
            raise mcap.DamagedRecord(f"a message has {length} bytes")
        else:
            _, _, number, _, stamp, _ = mcap.MESSAGE.unpack(self._read(offset, mcap.MESSAGE.size))
            self._counts[number] += 1
            if run is None:
                run = _Span(offset, 0, stamp, stamp, chunk=False)
                self._spans.append(run)
            run.start, run.end = min(run.start, stamp), max(run.end, stamp)
        if run is not None:
            run.length += whole
            if run.length > _SPAN:
                return None
        return run

    def _scan_record(self, op: int, offset: int, length: int) -> None:
        if op == mcap.Op.CHUNK:
            self._scan_chunk(offset, length)
        elif op == mcap.Op.METADATA:
            self._add_metadata(memoryview(self._read(offset + mcap.HEAD.size, length)))
        elif op == mcap.Op.ATTACHMENT:
            self._attachments.append((offset, mcap.HEAD.size + length))
        elif op == mcap.Op.HEADER:
            self.profile = mcap.Cursor(self._read(offset + mcap.HEAD.size, length)).text()

    def _scan_chunk(self, offset: int, length: int) -> None:
        """Add a chunk, and count its messages by the index behind it or by its records."""
        head = mcap.Cursor(self._read(offset + mcap.HEAD.size, min(length, 100)))
        start, end, uncompressed, _ = head.fields(mcap.CHUNK_HEAD)
        compression = head.text()
        (size,) = head.fields(struct.Struct("<Q"))
        span = _Span(offset, mcap.HEAD.size + length, start, end, compression, size, uncompressed)
        counts = self._indexed_counts(offset + mcap.HEAD.size + length)
        if not counts or not self._channels.keys() >= counts.keys():
            try:
                data = self._load(span)
                most = self._scanned.room(offset, offset, size, uncompressed)
                counts = self._count_messages(data, most)
            except (mcap.DamagedRecord, ChunkError) as error:
                self.problems.append(self._error(str(error), offset))
                return
        span.channels = frozenset(counts)
        self._counts += counts
        self._spans.append(span)

    def _count_messages(self, data: bag.Payload, most: int) -> Counter[int]:
        """Take the definitions among some records; return the number of messages by channel."""
        counts: Counter[int] = Counter()
        position = total = 0
        try:
            while position < len(data):
                op, length = mcap.head_at(data, position)
                position += mcap.HEAD.size
                total += 1
                if total > most:
                    raise too_many(most)
                if op == mcap.Op.MESSAGE:
                    counts[mcap.Cursor(data[position : position + 2]).u16()] += 1
                else:
                    self._define(op, memoryview(data)[position : position + length])
                position += length
        finally:
            self._scanned.take(total)
        return counts

    def _indexed_counts(self, offset: int) -> Counter[int]:
        """Return the number of messages by channel as the records behind a chunk tell it."""
        counts: Counter[int] = Counter()
        while offset + mcap.HEAD.size + 6 <= self.size:
            op, length, number, size = struct.unpack(
                "<BQHI", self._read(offset, mcap.HEAD.size + 6)
            )
            if op != mcap.Op.MESSAGE_INDEX or offset + mcap.HEAD.size + length > self.size:
                break
            counts[number] += size // 16
            offset += mcap.HEAD.size + length
        return counts

    # Messages.

    def _load(self, span: _Span) -> bag.Payload:
        """Return the records of a span."""
        data = self._read(span.offset, span.length)
        if not span.chunk:
            return data
        op, length = mcap.HEAD.unpack_from(data)
        if op != mcap.Op.CHUNK or mcap.HEAD.size + length != span.length:
            raise mcap.DamagedRecord("the index points to a place that has no chunk")
        cursor = mcap.Cursor(data)
        cursor.take(mcap.HEAD.size)
        _, _, uncompressed, checksum = cursor.fields(mcap.CHUNK_HEAD)
        name = cursor.text()
        (size,) = cursor.fields(struct.Struct("<Q"))
        plain = mcap.decompress(name, cursor.take(size), uncompressed)
        if checksum and zlib.crc32(plain) != checksum:
            raise mcap.DamagedRecord("the checksum of the chunk is wrong")
        return plain

    def messages(
        self,
        topics: Collection[str] | None = None,
        start: int | None = None,
        end: int | None = None,
        *,
        reverse: bool = False,
        damaged: bag.DamageReport | None = None,
    ) -> Iterator[bag.Entry]:
        """Yield messages in the order of their stamps; see `rosz.bags.BagReader.messages`."""
        first = 0 if start is None else start
        last = mcap.LATEST if end is None else end
        wanted = {
            number: channel
            for number, channel in self._channels.items()
            if topics is None or channel.topic in topics
        }
        spans = [
            (span.start, span.end, span)
            for span in self._spans
            if span.start <= last
            and span.end >= first
            and (span.channels is None or not span.channels.isdisjoint(wanted))
        ]

        held_chunks = HeldChunks(self.size, reverse=reverse)

        def rows_of(span: _Span) -> list[_Row]:
            rows: list[_Row] = []
            try:
                packed = span.size if span.chunk else span.length
                most = held_chunks.room(span.start, span.end, packed, span.uncompressed or packed)
                data = self._load(span)
                _collect(data, span.offset << 32, wanted, (first, last), rows, most)
            except (mcap.DamagedRecord, ChunkError) as error:
                (damaged or bag.refuse_damage)(self._error(str(error), span.offset))
            held_chunks.take(len(rows))
            return rows

        return (row[2] for run in bag.in_order(spans, rows_of, reverse=reverse) for row in run)

    def attachments(self) -> Iterator[bag.Attachment]:
        """Yield the files within the bag."""
        for offset, length in self._attachments:
            try:
                yield _parse_attachment(self._read(offset, length))
            except mcap.DamagedRecord as error:
                raise self._error(str(error), offset) from error


def _parse_chunk_index(cursor: mcap.Cursor) -> _Span:
    start, end, offset, length = cursor.fields(mcap.CHUNK_INDEX)
    places = cursor.take(cursor.u32())
    numbers = frozenset(number for number, _ in _COUNT.iter_unpack(places))
    cursor.take(8)
    compression = cursor.text()
    size, uncompressed = cursor.fields(_PLACE)
    return _Span(offset, length, start, end, compression, size, uncompressed, numbers or None)


def _parse_attachment(data: bytes) -> bag.Attachment:
    (_, body), *_ = mcap.records_in(data)
    cursor = mcap.Cursor(body)
    stamp, _ = cursor.fields(_PLACE)
    name, media_type = cursor.text(), cursor.text()
    (size,) = cursor.fields(struct.Struct("<Q"))
    contents = bytes(cursor.take(size))
    checksum = zlib.crc32(body[: cursor.position])
    if cursor.u32() not in {0, checksum}:
        raise mcap.DamagedRecord(f"the checksum of attachment '{name}' is wrong")
    return bag.Attachment(name, media_type, stamp, contents)


def _collect(
    data: bag.Payload,
    order: int,
    wanted: Mapping[int, bag.Channel],
    times: tuple[int, int],
    rows: list[_Row],
    most: int,
) -> None:
    """Add the messages among some records to a list, up to a record that is damaged."""
    first, last = times
    size, head, position = len(data), mcap.MESSAGE.size, 0
    kind, before, unpack = int(mcap.Op.MESSAGE), mcap.HEAD.size, mcap.MESSAGE.unpack_from
    while position < size:
        if data[position] == kind and position + head <= size:
            _, length, number, sequence, stamp, sent = unpack(data, position)
            stop = position + before + length
            if stop > size or stop < position + head:
                raise mcap.DamagedRecord(f"a message says that it has {length} bytes")
            channel = wanted.get(number)
            if channel is not None and first <= stamp <= last:
                payload = data[position + head : stop]
                entry = bag.Entry(channel, stamp, payload, sent, sequence)
                rows.append((stamp, order + position, entry))
                if len(rows) > most:
                    raise too_many(most)
            position = stop
        else:
            _, body = next(mcap.records_in(memoryview(data)[position:]))
            position += before + len(body)
