"""The slow codec, which follows a class's schema field by field.

Generated code falls back on it for values that are valid but unusual, for big-endian bytes, and for
an error that says what is wrong and where.
"""

from __future__ import annotations

import struct
import sys
from array import array
from typing import Any, NoReturn, TypeVar

from rosz.errors import DecodeError, EncodeError
from rosz.message.ros1_layout import ros1_fields
from rosz.message.schema import (
    ARRAY_CODES,
    INTEGER_RANGES,
    OCTETS,
    SCALAR_CODES,
    SCALAR_SIZES,
    Slot,
    slots,
)
from rosz.message.sequences import (
    TRUTH,
    flags,
    numbers,
    octets,
    pack_wide,
    put_text,
    read_wide,
)

__all__ = (
    "FAULTS",
    "decode_plainly",
    "decode_plainly_ros1",
    "encode_plainly",
    "encode_plainly_ros1",
    "shown",
)

_T = TypeVar("_T")

_HEADER = b"\0\1\0\0"
_ORDERS = {b"\0\0": ">", b"\0\1": "<"}
_BYTES = frozenset({"byte", "char"})
_FEW = 60

FAULTS = (
    struct.error,
    AttributeError,
    TypeError,
    ValueError,
    LookupError,
    ArithmeticError,
    BufferError,
)
"""Exceptions that wrong values and damaged bytes raise in generated code, and in this one."""


def encode_plainly(message: Any, cls: type[Any]) -> bytes:
    """Return a message as CDR, or raise an error that says what is wrong with it.

    Args:
        message: The message.
        cls: The message class whose schema it must fit.

    Raises:
        EncodeError: A value does not fit.
    """
    writer = _Writer(cls._type)
    writer.message(message, cls, "")
    return _HEADER + writer.data


def decode_plainly(data: bytes, cls: type[_T]) -> _T:
    """Return the message in CDR bytes of either byte order.

    Raises:
        DecodeError: The bytes are not a message of that class.
    """
    type_name: str = cls._type  # type: ignore[attr-defined]
    order = _ORDERS.get(data[:2])
    if len(data) < len(_HEADER):
        raise DecodeError(type_name, 0, f"expected a header of 4 bytes, got {len(data)}") from None
    if order is None:
        raise DecodeError(
            type_name, 0, f"expected encapsulation 0x0000 or 0x0001 (CDR), got 0x{data[:2].hex()}"
        ) from None
    message: _T = _Reader(type_name, data, order).message(cls, "")
    return message


def encode_plainly_ros1(message: Any, cls: type[Any]) -> bytes:
    """Return a message in ROS 1's layout, or raise an error that says what is wrong with it.

    Raises:
        EncodeError: A value does not fit.
    """
    writer = _Ros1Writer(cls._type)
    writer.message(message, cls, "")
    return bytes(writer.data)


def decode_plainly_ros1(data: bytes, cls: type[_T]) -> _T:
    """Return the message in the bytes of ROS 1's layout.

    Raises:
        DecodeError: The bytes are not a message of that class.
    """
    type_name: str = cls._type  # type: ignore[attr-defined]
    message: _T = _Ros1Reader(type_name, data).message(cls, "")
    return message


def shown(value: object) -> str:
    """Return the type and the beginning of a value, for errors."""
    text = repr(value)
    return f"{type(value).__name__} {text if len(text) <= _FEW else text[: _FEW - 1] + '…'}"


class _Writer:
    """The encoded bytes; alignment counts from the first byte after the header."""

    _fields = staticmethod(slots)
    _text_bytes = staticmethod(put_text)
    _zeros = 1  # behind a string

    def __init__(self, type_name: str) -> None:
        self._type = type_name
        self.data = bytearray()

    def _refuse(self, path: str, expected: str, value: object, why: str = "") -> NoReturn:
        reason = f"expected {expected}, got {shown(value)}{': ' + why if why else ''}"
        raise EncodeError(self._type, path, reason) from None

    def _put(self, code: str, *values: object) -> None:
        packed = struct.pack("<" + code, *values)
        self._align(len(packed))
        self.data += packed

    def _align(self, size: int) -> None:
        self.data += bytes(-len(self.data) % size)

    def message(self, value: Any, cls: Any, path: str) -> None:
        fields = self._fields(cls)
        for slot in fields:
            name = f"{path}.{slot.name}" if path else slot.name
            try:
                member = getattr(value, slot.name)
            except AttributeError:
                self._refuse(path, cls._type, value, f"it has no field '{slot.name}'")
            self._field(slot, member, name)
        if not fields:
            self._end_of_empty()

    def _end_of_empty(self) -> None:
        self.data += b"\0"

    def _field(self, slot: Slot, value: Any, path: str) -> None:
        if slot.shape == "one":
            self._one(slot, value, path)
        elif isinstance(slot.kind, str) and slot.kind in _BLOCKS:
            self._block(slot, value, path)
        else:
            self._list(slot, value, path)

    def _one(self, slot: Slot, value: Any, path: str) -> None:
        kind = slot.kind
        if not isinstance(kind, str):
            self.message(value, kind, path)
        elif kind in ("string", "wstring"):
            self._text(slot, value, path)
        else:
            try:
                self._put(SCALAR_CODES[kind], _number(kind, value))
            except FAULTS as error:
                self._refuse(path, kind, value, "" if isinstance(error, TypeError) else str(error))

    def _text(self, slot: Slot, value: Any, path: str) -> None:
        wide = slot.kind == "wstring"
        try:
            given = value.decode() if isinstance(value, bytes | bytearray) and not wide else value
            packed = pack_wide(given) if wide else self._text_bytes(given)
        except AttributeError:
            self._refuse(path, str(slot.kind), value)
        except ValueError as error:
            self._refuse(path, str(slot.kind), value, str(error))
        length = len(packed) // 4 if wide else len(packed)
        if slot.bound and length - (not wide) * self._zeros > slot.bound:
            units = "code units" if wide else "bytes of UTF-8"
            self._refuse(path, f"at most {slot.bound} {units}", value)
        self._put("I", length)
        self.data += packed

    def _count(self, slot: Slot, value: Any, count: int, path: str) -> None:
        if slot.shape == "fixed" and count != slot.size:
            self._refuse(path, f"{slot.size} elements", value, f"it has {count}")
        if slot.shape == "bounded" and count > slot.size:
            self._refuse(path, f"at most {slot.size} elements", value, f"it has {count}")
        if slot.counted:
            self._put("I", count)

    def _block(self, slot: Slot, value: Any, path: str) -> None:
        """Write a sequence of numbers as one block."""
        kind = str(slot.kind)
        try:
            if kind in ARRAY_CODES:
                count, block = numbers(value, ARRAY_CODES[kind])
            else:
                block = flags(value) if kind == "bool" else octets(value)
                count = len(block)
        except FAULTS as error:
            block = self._by_number(kind, value, path, error)
            count = len(block)
        self._count(slot, value, count, path)
        if count:
            self._align(SCALAR_SIZES[kind])
            self.data += block

    def _by_number(self, kind: str, value: Any, path: str, error: Exception) -> bytes:
        """Convert the numbers of a sequence one by one; the error names the wrong one."""
        if isinstance(value, str | bytes | bytearray | dict | set) or not hasattr(value, "__len__"):
            self._refuse(path, f"a sequence of {kind}", value)
        try:
            given = list(value)
        except (TypeError, NotImplementedError):  # numpy's array of no dimension, odd buffers
            self._refuse(path, f"a sequence of {kind}", value)
        packed = []
        for index, number in enumerate(given):
            try:
                packed.append(struct.pack("<" + SCALAR_CODES[kind], _number(kind, number)))
            except FAULTS as fault:
                why = "" if isinstance(fault, TypeError) else str(fault)
                self._refuse(f"{path}[{index}]", kind, number, why)
        if kind in ARRAY_CODES:
            self._refuse(path, f"a sequence of {kind}", value, str(error))
        return b"".join(packed)

    def _list(self, slot: Slot, value: Any, path: str) -> None:
        if isinstance(value, str | bytes | dict | set) or not hasattr(value, "__len__"):
            kind = slot.kind if isinstance(slot.kind, str) else slot.kind._type
            self._refuse(path, f"a sequence of {kind}", value)
        self._count(slot, value, len(value), path)
        for index, element in enumerate(value):
            self._one(slot, element, f"{path}[{index}]")


def _utf_8(value: Any) -> bytes:
    encoded: bytes = value.encode()
    return encoded


class _Ros1Writer(_Writer):
    """The encoded bytes in ROS 1's layout."""

    _fields = staticmethod(ros1_fields)
    _text_bytes = staticmethod(_utf_8)
    _zeros = 0

    def _align(self, size: int) -> None:
        """Add no padding, which ROS 1 does not have."""

    def _end_of_empty(self) -> None:
        """Add nothing: a message without fields has no bytes."""

    def _text(self, slot: Slot, value: Any, path: str) -> None:
        if slot.kind == "wstring":
            self._refuse(path, "a type that ROS 1 has, which has no wstring", value)
        super()._text(slot, value, path)


_BLOCKS = frozenset({*ARRAY_CODES, *OCTETS, "bool"})


def _number(kind: str, value: Any) -> Any:
    """Return a value as ``struct`` packs it for a type.

    Raises:
        TypeError: The value is of another kind.
        OverflowError: The value is outside the range of the type.
    """
    if kind == "bool" and value in TRUTH:
        return TRUTH[value]
    if kind in ("float32", "float64"):
        if isinstance(value, str | bytes | bytearray):
            raise TypeError(f"'{type(value).__name__}' is not a number")
        try:
            struct.pack("<" + SCALAR_CODES[kind], value)
        except OverflowError:
            raise OverflowError("it is outside the range of the type") from None
        return float(value)
    if kind in _BYTES and isinstance(value, bytes) and len(value) == 1:
        return value[0]
    if not hasattr(value, "__index__"):
        raise TypeError(f"'{type(value).__name__}' is not an integer")
    number = value.__index__()
    if kind == "bool":
        return bool(number)
    low, high = INTEGER_RANGES[kind]
    if not low <= number <= high:
        raise OverflowError(f"the range of the type is {low} to {high}")
    return number & 0xFF if kind == "byte" else number


class _Reader:
    """A position in the bytes; alignment counts from the first byte after the header."""

    _fields = staticmethod(slots)
    _zeros = 1  # behind a string

    def __init__(self, type_name: str, data: bytes, order: str, at: int = len(_HEADER)) -> None:
        self._type = type_name
        self._data = data
        self._order = order
        self._at = at

    def _refuse(self, path: str, reason: str) -> NoReturn:
        text = f"{path}: {reason}" if path else reason
        raise DecodeError(self._type, self._at, text) from None

    def _take(self, size: int, path: str, what: str, alignment: int = 1) -> bytes:
        start = self._at + self._padding(alignment)
        left = len(self._data) - start
        if size > left:
            self._at = min(start, len(self._data))
            self._refuse(path, f"expected {what} ({size} bytes), {max(left, 0)} left")
        self._at = start + size
        return self._data[start : self._at]

    def _padding(self, alignment: int) -> int:
        return (len(_HEADER) - self._at) % alignment

    def _scalar(self, kind: str, path: str) -> Any:
        size = SCALAR_SIZES[kind]
        packed = self._take(size, path, kind, size)
        return struct.unpack(self._order + SCALAR_CODES[kind], packed)[0]

    def message(self, cls: Any, path: str) -> Any:
        fields = self._fields(cls)
        if not fields:
            self._take_empty(path)
        prefix = f"{path}." if path else ""
        return cls(**{slot.name: self._field(slot, prefix + slot.name) for slot in fields})

    def _take_empty(self, path: str) -> None:
        self._take(1, path, "an empty message")

    def _field(self, slot: Slot, path: str) -> Any:
        if slot.shape == "one":
            return self._one(slot, path)
        count = slot.size
        if slot.counted:
            count = self._scalar("uint32", path)
            if slot.shape == "bounded" and count > slot.size:
                self._refuse(path, f"expected at most {slot.size} elements, got {count}")
        if isinstance(slot.kind, str) and slot.kind in SCALAR_SIZES:
            return self._block(slot.kind, count, path)
        left = len(self._data) - self._at
        if count > left:
            self._refuse(path, f"expected {count} elements, {left} bytes left")
        return [self._one(slot, f"{path}[{index}]") for index in range(count)]

    def _one(self, slot: Slot, path: str) -> Any:
        kind = slot.kind
        if not isinstance(kind, str):
            return self.message(kind, path)
        if kind in ("string", "wstring"):
            return self._text(slot, path)
        return self._scalar(kind, path)

    def _text(self, slot: Slot, path: str) -> str:
        wide = slot.kind == "wstring"
        length = self._scalar("uint32", path)
        packed = self._take(length * 4 if wide else length, path, f"a {slot.kind}")
        content = length if wide else max(length - self._zeros, 0)
        if slot.bound and content > slot.bound:
            self._refuse(path, f"expected at most {slot.bound} units, got {content}")
        try:
            if not wide:
                return self._text_of(packed)
            return read_wide(self._swapped("I", packed).tobytes())
        except (UnicodeDecodeError, OverflowError) as error:
            self._refuse(path, f"not a valid {slot.kind}: {error}")

    def _text_of(self, packed: bytes) -> str:
        return packed[:-1].decode()

    def _block(self, kind: str, count: int, path: str) -> Any:
        if not count:
            packed = b""
        else:
            size = SCALAR_SIZES[kind]
            packed = self._take(count * size, path, f"{count} elements of {kind}", size)
        if kind in OCTETS:
            return packed
        if kind == "bool":
            return [octet != 0 for octet in packed]
        return self._swapped(ARRAY_CODES[kind], packed)

    def _swapped(self, code: str, packed: bytes) -> array[Any]:
        block = array(code, packed)
        if (self._order == ">") != (sys.byteorder == "big"):
            block.byteswap()
        return block


class _Ros1Reader(_Reader):
    """A position in the bytes of ROS 1's layout."""

    _fields = staticmethod(ros1_fields)
    _zeros = 0

    def __init__(self, type_name: str, data: bytes) -> None:
        super().__init__(type_name, data, "<", 0)

    def _padding(self, _alignment: int) -> int:
        return 0

    def _take_empty(self, path: str) -> None:
        """Take nothing: a message without fields has no bytes."""

    def _text(self, slot: Slot, path: str) -> str:
        if slot.kind == "wstring":
            self._refuse(path, "ROS 1 has no wstring")
        return super()._text(slot, path)

    def _text_of(self, packed: bytes) -> str:
        # roscpp sends any bytes as a string, and genpy replaces those that are not UTF-8.
        return packed.decode(errors="replace")
