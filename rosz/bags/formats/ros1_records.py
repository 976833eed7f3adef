"""Records of ROS 1's bags: named fields, and data (ROS wiki, Bags/Format/2.0).

A record is a header and data, each behind its length of four bytes. The header consists of fields
``name=value``, each behind its length; values are little-endian numbers or text.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from struct import Struct
from typing import NamedTuple, TypeAlias

MAGIC = b"#ROSBAG V2.0\n"
LENGTH = Struct("<I")

OP_MESSAGE = 2
OP_BAG = 3
OP_INDEX = 4
OP_CHUNK = 5
OP_CHUNK_INFO = 6
OP_CONNECTION = 7

_LONGEST_HEAD = 1 << 20
"""Bytes; a connection's fields, with its definition, are data."""

_NUMBER_SIZE = 8
_STAMP = Struct("<II")

Fields: TypeAlias = Mapping[str, bytes]


class RecordError(Exception):
    """A record that is not well-formed, and its place; it becomes a `rosz.errors.BagError`."""

    def __init__(self, reason: str, offset: int) -> None:
        super().__init__(reason)
        self.reason = reason
        self.offset = offset


class RecordHead(NamedTuple):
    """A record without its data: its kind and fields, and where its data begin and end."""

    op: int
    fields: Fields
    data: int
    end: int


def read_head(
    read: Callable[[int, int], bytes], offset: int, limit: int | None = None
) -> RecordHead:
    """Return the head of a record; its data have to end before the limit, except those of a chunk.

    ``read`` returns as many bytes from a place, fewer at the end.

    Raises:
        RecordError: The record is not well-formed, or incomplete before its data.
    """
    size = _length(read, offset, "the length of a record's header")
    if size > _LONGEST_HEAD:
        raise RecordError(f"a record's header of {size} bytes, expected at most 1 MB", offset)
    head = read(offset + 4, size)
    if len(head) < size:
        raise RecordError(f"a record's header of {size} bytes, but {len(head)} are left", offset)
    fields = read_fields(head, offset)
    data = offset + 8 + size
    op = fields.get("op", b"")
    if len(op) != 1:
        raise RecordError("a record without a field 'op' of one byte", offset)
    end = data + _length(read, data - 4, "the length of data")
    if limit is not None and end > limit and op[0] != OP_CHUNK:
        raise RecordError(f"a record that ends at byte {end}, of {limit} that there are", offset)
    return RecordHead(op[0], fields, data, end)


def _length(read: Callable[[int, int], bytes], offset: int, what: str) -> int:
    data = read(offset, 4)
    if len(data) < LENGTH.size:
        raise RecordError(f"the file ends within {what}", offset)
    (length,) = LENGTH.unpack(data)
    return int(length)


def read_fields(data: bytes, offset: int) -> dict[str, bytes]:
    """Return the fields of a header without its length; errors have the offset of the record."""
    fields: dict[str, bytes] = {}
    place = 0
    while place < len(data):
        if place + 4 > len(data):
            raise RecordError("a field that is cut off", offset)
        (size,) = LENGTH.unpack_from(data, place)
        place += 4 + size
        name, equals, value = data[place - size : place].partition(b"=")
        if place > len(data) or not equals:
            raise RecordError("a field that is not name=value", offset)
        fields[name.decode("utf-8", "replace")] = value
    return fields


def number(fields: Fields, name: str, offset: int) -> int:
    """Return a field that is a number; raise `RecordError` if there is none."""
    if name not in fields or len(fields[name]) > _NUMBER_SIZE:
        raise RecordError(f"a record without a number in its field '{name}'", offset)
    return int.from_bytes(fields[name], "little")


def stamp(fields: Fields, name: str, offset: int) -> int:
    """Return a field that is a time, in nanoseconds; raise `RecordError` if it is none."""
    value = fields.get(name, b"")
    if len(value) != _STAMP.size:
        raise RecordError(f"a record without a time in its field '{name}'", offset)
    seconds, nanoseconds = _STAMP.unpack(value)
    return int(seconds) * 1_000_000_000 + int(nanoseconds)


def text(fields: Fields, name: str, default: str | None = None) -> str:
    """Return a field that is text; raise KeyError if it does not exist, and has no default."""
    if default is not None and name not in fields:
        return default
    return fields[name].decode("utf-8", "replace")


def describe_begin(begin: bytes) -> str:
    """Return why a file that begins with these bytes cannot be read."""
    if not begin:
        return "the file is empty"
    if begin.startswith((b"#ROSBAG V", b"#ROSRECORD V")):
        version = begin.partition(b"V")[2].split(b"\n")[0].decode("ascii", "replace")
        return f"a bag of version {version}, expected 2.0; 'rosbag reindex' of ROS 1 makes it 2.0"
    return f"not a bag of ROS 1: it begins with {bytes(begin[:8])!r}, expected {MAGIC[:8]!r}"
