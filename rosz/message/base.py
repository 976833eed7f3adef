"""What every message and service class is built on.

A generated class holds only what differs from type to type: fields, constants, names, hashes, its
definition, and its codec as straight-line code. The rest is derived here from the class's schema,
when it is asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import (
    Any,
    ClassVar,
    Generic,
    Protocol,
    Self,
    SupportsIndex,
    TypeAlias,
    TypeVar,
    overload,
)

import msgspec

from rosz.message.schema import Schema, rclpy_type, slot_type, slots

__all__ = ("Array", "Bytes", "Message", "Sequenced", "Service", "Writable")

_T = TypeVar("_T")

_RULE = "=" * 80


class Array(Protocol[_T]):
    """What a numeric sequence may be: a list, an ``array.array``, a numpy array."""

    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[_T]: ...
    @overload
    def __getitem__(self, index: SupportsIndex, /) -> _T: ...
    @overload
    def __getitem__(self, index: slice, /) -> Array[_T]: ...
    def __setitem__(self, index: SupportsIndex, value: _T, /) -> None: ...


Bytes: TypeAlias = bytes | bytearray | memoryview | Array[int]
"""What a sequence of octets may be; decoding gives ``bytes``."""


class Writable(Protocol):
    """What :meth:`Message.serialize` writes to."""

    def write(self, data: bytes, /) -> object:
        """Take bytes."""


class _Derived(Generic[_T]):
    """An attribute of a class that is computed from it at each access."""

    def __init__(self, compute: Callable[[type[Any]], _T]) -> None:
        self._compute = compute

    def __get__(self, instance: object, owner: type[Any]) -> _T:
        return self._compute(owner)


def _slot_types(cls: type[Message]) -> list[str]:
    types = [slot_type(slot) for slot in slots(cls)]
    return ["uint32", *types] if issubclass(cls, Sequenced) else types


def _has_header(cls: type[Message]) -> bool:
    first = cls._schema[:1]
    if not first or first[0][0] != "header" or not isinstance(first[0][1], type):
        return False
    return issubclass(first[0][1], Sequenced)


def _full_text(cls: type[Message | Service]) -> str:
    parts = [cls._text]
    parts += (f"{_RULE}\nMSG: {below._type}\n{below._text}" for below in _below(cls))
    return "\n".join(parts)


def _below(cls: type[Message | Service]) -> list[type[Message]]:
    """List the message types that a definition needs, each once, as genmsg orders them."""
    tops = (cls.Request, cls.Response) if issubclass(cls, Service) else (cls,)
    found: dict[type[Message], None] = {}
    rest = [kind for top in tops for _, kind, _ in top._schema if isinstance(kind, type)]
    while rest:
        kind = rest.pop(0)
        if kind not in found:
            found[kind] = None
            rest[:0] = [below for _, below, _ in kind._schema if isinstance(below, type)]
    return list(found)


class Message(msgspec.Struct, gc=False):
    """Base of all message classes.

    Construction takes fields by position or name; missing ones have their defaults. Instances
    compare by value, copy and pickle.

    Attributes:
        _type: ROS 1 name, ``geometry_msgs/Twist``.
        _type_name: ROS 2 name, ``geometry_msgs/msg/Twist``.
        _type_hash: RIHS01 hash, part of the key that the type is published under.
        _md5sum: Hash that ROS 1 identifies the definition by.
        _text: The definition.
        _full_text: The definition, followed by those of all types in it, as ROS 1 bags hold it.
        _slot_types: ROS 1 types of the fields, in the order of ``__slots__``.
        _has_header: Whether the first field is a ``std_msgs/Header`` called header.
    """

    _type: ClassVar[str] = ""
    _type_name: ClassVar[str] = ""
    _type_hash: ClassVar[str] = ""
    _md5sum: ClassVar[str] = ""
    _text: ClassVar[str] = ""
    _schema: ClassVar[Schema] = ()
    _full_text = _Derived(_full_text)
    _slot_types = _Derived(_slot_types)
    _has_header = _Derived(_has_header)
    __slots__: ClassVar[tuple[str, ...]]  # fields in the order of the definition

    def __init_subclass__(cls, **_options: object) -> None:
        cls.__slots__ = tuple(name for name, _, _ in cls._schema)

    @staticmethod
    def _encode(m: Any) -> bytes:
        """Return the message as CDR with its header; the generated fast path."""
        raise NotImplementedError(type(m).__name__)

    @staticmethod
    def _decode(data: bytes) -> Any:
        """Return the message in these bytes; the generated fast path."""
        raise NotImplementedError(f"{len(data)} bytes")

    def to_cdr(self) -> bytes:
        """Return the message as XCDR1 little-endian bytes, with the 4-byte header.

        Raises:
            EncodeError: A value does not fit its field; it names type, field, value and reason.
        """
        return self._encode(self)

    @classmethod
    def from_cdr(cls, data: bytes | bytearray | memoryview) -> Self:
        """Return the message in CDR bytes of either byte order.

        Raises:
            DecodeError: The bytes are no message of this type; it tells where and why.
        """
        message: Self = cls._decode(data if type(data) is bytes else bytes(data))
        return message

    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]:
        """Return names and types of the fields, spelled as rclpy does."""
        return {slot.name: rclpy_type(slot) for slot in slots(cls)}

    def serialize(self, buff: Writable) -> None:
        """Write the CDR bytes into a file-like object (genpy's spelling of :meth:`to_cdr`).

        Raises:
            EncodeError: A value does not fit its field.
        """
        buff.write(self._encode(self))

    def deserialize(self, data: bytes) -> Self:
        """Fill this message from CDR bytes and return it (genpy's spelling).

        Raises:
            DecodeError: The bytes are no message of this type.
        """
        other = self.from_cdr(data)
        for name in self.__struct_fields__:
            setattr(self, name, getattr(other, name))
        return self

    def _get_types(self) -> list[str]:
        return self._slot_types

    def __str__(self) -> str:
        from rosz.message.text import strify_message

        return strify_message(self)


class Sequenced(Message):
    """A header with ROS 1's sequence number.

    The number is not on the wire; a receiver fills it from what every sample carries. Two headers
    are equal when all but this number is. As in ROS 1 it comes first: ``Header(0, stamp, "map")``.
    """

    seq: int = 0

    def __init_subclass__(cls, **options: object) -> None:
        super().__init_subclass__(**options)
        cls.__slots__ = ("seq", *cls.__slots__)

    __hash__ = None  # type: ignore[assignment]

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(getattr(self, n) == getattr(other, n) for n, _, _ in self._schema)


class Service:
    """Base of all service classes; never instantiated.

    Attributes:
        Request: Class of requests (also ``_request_class``).
        Response: Class of responses (also ``_response_class``).
    """

    Request: ClassVar[type[Message]]
    Response: ClassVar[type[Message]]
    _type: ClassVar[str] = ""
    _type_name: ClassVar[str] = ""
    _type_hash: ClassVar[str] = ""
    _md5sum: ClassVar[str] = ""
    _text: ClassVar[str] = ""
    _full_text = _Derived(_full_text)
    _request_class = _Derived(lambda cls: cls.Request)
    _response_class = _Derived(lambda cls: cls.Response)
