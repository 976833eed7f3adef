"""The slow codec, which follows a class's schema field by field.

Generated code falls back on it for values that are valid but unusual, for big-endian bytes, and for
an error that names the wrong value and its place.
"""

from __future__ import annotations

import struct
import sys
from array import array
from typing import Any, NoReturn, TypeVar

from rosz.errors import DecodeError, EncodeError
from rosz.message.layout import CDR, ROS1, ByteLayout
from rosz.message.schema import (
    ARRAY_CODES,
    INTEGER_RANGES,
    OCTETS,
    SCALAR_CODES,
    SCALAR_SIZES,
    Slot,
)
from rosz.message.sequences import TRUTH, flags, numbers, octets, pack_wide, read_wide

_T = TypeVar("_T")

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


def encode_plainly(message: Any, cls: type[Any], layout: ByteLayout = CDR) -> bytes:
    """Return the bytes of a message, or raise an error that names the wrong value.

    Args:
        message: The message.
        cls: The message class whose schema it must fit.
        layout: The byte layout.

    Raises:
        EncodeError: A value does not fit.
    """
    writer = _PlainWriter(cls._type, layout)
    writer.message(message, cls, "")
    return layout.header + writer.data


def decode_plainly(data: bytes, cls: type[_T], layout: ByteLayout = CDR) -> _T:
    """Return the message in bytes; those of CDR may be of either byte order.

    Raises:
        DecodeError: The bytes are not a message of that class.
    """
    type_name: str = cls._type  # type: ignore[attr-defined]
    size = len(layout.header)
    order = _ORDERS.get(data[:2]) if size else "<"
    if len(data) < size:
        raise DecodeError(
            type_name, 0, f"expected a header of {size} bytes, got {len(data)}"
        ) from None
    if order is None:
        raise DecodeError(
            type_name, 0, f"expected encapsulation 0x0000 or 0x0001 (CDR), got 0x{data[:2].hex()}"
        ) from None
    message: _T = _PlainReader(type_name, data, order, layout).message(cls, "")
    return message


def shown(value: object) -> str:
    """Return the type and the beginning of a value, for errors."""
    text = repr(value)
    return f"{type(value).__name__} {text if len(text) <= _FEW else text[: _FEW - 1] + '…'}"


class _PlainWriter:
    """The encoded bytes; alignment counts from the first byte after the header."""

    def __init__(self, type_name: str, layout: ByteLayout) -> None:
        self._type = type_name
        self._layout = layout
        self.data = bytearray()

    def _refuse(self, path: str, expected: str, value: object, why: str = "") -> NoReturn:
        reason = f"expected {expected}, got {shown(value)}{': ' + why if why else ''}"
        raise EncodeError(self._type, path, reason) from None

    def _put(self, code: str, *values: object) -> None:
        packed = struct.pack("<" + code, *values)
        self._align(len(packed))
        self.data += packed

    def _align(self, size: int) -> None:
        self.data += bytes(-len(self.data) % self._layout.limit(size))

    def message(self, value: Any, cls: Any, path: str) -> None:
        fields = self._layout.fields(cls)
        for slot in fields:
            name = f"{path}.{slot.name}" if path else slot.name
            try:
                member = getattr(value, slot.name)
            except AttributeError:
                self._refuse(path, cls._type, value, f"it has no field '{slot.name}'")
            self._field(slot, member, name)
        if not fields:
            self.data += bytes(self._layout.empty)

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
        if wide and self._layout is ROS1:
            self._refuse(path, "a type that ROS 1 has, which has no wstring", value)
        try:
            given = value.decode() if isinstance(value, bytes | bytearray) and not wide else value
            packed = pack_wide(given) if wide else self._layout.encode(given)
        except AttributeError:
            self._refuse(path, str(slot.kind), value)
        except ValueError as error:
            self._refuse(path, str(slot.kind), value, str(error))
        length = len(packed) // 4 if wide else len(packed)
        if slot.bound and length - (not wide) * self._layout.zeros > slot.bound:
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


_BLOCKS = frozenset({*ARRAY_CODES, *OCTETS, "bool"})


def _number(kind: str, value: Any) -> Any:
    """Return a value as ``struct`` packs it for a type."""
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


class _PlainReader:
    """A position in the bytes; alignment counts from the first byte after the header."""

    def __init__(self, type_name: str, data: bytes, order: str, layout: ByteLayout) -> None:
        self._type = type_name
        self._data = data
        self._order = order
        self._layout = layout
        self._at = len(layout.header)

    def _refuse(self, path: str, reason: str) -> NoReturn:
        text = f"{path}: {reason}" if path else reason
        raise DecodeError(self._type, self._at, text) from None

    def _take(self, size: int, path: str, what: str, alignment: int = 1) -> bytes:
        start = self._at + (len(self._layout.header) - self._at) % self._layout.limit(alignment)
        left = len(self._data) - start
        if size > left:
            self._at = min(start, len(self._data))
            self._refuse(path, f"expected {what} ({size} bytes), {max(left, 0)} left")
        self._at = start + size
        return self._data[start : self._at]

    def _scalar(self, kind: str, path: str) -> Any:
        size = SCALAR_SIZES[kind]
        packed = self._take(size, path, kind, size)
        return struct.unpack(self._order + SCALAR_CODES[kind], packed)[0]

    def message(self, cls: Any, path: str) -> Any:
        fields = self._layout.fields(cls)
        if not fields and self._layout.empty:
            self._take(self._layout.empty, path, "an empty message")
        prefix = f"{path}." if path else ""
        return cls(**{slot.name: self._field(slot, prefix + slot.name) for slot in fields})

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
        if wide and self._layout is ROS1:
            self._refuse(path, "ROS 1 has no wstring")
        length = self._scalar("uint32", path)
        packed = self._take(length * 4 if wide else length, path, f"a {slot.kind}")
        content = length if wide else max(length - self._layout.zeros, 0)
        if slot.bound and content > slot.bound:
            self._refuse(path, f"expected at most {slot.bound} units, got {content}")
        try:
            if not wide:
                bare = packed[: len(packed) - self._layout.zeros]
                return bare.decode(errors=self._layout.errors)
            return read_wide(self._swapped("I", packed).tobytes())
        except (UnicodeDecodeError, OverflowError) as error:
            self._refuse(path, f"not a valid {slot.kind}: {error}")

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
