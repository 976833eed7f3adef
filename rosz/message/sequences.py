"""Strings and numeric sequences on the wire.

Numeric sequences become buffers of the right element type, whatever sequence a caller gives.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from struct import Struct
from struct import error as struct_error
from typing import Any

from rosz.message.layout import CDR, ByteLayout

TRUTH = {False: False, True: True}
"""The values of a bool, and values equal to them, such as numpy's; any other is a KeyError."""

_OCTET_FORMATS = frozenset({"B", "b", "c", "?"})


def numbers(value: Any, code: str, size: int = -1) -> tuple[int, bytes | array[Any] | memoryview]:
    """Return the count of numbers, and a buffer of them.

    Buffers of the right type (``array.array``, numpy arrays of any shape) are not copied; other
    sequences are packed.

    Args:
        value: The sequence.
        code: Element type, as the ``array`` module spells it.
        size: Number of elements that it must have; -1 for any.

    Raises:
        TypeError: The value is not a sequence.
        struct.error: An element is not such a number, or is outside the range of the type.
        OverflowError: A number is too large for a float32.
        ValueError: The number of elements is wrong.
    """
    if type(value) is not list and type(value) is not tuple:
        view = _view(value, code)
        value = _plain(value) if view is None else view
    count = len(value)
    if count != size >= 0:
        raise ValueError(f"expected {size} elements, got {count}")
    if type(value) is list or type(value) is tuple:
        return count, _packers[code, count](*value)
    return count, value


class _ListPackers(dict[tuple[str, int], Callable[..., bytes]]):
    """Functions that pack so many numbers of a type, which is faster than an array's constructor.

    Those of long lists are not kept, and a full cache is emptied.
    """

    def __missing__(self, key: tuple[str, int]) -> Callable[..., bytes]:
        code, count = key
        # Only the portable format checks the range of a float32.
        pack = Struct(f"{'=' if code == 'f' else '@'}{count}{code}").pack
        if count <= _LONGEST_LIST:
            if len(self) >= _MOST_LISTS:
                self.clear()
            self[key] = pack
        return pack


_LONGEST_LIST = 4096
_MOST_LISTS = 1024
_packers = _ListPackers()


def _plain(value: Any) -> list[Any]:
    """Return any other sequence of numbers as a list."""
    if isinstance(value, str | bytes | bytearray | dict | set):
        raise TypeError(f"'{type(value).__name__}' is not a sequence of numbers")
    _refuse_iterator(value)
    return _flat(value.tolist()) if hasattr(value, "tolist") else list(value)


def _view(value: Any, code: str) -> array[Any] | memoryview | None:
    """Return a buffer that has just that type; None for any other value."""
    if type(value) is array and value.typecode == code:
        return value
    try:
        view = memoryview(value)
    except TypeError:
        return None
    if not view.c_contiguous or view.itemsize != array(code).itemsize:
        return None
    given = view.format.lstrip("@=<")
    if given != code and given not in _SAME.get(code, ""):
        return None
    if view.nbytes == 0:
        return array(code)
    flat: memoryview = view.cast("B").cast(code)  # type: ignore[call-overload]
    return flat


_SAME = {"q": "l", "Q": "L", "i": "l", "I": "L"}
"""Other formats of the same meaning where the size is equal: C's long."""


def _flat(values: Any) -> list[Any]:
    """Return the numbers of nested lists, which a numpy array of several dimensions gives."""
    if values and isinstance(values[0], list):
        return [number for row in values for number in _flat(row)]
    plain: list[Any] = values
    return plain


def _refuse_iterator(value: Any) -> None:
    """Refuse an iterator: a message may be encoded more than once."""
    if not hasattr(value, "__len__"):
        raise TypeError(f"'{type(value).__name__}' is not a sequence")


def octets(value: Any, size: int = -1) -> bytes | memoryview:
    """Return octets as a buffer.

    Raises:
        TypeError: The value is not a sequence of integers.
        ValueError: A number is not in 0..255, or the number of elements is wrong.
    """
    block: bytes | memoryview
    if type(value) is bytes:
        block = value
    else:
        try:
            view = memoryview(value)
        except TypeError:
            if isinstance(value, str | int | dict | set):
                raise
            _refuse_iterator(value)
            block = bytes(value)
        else:
            if view.format in _OCTET_FORMATS and view.c_contiguous:
                block = view.cast("B") if view.nbytes else b""
            else:
                try:
                    block = bytes(_flat(value.tolist()))
                except NotImplementedError as error:  # a format that only numpy reads
                    raise TypeError(str(error)) from None
    if len(block) != size >= 0:
        raise ValueError(f"expected {size} elements, got {len(block)}")
    return block


def flags(value: Any, size: int = -1) -> bytes:
    """Return truth values as octets, 0 and 1.

    Raises:
        TypeError: The value is not a sequence of truth values.
        ValueError: A number is not in 0..255, or the number of elements is wrong.
    """
    if isinstance(value, str | dict | set):
        raise TypeError(f"'{type(value).__name__}' is not a sequence of truth values")
    _refuse_iterator(value)
    plain = _flat(value.tolist()) if hasattr(value, "tolist") else value
    block = bytes(plain).translate(_ONES)
    if len(block) != size >= 0:
        raise ValueError(f"expected {size} elements, got {len(block)}")
    return block


_ONES = b"\0" + b"\1" * 255


_pack_count = Struct("<I").pack
_read_count = Struct("<I").unpack_from

# Strings that do not repeat must not fill the memory.
_MOST_TEXTS = 4096
_LONGEST_TEXT = 128
_LARGEST_LIST = 1 << 14


class Texts(dict[str, tuple[int, bytes]]):
    """Cache of the encoded forms (length, bytes) of strings that repeat: frames, names, keys.

    Long strings are not cached, and a full cache is emptied.

    Args:
        layout: The byte layout of the strings.
    """

    def __init__(self, layout: ByteLayout = CDR) -> None:
        super().__init__()
        self._layout = layout

    def __missing__(self, value: str) -> tuple[int, bytes]:
        octets = self._layout.encode(value)
        entry = len(octets), octets
        if len(octets) <= _LONGEST_TEXT:
            if len(self) >= _MOST_TEXTS:
                self.clear()
            self[value] = entry
        return entry


class StringList:
    """Codec of the lists of strings of one field, such as joint names, which hardly ever change.

    It keeps the last list that was written and the last one that was read, each with its bytes
    from the count on, so that the next equal one costs one comparison.

    Args:
        size: Number of elements of a fixed array, which has no count on the wire; -1 if variable.
        most: Largest number of elements of a bounded sequence; -1 for no bound.
        bound: Largest length of each string in bytes; -1 for no bound.
        layout: The byte layout.
    """

    __slots__ = ("_layout", "_longest", "_mask", "_most", "_size", "read", "written")

    def __init__(
        self, size: int = -1, most: int = -1, bound: int = -1, layout: ByteLayout = CDR
    ) -> None:
        self._size = size
        self._most = most
        self._longest = bound + layout.zeros if bound >= 0 else -1
        self._layout = layout
        self._mask = layout.limit(4) - 1
        empty = b"" if size >= 0 else bytes(4)
        self.written: tuple[list[str] | None, bytes] = ([], empty) if size < 0 else (None, b"")
        self.read: tuple[bytes, list[str]] = (bytes(4), []) if size < 0 else (b"\xff" * 8, [])

    def put(self, values: list[str]) -> bytes:
        """Return the bytes of a list that starts where a count is aligned."""
        if type(values) is not list:
            if isinstance(values, str | bytes):
                raise TypeError("a string is not a list of strings")
            values = list(values)
        self._check(len(values))
        parts = [] if self._size >= 0 else [_pack_count(len(values))]
        length = 0
        for value in values:
            octets = self._layout.encode(value)
            if len(octets) > self._longest >= 0:
                raise ValueError("a string is longer than its bound")
            parts.append(bytes(-length & self._mask) + _pack_count(len(octets)) + octets)
            length = len(octets)
        data = b"".join(parts)
        if len(data) <= _LARGEST_LIST:
            self.written = values[:], data
        return data

    def take(self, data: bytes, offset: int) -> tuple[list[str], int]:
        """Return the list at an offset where a count is aligned, and the offset after it."""
        start = offset
        count = self._size
        if count < 0:
            (count,) = _read_count(data, offset)
            offset += 4
            self._check(count)
        values: list[str] = []
        end = offset
        zeros = self._layout.zeros
        for _ in range(count):
            end = (end + self._mask) & ~self._mask
            (length,) = _read_count(data, end)
            if length > self._longest >= 0:
                raise ValueError("a string is longer than its bound")
            offset = end + 4
            end = offset + length
            values.append(data[offset : end - zeros].decode())
        if end > len(data):
            raise struct_error("a string ends after the bytes do")
        if end - start <= _LARGEST_LIST:
            self.read = data[start:end], values[:]
        return values, end

    def _check(self, count: int) -> None:
        if (self._size >= 0 and count != self._size) or count > self._most >= 0:
            raise ValueError(f"{count} strings are not what the type holds")


def pack_wide(value: Any) -> bytes:
    """Return a wide string as UTF-16 code units of four bytes each, without a terminator."""
    units = array("H", value.encode("utf-16-le"))
    return array("I", units.tolist()).tobytes()


def read_wide(octets: bytes) -> str:
    """Return the string in code units of four bytes each."""
    return array("H", array("I", octets).tolist()).tobytes().decode("utf-16-le")
