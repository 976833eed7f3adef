"""Numeric sequences of received messages as ROS 1 code knows them: tuples.

`tuple_decoder` and `ros1_tuple_decoder` return generated decoders that make tuples where the native
ones make arrays. A tuple needs an object for each number, so a long sequence becomes a `LongTuple`:
an array that behaves as a tuple. A ``byte`` is a signed number, as in ROS 1.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterator
from functools import cache, partial
from struct import Struct, calcsize
from types import FunctionType
from typing import TYPE_CHECKING, Any

from rosz.message.schema import ARRAY_CODES, Slot, slots

LONGEST_TUPLE = 4096
"""Largest number of elements of a tuple, which takes 50 µs to make; more become a `LongTuple`."""

_MOST_SHAPES = 1024

if TYPE_CHECKING:
    _Array = array[Any]
else:  # Python 3.11's array takes no type argument
    _Array = array


class LongTuple(_Array):
    """An array that compares, adds, hashes and prints as the tuple of its elements.

    It is a buffer, so numpy reads it without a copy. ``isinstance(value, tuple)`` is true, and
    ``json`` writes it as a list.
    """

    __slots__ = ()
    __class__: Any = property(lambda _: tuple)

    def __eq__(self, other: object) -> bool:
        if isinstance(other, array):
            return array.__eq__(self, other)
        return tuple(self) == other if type(other) is tuple else NotImplemented

    def __ne__(self, other: object) -> bool:
        equal = self.__eq__(other)
        return equal if equal is NotImplemented else not equal

    def __lt__(self, other: Any) -> bool:
        return tuple(self) < tuple(other)

    def __le__(self, other: Any) -> bool:
        return tuple(self) <= tuple(other)

    def __gt__(self, other: Any) -> bool:
        return tuple(self) > tuple(other)

    def __ge__(self, other: Any) -> bool:
        return tuple(self) >= tuple(other)

    def __copy__(self) -> LongTuple:
        return self

    def __deepcopy__(self, memo: object) -> LongTuple:
        return self

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(tuple(self))

    def __repr__(self) -> str:
        return repr(tuple(self))

    def __getitem__(self, index: Any) -> Any:
        value = array.__getitem__(self, index)
        return tuple(value) if isinstance(index, slice) else value

    def __add__(self, other: Any) -> Any:
        return tuple(self) + _plain(other)

    def __radd__(self, other: Any) -> Any:
        return other + tuple(self)

    def __iadd__(self, other: Any) -> Any:
        return tuple(self) + _plain(other)

    def __mul__(self, times: Any) -> Any:
        return tuple(self) * times

    def __rmul__(self, times: Any) -> Any:
        return tuple(self) * times

    def __imul__(self, times: Any) -> Any:
        return tuple(self) * times

    def __setitem__(self, index: Any, value: Any) -> None:
        raise TypeError("'tuple' object does not support item assignment")

    def __delitem__(self, index: Any) -> None:
        raise TypeError("'tuple' object doesn't support item deletion")


def _plain(other: Any) -> Any:
    return tuple(other) if isinstance(other, LongTuple) else other


def _long(code: str, block: Any) -> LongTuple:
    _teach_json()
    numbers = LongTuple(code)
    numbers.frombytes(block)
    return numbers


@cache
def _teach_json() -> None:
    """Let ``json`` write a `LongTuple`: its encoder in C knows tuples by their memory alone."""
    from json import JSONEncoder

    refuse = JSONEncoder.default

    def default(self: JSONEncoder, o: Any) -> Any:
        return o.tolist() if type(o) is LongTuple else refuse(self, o)

    JSONEncoder.default = default  # type: ignore[method-assign]


class _Makers(dict[tuple[str, int], Callable[[Any], Any]]):
    """Functions that make tuples, by the type code and the number of bytes."""

    def __missing__(self, key: tuple[str, int]) -> Callable[[Any], Any]:
        code, size = key
        count = size // calcsize(f"<{code}")
        if count > LONGEST_TUPLE:
            return partial(_long, code)
        if len(self) >= _MOST_SHAPES:
            self.clear()
        self[key] = unpack = Struct(f"<{count}{code}").unpack
        return unpack


_makers = _Makers()


def _make(code: str, block: Any) -> Any:
    return _makers[code, len(block)](block)


def _make_of(code: str, data: bytes, start: int, end: int) -> Any:
    return _make(code, memoryview(data)[start:end])


_INSTEAD = {"_array": _make, "_read_block": _make_of}
"""The functions that stand in generated decoders, by the names that these have for them."""


@cache
def tuple_decoder(message_type: type[Any]) -> Callable[[bytes], Any]:
    """Return the decoder of CDR of a message class that makes tuples."""
    return _with_signs(message_type, _with_tuples(message_type._decode))


@cache
def ros1_tuple_decoder(message_type: type[Any]) -> Callable[[bytes], Any]:
    """Return the decoder of ROS 1's byte layout of a message class that makes tuples."""
    decode = _with_tuples(message_type._decode_ros1)  # noqa: SLF001  # rosz's
    return _with_signs(message_type, decode)


def _with_tuples(decode: Callable[[bytes], Any]) -> Callable[[bytes], Any]:
    """Return a generated decoder with other functions in its global names."""
    code = getattr(decode, "__code__", None)
    if code is None or _INSTEAD.keys().isdisjoint(code.co_names):
        return decode
    names: dict[str, Any] = decode.__globals__
    explain = names["_explain"]

    def decode_plainly(*args: Any) -> Any:
        message = explain(*args)
        _convert(message)
        return message

    instead = {**names, **_INSTEAD, "_explain": decode_plainly}
    return FunctionType(code, instead, decode.__name__)


def _with_signs(cls: Any, decode: Callable[[bytes], Any]) -> Callable[[bytes], Any]:
    """Return a decoder that also gives the bytes of a message their signs."""
    sign = _signer(cls)
    if sign is None:
        return decode

    def decode_signed(data: bytes) -> Any:
        message = decode(data)
        sign(message)
        return message

    return decode_signed


@cache
def _signer(cls: Any) -> Callable[[Any], None] | None:
    """Return a function that sets each ``byte`` of a message to its signed number, as in ROS 1.

    None for a class that has none.
    """
    changes = [(slot.name, change) for slot in slots(cls) if (change := _signed(slot)) is not None]
    if not changes:
        return None

    def sign(message: Any) -> None:
        for name, change in changes:
            setattr(message, name, change(getattr(message, name)))

    return sign


def _signed(slot: Slot) -> Callable[[Any], Any] | None:
    """Return a function that makes the signed value of a field; None if it has no ``byte``."""
    if slot.kind == "byte":
        return _sign_byte if slot.shape == "one" else partial(_make, "b")
    kind: Any = slot.kind
    sign = None if isinstance(kind, str) else _signer(kind)
    if sign is None:
        return None

    def change(value: Any) -> Any:
        for message in _messages(value):
            sign(message)
        return value

    return change


def _sign_byte(value: int) -> int:
    return value - 0x100 if value > 0x7F else value  # noqa: PLR2004  # the largest int8


def _convert(message: Any) -> None:
    """Convert the numeric sequences of a message from arrays, in place."""
    for slot in slots(type(message)):
        value = getattr(message, slot.name)
        for below in _messages(value):
            _convert(below)
        if slot.shape != "one" and slot.kind in ARRAY_CODES and isinstance(value, array):
            setattr(message, slot.name, _make(value.typecode, value.tobytes()))


def _messages(value: Any) -> Iterator[Any]:
    for element in value if isinstance(value, list) else [value]:
        if hasattr(element, "_schema"):
            yield element
