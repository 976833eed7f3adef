"""The records of MCAP files as bytes (mcap.dev, version 0 of the format).

Written here rather than with the library ``mcap``: that writes 1 MB messages at a third of this
one's rate, reads small ones at a tenth of it, and takes a file that ends within a record for one
with less data in it.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping

import msgspec

from rosz.bags.bag import Channel, Compression, Payload, compression_library
from rosz.bags.formats import channel_text
from rosz.bags.formats.chunks import ChunkError, unpack
from rosz.errors import RoszError
from rosz.idl import full_name
from rosz.qos import LATCHED

MAGIC = b"\x89MCAP0\r\n"
HEAD = struct.Struct("<BQ")
MESSAGE = struct.Struct("<BQHIQQ")
"""The head of a message's record, its channel, sequence number, stamp and time of sending."""
CHUNK_HEAD = struct.Struct("<QQQI")
CHUNK_INDEX = struct.Struct("<QQQQ")
LATEST = (1 << 64) - 1
FOOTER_SIZE = HEAD.size + 20 + len(MAGIC)
COMPRESSIONS: dict[str, Compression] = {"": "none", "lz4": "lz4", "zstd": "zstd"}
_U16 = struct.Struct("<H")
_U32 = struct.Struct("<I")
_EVENT = "service_event_type"
"""Text of a channel with the name in ROS 2 of the events of a service."""
_LANGUAGES = {"cdr": "ros2msg", "ros1": "ros1msg"}


class Op:
    """The first byte of each kind of record."""

    HEADER = 1
    FOOTER = 2
    SCHEMA = 3
    CHANNEL = 4
    MESSAGE = 5
    CHUNK = 6
    MESSAGE_INDEX = 7
    CHUNK_INDEX = 8
    ATTACHMENT = 9
    ATTACHMENT_INDEX = 10
    STATISTICS = 11
    METADATA = 12
    METADATA_INDEX = 13
    SUMMARY_OFFSET = 14
    DATA_END = 15


class DamagedRecord(RoszError):
    """Bytes that are not a record; readers add the place in the file."""


class MissingSchema(DamagedRecord):
    """A channel whose schema has not been read."""


class Schema(msgspec.Struct, frozen=True):
    """The type of channels; `encoding` is the language of the definition."""

    name: str
    encoding: str
    data: bytes


class Cursor:
    """Reads the fields of a record's body one after the other."""

    def __init__(self, data: Payload) -> None:
        self._data = memoryview(data)
        self.position = 0

    def take(self, size: int) -> memoryview:
        """Return the next bytes; raise `DamagedRecord` if the record has less."""
        end = self.position + size
        if end > len(self._data):
            raise DamagedRecord(
                f"the record ends within a field of {size} bytes, at its byte {len(self._data)}"
            )
        taken = self._data[self.position : end]
        self.position = end
        return taken

    def fields(self, form: struct.Struct) -> tuple[int, ...]:
        """Return the next numbers."""
        return form.unpack(self.take(form.size))

    def u16(self) -> int:
        """Return the next number of 16 bits."""
        number: int = _U16.unpack(self.take(2))[0]
        return number

    def u32(self) -> int:
        """Return the next number of 32 bits."""
        number: int = _U32.unpack(self.take(4))[0]
        return number

    def text(self) -> str:
        """Return the next text; raise `DamagedRecord` if it is cut off, or not UTF-8."""
        data = self.take(self.u32())
        try:
            return str(data, "utf-8")
        except UnicodeDecodeError as error:
            raise DamagedRecord(f"a text is not UTF-8: {error}") from error

    def texts(self) -> dict[str, str]:
        """Return the next map of texts."""
        inner = Cursor(self.take(self.u32()))
        pairs = {}
        while inner.position < len(inner._data):
            key = inner.text()
            pairs[key] = inner.text()
        return pairs


def record(op: int, body: bytes) -> bytes:
    """Return a record with its head."""
    return HEAD.pack(op, len(body)) + body


def head_at(data: Payload, position: int) -> tuple[int, int]:
    """Return the kind of a record, and the length of its body behind the head.

    Raises:
        DamagedRecord: The data end before it does.
    """
    left = len(data) - position - HEAD.size
    if left < 0:
        raise DamagedRecord(f"{left + HEAD.size} bytes are left of a record")
    op, length = HEAD.unpack_from(data, position)
    if length > left:
        raise DamagedRecord(
            f"a record of kind {op} says that it has {length} bytes, {left} are left"
        )
    return op, length


def records_in(data: Payload) -> Iterator[tuple[int, memoryview]]:
    """Yield the kind and the body of each record; raise `DamagedRecord` if data end early."""
    view = memoryview(data)
    position = 0
    while position < len(view):
        op, length = head_at(view, position)
        position += HEAD.size
        yield op, view[position : position + length]
        position += length


def text(value: str) -> bytes:
    """Return a text behind its length."""
    data = value.encode("utf-8", "surrogateescape")
    return _U32.pack(len(data)) + data


def texts(values: Mapping[str, str]) -> bytes:
    """Return a map of texts behind its length in bytes."""
    data = b"".join(text(key) + text(value) for key, value in values.items())
    return _U32.pack(len(data)) + data


def footer(summary: bytes, summary_start: int, offsets_start: int) -> bytes:
    """Return the footer behind a summary, and the end of the file."""
    head = HEAD.pack(Op.FOOTER, 20) + struct.pack("<QQ", summary_start, offsets_start)
    return head + _U32.pack(zlib.crc32(head, zlib.crc32(summary))) + MAGIC


# Channels.


def schema_body(number: int, channel: Channel) -> bytes:
    """Return the body of the schema of a channel."""
    definition = channel_text.event_definition(channel.type, channel.definition)
    data = definition.encode("utf-8", "surrogateescape")
    language = channel.language or _LANGUAGES.get(channel.encoding, "") if data else ""
    name = channel_text.event_type(channel.type) or channel.type
    if channel.encoding == "ros1":
        name = channel.type.replace("/msg/", "/", 1)
    return _U16.pack(number) + text(name) + text(language) + _U32.pack(len(data)) + data


def parse_schema(body: Payload) -> tuple[int, Schema]:
    """Return the number of a schema, and the schema."""
    cursor = Cursor(body)
    number, name, encoding = cursor.u16(), cursor.text(), cursor.text()
    return number, Schema(name, encoding, bytes(cursor.take(cursor.u32())))


def channel_body(number: int, schema: int, channel: Channel) -> bytes:
    """Return the body of a channel's record; its texts have the names of ROS 1 and rosbag2."""
    about = {
        "offered_qos_profiles": channel_text.format_profiles(channel.qos),
        "topic_type_hash": channel.type_hash,
        "callerid": channel.node,
        "md5sum": channel.md5,
        _EVENT: channel.type if channel_text.event_type(channel.type) else "",
        "latching": "1" if channel.latched and channel.encoding == "ros1" else "",
    }
    about = {name: value for name, value in about.items() if value}
    head = _U16.pack(number) + _U16.pack(schema)
    return head + text(channel.topic) + text(channel.encoding) + texts(about)


def parse_channel(body: Payload, schemas: Mapping[int, Schema]) -> tuple[int, Channel]:
    """Return the number of a channel, and the channel; its schema must be among the given ones."""
    cursor = Cursor(body)
    number, schema_number = cursor.u16(), cursor.u16()
    topic, encoding, about = cursor.text(), cursor.text(), cursor.texts()
    schema = schemas.get(schema_number, Schema("", "", b""))
    if schema_number and schema_number not in schemas:
        raise MissingSchema(f"channel '{topic}' has schema {schema_number}, which is not there")
    qos = channel_text.parse_profiles(about.get("offered_qos_profiles", ""))
    if not qos and about.get("latching") in {"1", "true"}:
        qos = (LATCHED,)
    return number, Channel(
        topic=topic,
        type=about.get(_EVENT) or full_name(schema.name, "msg"),
        encoding=encoding,
        definition=schema.data.decode("utf-8", "surrogateescape"),
        md5=about.get("md5sum", ""),
        type_hash=about.get("topic_type_hash", ""),
        qos=qos,
        node=about.get("callerid", ""),
        language="" if schema.encoding == _LANGUAGES.get(encoding) else schema.encoding,
    )


# Compression.


def compress(name: Compression, data: Payload) -> bytes:
    """Return compressed bytes."""
    library = compression_library(name)
    if name == "lz4":
        packed: bytes = library.compress(data)
    else:
        packed = library.ZstdCompressor(level=1).compress(data)
    return packed


def decompress(name: str, data: Payload, size: int) -> Payload:
    """Return the bytes of a chunk, which has a compression as the file names it.

    Raises:
        DamagedRecord: It cannot be unpacked, or others than ``size`` bytes come out.
    """
    if name not in COMPRESSIONS:
        raise DamagedRecord(f"the chunk has the compression '{name}'; known are lz4 and zstd")
    if name:
        try:
            return unpack(name, data, size)
        except ChunkError as error:
            raise DamagedRecord(str(error)) from error
    if len(data) != size:
        raise DamagedRecord(f"the chunk has {len(data)} bytes, expected {size}")
    return data
