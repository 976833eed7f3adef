"""The records of MCAP files as bytes (mcap.dev, version 0 of the format).

Written here rather than with the library ``mcap``: that writes 1 MB messages at a third of this
one's rate, reads small ones at a tenth of it, and takes a file that ends within a record for one
with less data in it.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping
from functools import lru_cache
from types import ModuleType

import msgspec

from rosz.bags.bag import Channel, Compression, Payload
from rosz.bags.qos_text import format_profiles, parse_profiles
from rosz.errors import RoszError, UsageError
from rosz.qos import LATCHED

__all__ = (
    "COMPRESSIONS",
    "FOOTER_SIZE",
    "HEAD",
    "MAGIC",
    "MESSAGE",
    "Cursor",
    "DamagedRecord",
    "Op",
    "Schema",
    "channel_body",
    "check_compression",
    "compress",
    "decompress",
    "footer",
    "parse_channel",
    "parse_schema",
    "record",
    "records_in",
    "schema_body",
    "text",
    "texts",
)

MAGIC = b"\x89MCAP0\r\n"
HEAD = struct.Struct("<BQ")
MESSAGE = struct.Struct("<BQHIQQ")
"""The head of a message's record, its channel, sequence number, stamp and time of sending."""
FOOTER_SIZE = HEAD.size + 20 + len(MAGIC)
COMPRESSIONS: dict[str, Compression] = {"": "none", "lz4": "lz4", "zstd": "zstd"}
_U16 = struct.Struct("<H")
_U32 = struct.Struct("<I")
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


class Schema(msgspec.Struct, frozen=True):
    """The type of channels.

    Attributes:
        name: Name of the type.
        encoding: Language of the definition.
        data: The definition.
    """

    name: str
    encoding: str
    data: bytes


class Cursor:
    """Reads the fields of a record one after the other.

    Args:
        data: The body of the record.
    """

    def __init__(self, data: Payload) -> None:
        self._data = memoryview(data)
        self.position = 0

    def take(self, size: int) -> memoryview:
        """Return the next bytes.

        Raises:
            DamagedRecord: The record has less.
        """
        end = self.position + size
        if end > len(self._data):
            raise DamagedRecord(
                f"the record ends within a field of {size} bytes, at its byte {len(self._data)}"
            )
        found = self._data[self.position : end]
        self.position = end
        return found

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
        """Return the next text.

        Raises:
            DamagedRecord: The record ends within it, or it is not UTF-8.
        """
        data = self.take(self.u32())
        try:
            return str(data, "utf-8")
        except UnicodeDecodeError as error:
            raise DamagedRecord(f"a text is not UTF-8: {error}") from error

    def texts(self) -> dict[str, str]:
        """Return the next map of texts."""
        inner = Cursor(self.take(self.u32()))
        found = {}
        while inner.position < len(inner._data):
            key = inner.text()
            found[key] = inner.text()
        return found


def record(op: int, body: bytes) -> bytes:
    """Return a record with its head."""
    return HEAD.pack(op, len(body)) + body


def records_in(data: Payload) -> Iterator[tuple[int, memoryview]]:
    """Yield the kind and the body of each record.

    Raises:
        DamagedRecord: A record is longer than what is left.
    """
    view = memoryview(data)
    position = 0
    while position < len(view):
        if position + HEAD.size > len(view):
            raise DamagedRecord(f"{len(view) - position} bytes are left of a record")
        op, length = HEAD.unpack_from(view, position)
        position += HEAD.size
        if position + length > len(view):
            raise DamagedRecord(
                f"a record of kind {op} says that it has {length} bytes, {len(view) - position}"
                " are left"
            )
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
    data = channel.definition.encode("utf-8", "surrogateescape")
    language = channel.language or _LANGUAGES.get(channel.encoding, "") if data else ""
    name = _ros1_name(channel.type) if channel.encoding == "ros1" else channel.type
    return _U16.pack(number) + text(name) + text(language) + _U32.pack(len(data)) + data


def parse_schema(body: Payload) -> tuple[int, Schema]:
    """Return the number of a schema, and the schema."""
    cursor = Cursor(body)
    number, name, encoding = cursor.u16(), cursor.text(), cursor.text()
    return number, Schema(name, encoding, bytes(cursor.take(cursor.u32())))


def channel_body(number: int, schema: int, channel: Channel) -> bytes:
    """Return the body of a channel's record; its texts have the names of ROS 1 and rosbag2."""
    about = {
        "offered_qos_profiles": format_profiles(channel.qos),
        "topic_type_hash": channel.type_hash,
        "callerid": channel.node,
        "md5sum": channel.md5,
        "latching": "1" if channel.latched and channel.encoding == "ros1" else "",
    }
    about = {name: value for name, value in about.items() if value}
    head = _U16.pack(number) + _U16.pack(schema)
    return head + text(channel.topic) + text(channel.encoding) + texts(about)


def parse_channel(body: Payload, schemas: Mapping[int, Schema]) -> tuple[int, Channel]:
    """Return the number of a channel, and the channel.

    Raises:
        DamagedRecord: It is not well-formed, or its schema is missing.
    """
    cursor = Cursor(body)
    number, schema_number = cursor.u16(), cursor.u16()
    topic, encoding, about = cursor.text(), cursor.text(), cursor.texts()
    schema = schemas.get(schema_number, Schema("", "", b""))
    if schema_number and schema_number not in schemas:
        raise DamagedRecord(f"channel '{topic}' has schema {schema_number}, which is not there")
    qos = parse_profiles(about.get("offered_qos_profiles", ""))
    if not qos and about.get("latching") in {"1", "true"}:
        qos = (LATCHED,)
    return number, Channel(
        topic=topic,
        type=_ros2_name(schema.name),
        encoding=encoding,
        definition=schema.data.decode("utf-8", "surrogateescape"),
        md5=about.get("md5sum", ""),
        type_hash=about.get("topic_type_hash", ""),
        qos=qos,
        node=about.get("callerid", ""),
        language="" if schema.encoding == _LANGUAGES.get(encoding) else schema.encoding,
    )


def _ros1_name(name: str) -> str:
    package, _, base = name.partition("/msg/")
    return f"{package}/{base}" if base else name


def _ros2_name(name: str) -> str:
    package, _, base = name.partition("/")
    return name if "/" in base or not base else f"{package}/msg/{base}"


# Compression.


def check_compression(name: str) -> None:
    """Check that this format has a compression, and that its library is installed.

    Raises:
        UsageError: It has not, or the library is missing.
    """
    if name not in COMPRESSIONS.values():
        raise UsageError(f"MCAP has no compression '{name}'; it has lz4, zstd and none")
    if name != "none":
        _library(name)


@lru_cache
def _library(name: str) -> ModuleType:
    from importlib import import_module

    try:
        return import_module({"lz4": "lz4.frame", "zstd": "zstandard"}[name])
    except ImportError as error:
        raise UsageError(
            f"the compression {name} needs a library: pip install 'rosz[bag]' ({error})"
        ) from error


def compress(name: Compression, data: Payload) -> bytes:
    """Return compressed bytes.

    Raises:
        UsageError: The library of the compression is missing.
    """
    library = _library(name)
    if name == "lz4":
        packed: bytes = library.compress(data)
    else:
        packed = library.ZstdCompressor(level=1).compress(data)
    return packed


def decompress(name: str, data: Payload, size: int) -> Payload:
    """Return the bytes of a chunk.

    Args:
        name: The compression as the file names it.
        data: The compressed bytes.
        size: Number of bytes that come out.

    Raises:
        DamagedRecord: They cannot be decompressed, or others come out.
        UsageError: The library of the compression is missing.
    """
    if name not in COMPRESSIONS:
        raise DamagedRecord(f"the chunk has the compression '{name}'; known are lz4 and zstd")
    found: Payload = data
    if name:
        library = _library(name)
        # A claim in damaged bytes must not allocate what it pleases.
        try:
            if name == "lz4":
                found = library.decompress(data)
            else:
                found = library.ZstdDecompressor().decompressobj().decompress(data)
        except (RuntimeError, ValueError, EOFError, _library_error(name)) as error:
            raise DamagedRecord(f"the chunk cannot be decompressed: {error}") from error
    if len(found) != size:
        raise DamagedRecord(f"the chunk has {len(found)} bytes, expected {size}")
    return found


def _library_error(name: str) -> type[Exception]:
    """Return the error that the library of a compression raises."""
    error: type[Exception] = getattr(_library(name), "ZstdError", RuntimeError)
    return error
