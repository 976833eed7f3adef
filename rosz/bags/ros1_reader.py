"""Reading of ROS 1's bags, format 2.0 (ROS wiki, Bags/Format/2.0).

Messages lie in chunks, which may be compressed. The index at the end of the file has the times of
each chunk, and behind each chunk are the places of the messages in it. Chunks are read when they
are reached; without an index, the file is read through once when it is opened, chunk by chunk.
What is damaged is reported with its place, and the rest is read.
"""

from __future__ import annotations

import os
import struct
from bisect import bisect_left
from collections import OrderedDict
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Self, cast

import msgspec

from rosz.bags.bag import SMALL, Attachment, Channel, Chunk, Compression, DamageReport, Entry
from rosz.bags.ros1_records import (
    LENGTH,
    MAGIC,
    OP_CHUNK,
    OP_CHUNK_INFO,
    OP_CONNECTION,
    OP_INDEX,
    OP_MESSAGE,
    RecordError,
    RecordHead,
    decompress,
    describe_begin,
    number,
    read_fields,
    read_head,
    stamp,
    text,
)
from rosz.errors import BagError
from rosz.idl import full_name
from rosz.qos import LATCHED, QoS

__all__ = ("Connection", "Ros1Reader")

_INDEX_ENTRY = struct.Struct("<III")
_COUNT = struct.Struct("<II")
_CACHED = 8
"""Chunks that stay in memory; more than one is needed where they overlap in time."""
_NS = 1_000_000_000
_MESSAGE_MARK = b"op=\x02"

_Place = tuple[int, int, int, int]
"""Stamp, rank of the connection, number of the chunk, and place in it: the order of messages."""


class Connection(msgspec.Struct, frozen=True):
    """One connection of a recorder to a publisher.

    Attributes:
        number: Its number in the file.
        channel: What it is to other formats.
        header: All fields that the publisher sent.
    """

    number: int
    channel: Channel
    header: Mapping[str, bytes]


class _Chunk(msgspec.Struct):
    """What the index says of a chunk, and its head once it was read."""

    offset: int
    start: int
    end: int
    counts: dict[int, int]
    head: RecordHead | None = None


class Ros1Reader:
    """A bag of ROS 1; see `rosz.bags.BagReader`.

    Args:
        path: The file.

    Attributes:
        connections: The connections, in the order of the file.

    Raises:
        BagError: The file cannot be read, or is not such a bag.
    """

    format = "rosbag"
    version = "2.0"

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self.metadata: Mapping[str, Mapping[str, str]] = {}
        self.connections: list[Connection] = []
        self._ranks: dict[int, int] = {}
        self._chunks: list[_Chunk] = []
        self._damage: list[BagError] = []
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
        self.channels: Sequence[Channel] = [one.channel for one in self.connections]
        counted = [one for one in self._chunks if one.counts]
        self.start: int = min((one.start for one in counted), default=0)
        self.end: int = max((one.end for one in counted), default=0)

    # Opening.

    def _open(self) -> bool:
        """Read the index, or else the whole file; return whether there is an index."""
        begin = self._read(0, len(MAGIC))
        if begin != MAGIC:
            raise BagError(describe_begin(begin), str(self.path), 0)
        try:
            head = read_head(self._read, len(MAGIC), self.size)
            how = text(head.fields, "encryptor", "")
            place = number(head.fields, "index_pos", len(MAGIC))
            if place and not how:
                self._read_index(place, head)
                return True
        except RecordError as error:
            self._damage.append(self._error(error))
            how = ""
        if how:
            raise BagError(
                f"encrypted by {how}; 'rosbag decrypt' of ROS 1 decrypts it", str(self.path)
            )
        self._scan()
        return False

    def _read_index(self, place: int, head: RecordHead) -> None:
        """Read the connections and what is known of the chunks, which stand at the end."""
        expected = tuple(
            number(head.fields, one, len(MAGIC)) for one in ("conn_count", "chunk_count")
        )
        connections: list[tuple[RecordHead, bytes, int]] = []
        chunks: list[_Chunk] = []
        base, tail = place, self._read(place, max(self.size - place, 0))

        def read(offset: int, size: int) -> bytes:
            return tail[offset - base : offset - base + size]

        while place < self.size:
            one = read_head(read, place, self.size)
            data = read(one.data, one.end - one.data)
            if one.op == OP_CONNECTION:
                connections.append((one, data, place))
            elif one.op == OP_CHUNK_INFO:
                chunks.append(_chunk_info(one, data, place))
            else:
                raise RecordError(f"a record of kind {one.op} in the index", place)
            place = one.end
        if (len(connections), len(chunks)) != expected:
            raise RecordError(
                f"an index of {len(connections)} connections and {len(chunks)} chunks, expected"
                f" {expected[0]} and {expected[1]}",
                place,
            )
        for one, data, offset in connections:
            self._add_connection(one, data, offset)
        self._chunks = chunks

    def _scan(self) -> None:
        """Read through the file: find its chunks, and in them connections and messages."""
        place = len(MAGIC)
        while place < self.size:
            try:
                head = read_head(self._read, place, self.size)
                if head.op == OP_CHUNK:
                    self._scan_chunk(head, place)
                elif head.op == OP_CONNECTION:
                    self._add_connection(head, self._data(head), place)
            except RecordError as error:
                if not self._damage or self._damage[-1].offset != error.offset:
                    self._damage.append(self._error(error))
                place = self._next_chunk(place + 1)
                continue
            if head.op == OP_CHUNK and head.end > self.size:
                return
            place = head.end

    def _next_chunk(self, place: int) -> int:
        """Return the place of the next chunk that begins behind a place; the size if none does."""
        mark = b"compression="
        while place < self.size:
            piece = self._read(place, 1 << 20)
            found = piece.find(mark)
            while found >= 0:
                # The fields may be in any order, the header is short.
                for back in range(8, 64):
                    begin = place + found - back
                    try:
                        head = read_head(self._read, begin) if begin > 0 else None
                    except RecordError:
                        continue
                    if head is not None and head.op == OP_CHUNK:
                        return begin
                found = piece.find(mark, found + 1)
            place += max(len(piece) - len(mark), 1)
        return self.size

    def _scan_chunk(self, head: RecordHead, place: int) -> None:
        chunk = _Chunk(place, 0, 0, {}, head)
        stamps: list[int] = []
        problems: list[BagError] = []
        self._chunks.append(chunk)
        buffer = self._load(chunk, problems.append)
        for when, connection, _ in self._walk(chunk, buffer, problems.append):
            stamps.append(when)
            chunk.counts[connection] = chunk.counts.get(connection, 0) + 1
        if stamps:
            chunk.start, chunk.end = min(stamps), max(stamps)
        else:
            self._chunks.pop()
            self._damage += problems  # nothing of it is read later

    def _add_connection(self, head: RecordHead, data: bytes, place: int) -> None:
        key = number(head.fields, "conn", place)
        if key in self._ranks:
            return
        header = read_fields(data, place)
        topic = text(head.fields, "topic", "")
        try:
            channel = Channel(
                topic=topic,
                type=full_name(text(header, "type"), "msg"),
                encoding="ros1",
                definition=text(header, "message_definition"),
                md5=text(header, "md5sum"),
                qos=(LATCHED if header.get("latching") == b"1" else QoS(),),
                node=text(header, "callerid", ""),
            )
        except KeyError as error:
            raise RecordError(f"a connection to '{topic}' without {error}", place) from error
        self._ranks[key] = len(self.connections)
        self.connections.append(Connection(key, channel, header))

    # Bytes.

    def _read(self, offset: int, size: int) -> bytes:
        """Return bytes from a place; fewer at the end of the file."""
        size = max(min(size, self.size - offset), 0)
        try:
            found = os.pread(self._file.fileno(), size, offset)
            while 0 < len(found) < size and offset + len(found) < self.size:
                found += os.pread(self._file.fileno(), size - len(found), offset + len(found))
        except (OSError, ValueError) as error:
            raise BagError(f"cannot be read: {error}", str(self.path), offset) from error
        return found

    def _data(self, head: RecordHead) -> bytes:
        return self._read(head.data, head.end - head.data)

    def _error(self, error: RecordError) -> BagError:
        return BagError(f"damaged: {error.reason}", str(self.path), error.offset)

    def _head(self, chunk: _Chunk) -> RecordHead:
        """Return the head of a chunk.

        Raises:
            RecordError: There is no chunk at its place.
        """
        if chunk.head is None:
            head = read_head(self._read, chunk.offset)
            if head.op != OP_CHUNK:
                raise RecordError(f"a record of kind {head.op}, expected a chunk", chunk.offset)
            chunk.head = head
        return chunk.head

    def _load(self, chunk: _Chunk, damaged: DamageReport) -> bytes:
        """Return the records of a chunk, as many as can be decompressed.

        Raises:
            RecordError: There is no chunk, or it is compressed in an unknown way.
        """
        head = self._head(chunk)
        data = self._data(head)
        if len(data) < head.end - head.data:
            cut = RecordError(
                f"a chunk of {head.end - head.data} bytes, but {len(data)} are left", chunk.offset
            )
            damaged(self._error(cut))
        how = text(head.fields, "compression", "")
        if how == "none":
            return data
        found, problem = decompress(how, data, chunk.offset)
        expected = number(head.fields, "size", chunk.offset)
        if (problem or len(found) < expected) and len(data) == head.end - head.data:
            reason = f"{len(found)} of {expected} bytes of a chunk decompress{problem}"
            damaged(self._error(RecordError(reason, chunk.offset)))
        return found

    def _buffer(self, number_: int, damaged: DamageReport) -> bytes:
        """Return the records of a chunk; the newest few stay in memory."""
        buffer = self._buffers.get(number_)
        if buffer is None:
            buffer = self._load(self._chunks[number_], damaged)
            self._buffers[number_] = buffer
            while len(self._buffers) > _CACHED:
                self._buffers.popitem(last=False)
        else:
            self._buffers.move_to_end(number_)
        return buffer

    def _walk(
        self, chunk: _Chunk, buffer: bytes, damaged: DamageReport
    ) -> Iterator[tuple[int, int, int]]:
        """Yield stamp, connection and place of the messages of a chunk, record by record."""
        place = 0

        def read(offset: int, size: int) -> bytes:
            return buffer[offset : offset + size]

        while place < len(buffer):
            try:
                head = read_head(read, place, len(buffer))
                if head.op == OP_CONNECTION:
                    self._add_connection(head, buffer[head.data : head.end], place)
                elif head.op == OP_MESSAGE:
                    yield stamp(head.fields, "time", place), self._key(head, place), place
            except RecordError as error:
                where = self._within(chunk, error.offset)
                damaged(self._error(RecordError(error.reason + where[1], where[0])))
                return
            place = head.end

    def _key(self, head: RecordHead, place: int) -> int:
        """Return the number of a message's connection."""
        key = number(head.fields, "conn", place)
        if key not in self._ranks:
            raise RecordError(f"a message of an unknown connection {key}", place)
        return key

    def _within(self, chunk: _Chunk, place: int) -> tuple[int, str]:
        """Return a place of a chunk as one in the file, with what else there is to say."""
        head = self._head(chunk)
        if text(head.fields, "compression", "") == "none":
            return head.data + place, ""
        return chunk.offset, f", at byte {place} of the decompressed chunk"

    # The contents.

    @property
    def problems(self) -> Sequence[BagError]:
        """The errors that were found when the bag was opened."""
        return self._damage

    @cached_property
    def chunks(self) -> Sequence[Chunk]:
        """The chunks whose heads can be read."""
        found: list[Chunk] = []
        for one in self._chunks:
            try:
                head = self._head(one)
                found.append(
                    Chunk(
                        offset=one.offset,
                        compression=cast(Compression, text(head.fields, "compression", "")),
                        size=head.end - head.data,
                        uncompressed=number(head.fields, "size", one.offset),
                        start=one.start,
                        end=one.end,
                    )
                )
            except RecordError:
                continue  # `messages` reports it
        return found

    def count(self, channel: Channel | None = None) -> int:
        """Return the number of messages of a channel, or of all."""
        keys = {one.number for one in self.connections if channel is None or one.channel == channel}
        return sum(n for one in self._chunks for key, n in one.counts.items() if key in keys)

    def connection(self, channel: Channel) -> Connection:
        """Return the connection of a channel of this reader."""
        return next(one for one in self.connections if one.channel is channel)

    def stamps(self, channel: Channel) -> list[int]:
        """Return the stamps of all messages of a channel by the index, sorted.

        Raises:
            BagError: A part of the file is damaged.
        """
        rank = next(n for n, one in enumerate(self.channels) if one is channel)
        found: list[int] = []
        for number_, chunk in enumerate(self._chunks):
            if self.connections[rank].number in chunk.counts:
                found += [one[0] for one in self._places(number_, {rank}, None, None, _refuse)]
        return sorted(found)

    def messages(
        self,
        topics: Collection[str] | None = None,
        start: int | None = None,
        end: int | None = None,
        *,
        reverse: bool = False,
        damaged: DamageReport | None = None,
        channels: Collection[Channel] | None = None,
    ) -> Iterator[Entry]:
        """Yield messages in the order of their stamps; see `rosz.bags.BagReader`.

        Messages of one stamp come in the order of their connections, as in ROS 1.

        Args:
            topics: Full names of the topics; all when not given.
            start: Earliest stamp.
            end: Latest stamp; messages of this stamp are included.
            reverse: Whether to begin with the latest.
            damaged: Function called with each damaged part, which is left out; the first one is
                raised when not given.
            channels: Channels of this reader, in place of topics.

        Raises:
            BagError: A part of the file is damaged.
        """
        report = damaged or _refuse
        ranks = {
            rank
            for rank, one in enumerate(self.channels)
            if (topics is None or one.topic in topics)
            and (channels is None or any(one is each for each in channels))
        }
        keys = {self.connections[rank].number for rank in ranks}
        wanted = [
            number_
            for number_, one in enumerate(self._chunks)
            if not keys.isdisjoint(one.counts)
            and (start is None or one.end >= start)
            and (end is None or one.start <= end)
        ]
        places = self._merged(wanted, ranks, (start, end), reverse, report)
        return self._entries(places, report)

    def _merged(
        self,
        wanted: list[int],
        ranks: Collection[int],
        limits: tuple[int | None, int | None],
        reverse: bool,
        report: DamageReport,
    ) -> Iterator[list[_Place]]:
        """Yield the places of messages in order, in runs."""
        ordered = sorted(
            wanted, key=lambda n: -self._chunks[n].end if reverse else self._chunks[n].start
        )
        rest: list[_Place] = []
        for position, number_ in enumerate(ordered, 1):
            rest += self._places(number_, ranks, *limits, report)
            rest.sort()
            if position == len(ordered):
                break
            following = self._chunks[ordered[position]]
            if reverse:
                cut = bisect_left(rest, (following.end + 1,))
                yield rest[cut:][::-1]
                del rest[cut:]
            else:
                cut = bisect_left(rest, (following.start,))
                yield rest[:cut]
                del rest[:cut]
        yield rest[::-1] if reverse else rest

    def _places(
        self,
        number_: int,
        ranks: Collection[int],
        start: int | None,
        end: int | None,
        report: DamageReport,
    ) -> list[_Place]:
        """Return the places of the messages in a chunk: by its index, or else record by record."""
        chunk = self._chunks[number_]
        try:
            found = self._indexed_places(number_) if self.indexed else None
        except RecordError as error:
            report(self._error(error))
            found = None
        try:
            if found is None:
                walked = self._walk(chunk, self._buffer(number_, report), report)
                found = [(when, self._ranks[key], number_, at) for when, key, at in walked]
        except RecordError as error:
            report(self._error(error))
            return []
        low, high = start or 0, end if end is not None else 1 << 64
        if len(ranks) == len(self.connections) and chunk.start >= low and chunk.end <= high:
            return found
        return [one for one in found if one[1] in ranks and low <= one[0] <= high]

    def _indexed_places(self, number_: int) -> list[_Place]:
        """Return the places of the messages in a chunk by the index behind it.

        Raises:
            RecordError: The index is damaged.
        """
        chunk = self._chunks[number_]
        place = self._head(chunk).end
        size = sum(chunk.counts.values()) * _INDEX_ENTRY.size + 64 * (len(chunk.counts) + 1)
        base, block = place, self._read(place, size)

        def read(offset: int, size: int) -> bytes:
            return block[offset - base : offset - base + size]

        found: list[_Place] = []
        for _ in chunk.counts:
            head = read_head(read, place)
            if head.op != OP_INDEX:
                raise RecordError(f"a record of kind {head.op}, expected a chunk's index", place)
            rank = self._ranks.get(number(head.fields, "conn", place))
            data = read(head.data, head.end - head.data)
            expected = number(head.fields, "count", place) * _INDEX_ENTRY.size
            if rank is None or not len(data) == head.end - head.data == expected:
                raise RecordError("a chunk's index that does not fit it", place)
            found += [
                (seconds * _NS + nanoseconds, rank, number_, offset)
                for seconds, nanoseconds, offset in _INDEX_ENTRY.iter_unpack(data)
            ]
            place = head.end
        return found

    def _entries(self, runs: Iterator[list[_Place]], report: DamageReport) -> Iterator[Entry]:
        """Yield the messages at places."""
        length = LENGTH.unpack_from
        channels = self.channels
        last, buffer, view, size = -1, b"", memoryview(b""), 0
        for run in runs:
            for when, rank, number_, place in run:
                if number_ != last:
                    try:
                        buffer = self._buffer(number_, report)
                    except RecordError as error:
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
                source = buffer if end - begin < SMALL else view
                yield Entry(channels[rank], when, source[begin + 4 : end])

    def _report_message(self, number_: int, place: int, report: DamageReport) -> None:
        chunk = self._chunks[number_]
        if place < number(self._head(chunk).fields, "size", chunk.offset):
            where, more = self._within(chunk, place)
        else:
            where, more = chunk.offset, f", at byte {place} of the chunk"
        report(self._error(RecordError(f"no message where the index says{more}", where)))

    def attachments(self) -> Iterator[Attachment]:
        """Yield nothing: the format has no files within."""
        return iter(())

    def close(self) -> None:
        """Close the file; a second call has no effect."""
        self._file.close()
        self._buffers.clear()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc_info: object) -> None:
        self.close()


def _refuse(error: Exception) -> None:
    raise error


def _chunk_info(head: RecordHead, data: bytes, place: int) -> _Chunk:
    count = number(head.fields, "count", place)
    if len(data) != count * _COUNT.size:
        raise RecordError(f"{len(data)} bytes about a chunk of {count} connections", place)
    return _Chunk(
        number(head.fields, "chunk_pos", place),
        stamp(head.fields, "start_time", place),
        stamp(head.fields, "end_time", place),
        dict(_COUNT.iter_unpack(data)),
    )
