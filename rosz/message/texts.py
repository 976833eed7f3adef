"""Strings on the wire, one at a time and in lists."""

from __future__ import annotations

from array import array
from struct import Struct
from struct import error as struct_error
from typing import Any

__all__ = ("StringList", "Texts", "pack_wide", "put_text", "read_wide")

_count = Struct("<I")
_pack_count = _count.pack
_read_count = _count.unpack_from

_MOST_TEXTS = 4096
_LONGEST_TEXT = 128
_LARGEST_LIST = 1 << 14


def put_text(value: Any) -> bytes:
    """Return the UTF-8 bytes of a string, with its NUL.

    Raises:
        ValueError: It holds U+0000, which the wire cannot carry, or half a surrogate pair.
        AttributeError: It is no string.
    """
    octets: bytes = value.encode()
    if 0 in octets:
        raise ValueError("it holds a NUL character")
    return octets + b"\0"


class Texts(dict[str, tuple[int, bytes]]):
    """Encoded forms (length, bytes) of strings that tend to repeat: frames, names, keys.

    Bounded: long strings are not kept, and a full cache starts anew.
    """

    def __missing__(self, value: str) -> tuple[int, bytes]:
        octets = put_text(value)
        entry = len(octets), octets
        if len(octets) <= _LONGEST_TEXT:
            if len(self) >= _MOST_TEXTS:
                self.clear()
            self[value] = entry
        return entry


class StringList:
    """Lists of strings at one place of one type: joint names hardly ever change.

    Remembers the last list that was written and the last one that was read, each with its bytes
    from the count on, so that the next equal one costs one comparison.

    Args:
        size: Elements of a fixed array, which has no count on the wire; -1 for a sequence.
        most: Most elements of a bounded sequence; -1 where unbounded.
        bound: Most bytes of each string; -1 where unbounded.
    """

    __slots__ = ("_bound", "_most", "_size", "read", "written")

    def __init__(self, size: int = -1, most: int = -1, bound: int = -1) -> None:
        self._size = size
        self._most = most
        self._bound = bound
        empty = b"" if size >= 0 else bytes(4)
        self.written: tuple[list[str] | None, bytes] = ([], empty) if size < 0 else (None, b"")
        self.read: tuple[bytes, list[str]] = (bytes(4), []) if size < 0 else (b"\xff" * 8, [])

    def put(self, values: list[str]) -> bytes:
        """Return the bytes of a list, which starts at an offset that four divides."""
        if type(values) is not list:
            values = list(_strings(values))
        self._check(len(values))
        parts = [] if self._size >= 0 else [_pack_count(len(values))]
        length = 0
        for value in values:
            octets = put_text(value)
            if len(octets) > self._bound + 1 > 0:
                raise ValueError("a string is longer than its bound")
            parts.append(bytes(-length & 3) + _pack_count(len(octets)) + octets)
            length = len(octets)
        data = b"".join(parts)
        if len(data) <= _LARGEST_LIST:
            self.written = values[:], data
        return data

    def take(self, data: bytes, offset: int) -> tuple[list[str], int]:
        """Return the list at an offset that four divides, and the offset after it."""
        start = offset
        count = self._size
        if count < 0:
            (count,) = _read_count(data, offset)
            offset += 4
            self._check(count)
        values: list[str] = []
        end = offset
        for _ in range(count):
            end = (end + 3) & -4
            (length,) = _read_count(data, end)
            if length > self._bound + 1 > 0:
                raise ValueError("a string is longer than its bound")
            offset = end + 4
            end = offset + length
            values.append(data[offset : end - 1].decode())
        if end > len(data):
            raise struct_error("a string ends after the bytes do")
        if end - start <= _LARGEST_LIST:
            self.read = data[start:end], values[:]
        return values, end

    def _check(self, count: int) -> None:
        if (self._size >= 0 and count != self._size) or count > self._most >= 0:
            raise ValueError(f"{count} strings are not what the type holds")


def _strings(values: Any) -> Any:
    if isinstance(values, str | bytes):
        raise TypeError("a string is no list of strings")
    return values


def pack_wide(value: Any) -> bytes:
    """Return a wide string as UTF-16 code units of four bytes each, without a terminator."""
    units = array("H", value.encode("utf-16-le"))
    return array("I", units.tolist()).tobytes()


def read_wide(octets: bytes) -> str:
    """Return the string in code units of four bytes each."""
    return array("H", array("I", octets).tolist()).tobytes().decode("utf-16-le")
