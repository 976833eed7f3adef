"""Reading of ROS 1's bags, format 2.0 (ROS wiki, Bags/Format/2.0).

Messages lie in chunks, which may be compressed. The index at the end of the file has the times of
each chunk, and behind each chunk are the places of the messages in it. Chunks are read when they
are reached; without an index, the file is read through once when it is opened, chunk by chunk.
Damage is reported with its place, and the rest is read.
"""

from __future__ import annotations

import os
import re
import struct
from collections import Counter, OrderedDict
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path

import msgspec

from rosz.bags import bag
from rosz.bags.formats import ros1_records as ros1
from rosz.bags.formats.chunks import ChunkError, HeldChunks, too_many, unpack
from rosz.environment import bag_limit
from rosz.errors import BagError
from rosz.idl import full_name
from rosz.lifecycle import Closing
from rosz.qos import LATCHED, QoS

_INDEX_ENTRY = struct.Struct("<III")
_COUNT = struct.Struct("<II")
_CACHED = 8
"""Chunks that stay in memory; more than one is needed where they overlap in time."""
_CACHED_BYTES = 128 << 20
"""Bytes of them, from which only the newest stays."""
_NS = 1_000_000_000
_MESSAGE_MARK = b"op=\x02"
_CHUNK_MARK = re.compile(rb".\0\0\0(?=.\0\0\0(?:op|compression|size)=)", re.DOTALL)
"""Begin of a chunk's header, which is short; its fields may be in any order."""
_LONGEST_MARK = 20
_SEARCHED = 1 << 14
"""Bytes that are searched at once for the next chunk."""
_COMPRESSIONS: dict[str, bag.Compression] = {"none": "none", "bz2": "bz2", "lz4": "lz4"}

_Place = tuple[int, int, int, int]
"""Stamp, rank of the connection, number of the chunk, and place in it: the order of messages."""


class BagConnection(msgspec.Struct, frozen=True):
    """One connection of a recorder to a publisher, and all fields that the publisher sent."""

    number: int
    channel: bag.Channel
    header: Mapping[str, bytes]


class _Chunk(msgspec.Struct):
    """A chunk by the index, and its head once that was read."""

    offset: int
    start: int
    end: int
    counts: dict[int, int]
    head: ros1.RecordHead | None = None


class Ros1Reader(Closing):
    """A bag of ROS 1; see `rosz.bags.BagReader`.

    Args:
        path: The file.

    Attributes:
        connections: The connections, in the order of the file.
        problems: The errors that were found when the bag was opened.

    Raises:
        BagError: The file cannot be read, or is not such a bag.
    """

    format = "rosbag"
    version = "2.0"
    metadata: Mapping[str, Mapping[str, str]] = {}

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self.connections: list[BagConnection] = []
        self._ranks: dict[int, int] = {}
        self._chunks: list[_Chunk] = []
        self.problems: list[BagError] = []
        self._buffers: OrderedDict[int, bytes] = OrderedDict()
        try:
            self._file = self.path.open("rb", buffering=0)
        except OSError as error:
            raise BagError(error.strerror or str(error), str(path)) from error
        try:
            self.size = os.fstat(self._file.fileno()).st_size
            self.indexed = self._open()
        except BaseException:
            self._file.close()
            raise
        self.channels: Sequence[bag.Channel] = [
            connection.channel for connection in self.connections
        ]
        counted = [chunk for chunk in self._chunks if chunk.counts]
        self.start: int = min((chunk.start for chunk in counted), default=0)
        self.end: int = max((chunk.end for chunk in counted), default=0)

    # Opening.

    def _open(self) -> bool:
        """Read the index, or else the whole file; return whether there is an index."""
        begin = self._read(0, len(ros1.MAGIC))
        if begin != ros1.MAGIC:
            raise BagError(ros1.describe_begin(begin), str(self.path), 0)
        try:
            head = ros1.read_head(self._read, len(ros1.MAGIC), self.size)
            how = ros1.text(head.fields, "encryptor", "")
            place = ros1.number(head.fields, "index_pos", len(ros1.MAGIC))
            if place and not how:
                self._read_index(place, head)
                return True
        except ros1.RecordError as error:
            self.problems.append(self._error(error))
            how = ""
        if how:
            raise BagError(
                f"encrypted by {how}; 'rosbag decrypt' of ROS 1 decrypts it", str(self.path)
            )
        self._scan()
        return False

    def _read_index(self, place: int, head: ros1.RecordHead) -> None:
        """Read the index at the end: the connections, and place and times of each chunk."""
        expected = tuple(
            ros1.number(head.fields, name, len(ros1.MAGIC))
            for name in ("conn_count", "chunk_count")
        )
        connections: list[tuple[ros1.RecordHead, bytes, int]] = []
        chunks: list[_Chunk] = []
        base, tail = place, self._read(place, max(self.size - place, 0))

        def read(offset: int, size: int) -> bytes:
            return tail[offset - base : offset - base + size]

        while place < self.size:
            record = ros1.read_head(read, place, self.size)
            data = read(record.data, record.end - record.data)
            if record.op == ros1.OP_CONNECTION:
                connections.append((record, data, place))
            elif record.op == ros1.OP_CHUNK_INFO:
                chunks.append(_chunk_info(record, data, place))
            else:
                raise ros1.RecordError(f"a record of kind {record.op} in the index", place)
            place = record.end
        if (len(connections), len(chunks)) != expected:
            raise ros1.RecordError(
                f"an index of {len(connections)} connections and {len(chunks)} chunks, expected"
                f" {expected[0]} and {expected[1]}",
                place,
            )
        for record, data, offset in connections:
            self._add_connection(record, data, offset)
        self._chunks = chunks

    def _scan(self) -> None:
        """Read through the file: find its chunks, and in them connections and messages."""
        place = len(ros1.MAGIC)
        self._scanned = HeldChunks(self.size)
        while place < self.size:
            try:
                head = ros1.read_head(self._read, place, self.size)
                if head.op == ros1.OP_CHUNK:
                    head = self._begun(head)
                    self._scan_chunk(head, place)
                elif head.op == ros1.OP_CONNECTION:
                    data = self._read(head.data, head.end - head.data)
                    self._add_connection(head, data, place)
            except ros1.RecordError as error:
                if not self.problems or self.problems[-1].offset != error.offset:
                    self.problems.append(self._error(error))
                place = self._next_chunk(place + 1)
                continue
            if head.op == ros1.OP_CHUNK and head.end > self.size:
                return
            place = head.end

    def _begun(self, head: ros1.RecordHead) -> ros1.RecordHead:
        """Return the head of a chunk; one of no bytes was not finished, and lasts to the end.

        ROS 1's recorder writes the size of a chunk when it is full.
        """
        if head.end > head.data:
            return head
        try:
            following = ros1.read_head(self._read, head.data, self.size).op
        except ros1.RecordError:
            following = ros1.OP_MESSAGE  # compressed ones
        end = self.size if following in {ros1.OP_CONNECTION, ros1.OP_MESSAGE} else head.end
        return ros1.RecordHead(head.op, head.fields, head.data, end)

    def _next_chunk(self, place: int) -> int:
        """Return the place of the next chunk that begins behind a place; the size if none does."""
        while place < self.size:
            piece = self._read(place, _SEARCHED)
            for match in _CHUNK_MARK.finditer(piece):
                try:
                    head = ros1.read_head(self._read, place + match.start())
                except ros1.RecordError:
                    continue
                if head.op == ros1.OP_CHUNK:
                    return place + match.start()
            place += max(len(piece) - _LONGEST_MARK, 1)
        return self.size

    def _scan_chunk(self, head: ros1.RecordHead, place: int) -> None:
        chunk = _Chunk(place, 0, 0, {}, head)
        stamps: list[int] = []
        problems: list[BagError] = []
        self._chunks.append(chunk)
        buffer = self._load(chunk, problems.append)
        for when, connection, _ in self._walk(chunk, buffer, problems.append, self._scanned):
            stamps.append(when)
            chunk.counts[connection] = chunk.counts.get(connection, 0) + 1
        self._scanned.take(len(stamps))
        if stamps:
            chunk.start, chunk.end = min(stamps), max(stamps)
        else:
            self._chunks.pop()
            self.problems += problems  # nothing of it is read later

    def _add_connection(self, head: ros1.RecordHead, data: bytes, place: int) -> None:
        key = ros1.number(head.fields, "conn", place)
        if key in self._ranks:
            return
        header = ros1.read_fields(data, place)
        topic = ros1.text(head.fields, "topic", "")
        try:
            channel = bag.Channel(
                topic=topic,
                type=full_name(ros1.text(header, "type"), "msg"),
                encoding="ros1",
                definition=ros1.text(header, "message_definition"),
                md5=ros1.text(header, "md5sum"),
                qos=(LATCHED if header.get("latching") == b"1" else QoS(),),
                node=ros1.text(header, "callerid", ""),
            )
        except KeyError as error:
            raise ros1.RecordError(f"a connection to '{topic}' without {error}", place) from error
        self._ranks[key] = len(self.connections)
        self.connections.append(BagConnection(key, channel, header))

    # Bytes.

    def _read(self, offset: int, size: int) -> bytes:
        """Return bytes from a place; fewer at the end of the file."""
        size = min(size, self.size - offset)
        if size <= 0:
            return b""
        try:
            data = os.pread(self._file.fileno(), size, offset)
            while 0 < len(data) < size and offset + len(data) < self.size:
                data += os.pread(self._file.fileno(), size - len(data), offset + len(data))
        except (OSError, ValueError) as error:
            raise BagError(f"cannot be read: {error}", str(self.path), offset) from error
        return data

    def _error(self, error: ros1.RecordError) -> BagError:
        return BagError(f"damaged: {error.reason}", str(self.path), error.offset)

    def _head(self, chunk: _Chunk) -> ros1.RecordHead:
        """Return the head of a chunk; raise `RecordError` if there is none at its place."""
        if chunk.head is None:
            head = ros1.read_head(self._read, chunk.offset)
            if head.op != ros1.OP_CHUNK:
                raise ros1.RecordError(
                    f"a record of kind {head.op}, expected a chunk", chunk.offset
                )
            chunk.head = head
        return chunk.head

    def _packed(self, chunk: _Chunk) -> int:
        """Return the bytes of a chunk in the file."""
        head = self._head(chunk)
        return head.end - head.data

    def _load(self, chunk: _Chunk, damaged: bag.DamageReport) -> bytes:
        """Return the records of a chunk, as many as can be unpacked."""
        head = self._head(chunk)
        data = self._read(head.data, head.end - head.data)
        if len(data) < head.end - head.data:
            cut = ros1.RecordError(
                f"a chunk of {head.end - head.data} bytes, but {len(data)} are left", chunk.offset
            )
            damaged(self._error(cut))
        how = ros1.text(head.fields, "compression", "")
        if how == "none":
            return data
        if how not in _COMPRESSIONS:
            reason = f"a chunk compressed by '{how}', expected none, bz2 or lz4"
            raise ros1.RecordError(reason, chunk.offset)
        try:
            size = ros1.number(head.fields, "size", chunk.offset)
            return unpack(how, data, size or bag_limit())
        except ChunkError as error:
            reason = str(error)
            if not size:
                reason = f"a chunk was not finished; {len(error.sound)} bytes of it are left"
            if len(data) == head.end - head.data:
                damaged(self._error(ros1.RecordError(reason, chunk.offset)))
            return error.sound

    def _buffer(self, number_: int, damaged: bag.DamageReport) -> bytes:
        """Return the records of a chunk; the newest few stay in memory."""
        buffer = self._buffers.get(number_)
        if buffer is None:
            buffer = self._load(self._chunks[number_], damaged)
            self._buffers[number_] = buffer
            cached = sum(map(len, self._buffers.values()))
            while len(self._buffers) > (_CACHED if cached <= _CACHED_BYTES else 1):
                self._buffers.popitem(last=False)
        else:
            self._buffers.move_to_end(number_)
        return buffer

    def _walk(
        self, chunk: _Chunk, buffer: bytes, damaged: bag.DamageReport, budget: HeldChunks
    ) -> Iterator[tuple[int, int, int]]:
        """Yield stamp, connection and place of the messages of a chunk, record by record."""
        place = messages = 0
        most = budget.room(chunk.offset, chunk.offset, self._packed(chunk), len(buffer))

        def read(offset: int, size: int) -> bytes:
            return buffer[offset : offset + size]

        while place < len(buffer):
            try:
                head = ros1.read_head(read, place, len(buffer))
                if head.op == ros1.OP_CONNECTION:
                    self._add_connection(head, buffer[head.data : head.end], place)
                elif head.op == ros1.OP_MESSAGE:
                    messages += 1
                    if messages > most:
                        raise ros1.RecordError(str(too_many(most)), place)  # noqa: TRY301
                    key = ros1.number(head.fields, "conn", place)
                    if key not in self._ranks:
                        reason = f"a message of an unknown connection {key}"
                        raise ros1.RecordError(reason, place)  # noqa: TRY301
                    yield ros1.stamp(head.fields, "time", place), key, place
            except ros1.RecordError as error:
                where = self._within(chunk, error.offset)
                damaged(self._error(ros1.RecordError(error.reason + where[1], where[0])))
                return
            place = head.end

    def _within(self, chunk: _Chunk, place: int) -> tuple[int, str]:
        """Return a place of a chunk as one in the file, with what else there is to say."""
        head = self._head(chunk)
        if ros1.text(head.fields, "compression", "") == "none":
            return head.data + place, ""
        return chunk.offset, f", at byte {place} of the decompressed chunk"

    # The contents.

    @cached_property
    def chunks(self) -> Sequence[bag.Chunk]:
        """The chunks whose heads can be read."""
        listing: list[bag.Chunk] = []
        for chunk in self._chunks:
            try:
                head = self._head(chunk)
                listing.append(
                    bag.Chunk(
                        offset=chunk.offset,
                        compression=_COMPRESSIONS.get(
                            ros1.text(head.fields, "compression", ""), "none"
                        ),
                        size=head.end - head.data,
                        uncompressed=ros1.number(head.fields, "size", chunk.offset),
                        start=chunk.start,
                        end=chunk.end,
                    )
                )
            except ros1.RecordError:
                continue  # `messages` reports it
        return listing

    def count(self, channel: bag.Channel | None = None) -> int:
        """Return the number of messages of a channel, or of all."""
        return self._totals.total() if channel is None else self._totals[channel]

    @cached_property
    def _totals(self) -> Counter[bag.Channel]:
        numbers: Counter[int] = Counter()
        for chunk in self._chunks:
            numbers.update(chunk.counts)
        channels = {each.number: each.channel for each in self.connections}
        return bag.count_by_channel(numbers, channels)

    def connection(self, channel: bag.Channel) -> BagConnection:
        """Return the connection of a channel of this reader."""
        return next(each for each in self.connections if each.channel is channel)

    def stamps(self) -> Iterator[tuple[bag.Channel, int]]:
        """Yield channel and stamp of all messages by the index, chunk by chunk.

        Raises:
            BagError: A part of the file is damaged.
        """
        ranks = range(len(self.connections))
        for number_ in range(len(self._chunks)):
            for when, rank, *_ in self._places(number_, ranks, None, None, bag.refuse_damage):
                yield self.channels[rank], when

    def messages(
        self,
        topics: Collection[str] | None = None,
        start: int | None = None,
        end: int | None = None,
        *,
        reverse: bool = False,
        damaged: bag.DamageReport | None = None,
        channels: Collection[bag.Channel] | None = None,
    ) -> Iterator[bag.Entry]:
        """Yield messages in the order of their stamps; see `rosz.bags.BagReader.messages`.

        Messages of one stamp come in the order of their connections, as in ROS 1. ``channels``
        are channels of this reader, in place of topics.
        """
        report = damaged or bag.refuse_damage
        ranks = {
            rank
            for rank, channel in enumerate(self.channels)
            if (topics is None or channel.topic in topics)
            and (channels is None or any(channel is each for each in channels))
        }
        keys = {self.connections[rank].number for rank in ranks}
        spans = [
            (chunk.start, chunk.end, number_)
            for number_, chunk in enumerate(self._chunks)
            if not keys.isdisjoint(chunk.counts)
            and (start is None or chunk.end >= start)
            and (end is None or chunk.start <= end)
        ]

        held_chunks = HeldChunks(self.size, reverse=reverse)

        def places(number_: int) -> list[_Place]:
            chunk = self._chunks[number_]
            try:
                # The messages themselves are not held.
                most = held_chunks.room(chunk.start, chunk.end, self._packed(chunk), 0)
                if sum(chunk.counts.values()) > most:
                    raise too_many(most)
            except (ros1.RecordError, ChunkError) as error:
                report(self._error(ros1.RecordError(str(error), chunk.offset)))
                return []
            rows = self._places(number_, ranks, start, end, report)
            held_chunks.take(len(rows))
            return rows

        return self._entries(bag.in_order(spans, places, reverse=reverse), report)

    def _places(
        self,
        number_: int,
        ranks: Collection[int],
        start: int | None,
        end: int | None,
        report: bag.DamageReport,
    ) -> list[_Place]:
        """Return the places of the messages in a chunk: by its index, or else record by record."""
        chunk = self._chunks[number_]
        try:
            places = self._indexed_places(number_) if self.indexed else None
        except ros1.RecordError as error:
            report(self._error(error))
            places = None
        try:
            if places is None:
                budget = HeldChunks(self.size)
                walked = self._walk(chunk, self._buffer(number_, report), report, budget)
                places = [(when, self._ranks[key], number_, at) for when, key, at in walked]
        except ros1.RecordError as error:
            report(self._error(error))
            return []
        low, high = start or 0, end if end is not None else 1 << 64
        if len(ranks) == len(self.connections) and chunk.start >= low and chunk.end <= high:
            return places
        return [place for place in places if place[1] in ranks and low <= place[0] <= high]

    def _indexed_places(self, number_: int) -> list[_Place]:
        """Return the places of the messages in a chunk by the index behind it."""
        chunk = self._chunks[number_]
        place = self._head(chunk).end
        size = sum(chunk.counts.values()) * _INDEX_ENTRY.size + 64 * (len(chunk.counts) + 1)
        base, block = place, self._read(place, size)

        def read(offset: int, size: int) -> bytes:
            return block[offset - base : offset - base + size]

        places: list[_Place] = []
        for _ in chunk.counts:
            head = ros1.read_head(read, place)
            if head.op != ros1.OP_INDEX:
                raise ros1.RecordError(
                    f"a record of kind {head.op}, expected a chunk's index", place
                )
            rank = self._ranks.get(ros1.number(head.fields, "conn", place))
            data = read(head.data, head.end - head.data)
            expected = ros1.number(head.fields, "count", place) * _INDEX_ENTRY.size
            if rank is None or not len(data) == head.end - head.data == expected:
                raise ros1.RecordError("a chunk's index that does not fit it", place)
            places += [
                (seconds * _NS + nanoseconds, rank, number_, offset)
                for seconds, nanoseconds, offset in _INDEX_ENTRY.iter_unpack(data)
            ]
            place = head.end
        return places

    def _entries(
        self, runs: Iterator[list[_Place]], report: bag.DamageReport
    ) -> Iterator[bag.Entry]:
        """Yield the messages at places."""
        length = ros1.LENGTH.unpack_from
        channels = self.channels
        last, buffer, view, size = -1, b"", memoryview(b""), 0
        for run in runs:
            for when, rank, number_, place in run:
                if number_ != last:
                    try:
                        buffer = self._buffer(number_, report)
                    except ros1.RecordError as error:
                        report(self._error(error))
                        buffer = b""
                    last, view, size = number_, memoryview(buffer), len(buffer)
                if not size:
                    continue
                try:
                    begin = place + 4 + length(buffer, place)[0]
                    end = begin + 4 + length(buffer, begin)[0]
                except struct.error:
                    end = size + 1
                if end > size or buffer.find(_MESSAGE_MARK, place, begin) < 0:
                    self._report_message(number_, place, report)
                    continue
                source = buffer if end - begin < bag.SMALL else view
                yield bag.Entry(channels[rank], when, source[begin + 4 : end])

    def _report_message(self, number_: int, place: int, report: bag.DamageReport) -> None:
        chunk = self._chunks[number_]
        if place < ros1.number(self._head(chunk).fields, "size", chunk.offset):
            where, more = self._within(chunk, place)
        else:
            where, more = chunk.offset, f", at byte {place} of the chunk"
        report(self._error(ros1.RecordError(f"no message where the index says{more}", where)))

    def attachments(self) -> Iterator[bag.Attachment]:
        """Yield nothing: the format has no files within."""
        return iter(())

    def close(self) -> None:
        """Close the file; a second call has no effect."""
        self._file.close()
        self._buffers.clear()


def _chunk_info(head: ros1.RecordHead, data: bytes, place: int) -> _Chunk:
    count = ros1.number(head.fields, "count", place)
    if len(data) != count * _COUNT.size:
        raise ros1.RecordError(f"{len(data)} bytes about a chunk of {count} connections", place)
    return _Chunk(
        ros1.number(head.fields, "chunk_pos", place),
        ros1.stamp(head.fields, "start_time", place),
        ros1.stamp(head.fields, "end_time", place),
        dict(_COUNT.iter_unpack(data)),
    )
