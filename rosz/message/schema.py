"""The schema by which a message class describes its fields, and the primitive types."""

from __future__ import annotations

from functools import lru_cache
from struct import calcsize
from typing import Any, Literal, TypeAlias

import msgspec

Schema: TypeAlias = tuple[tuple[str, "str | type[Any]", str], ...]
"""Fields as (attribute, type, array suffix): a primitive such as ``string<=8`` or a message class,
and ``""``, ``"[]"``, ``"[36]"`` or ``"[<=3]"``."""

SCALAR_CODES = {
    "bool": "?",
    "byte": "B",
    "char": "B",
    "int8": "b",
    "uint8": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "float32": "f",
    "float64": "d",
}
"""Codes of the ``struct`` module for the primitive types of fixed size."""

SCALAR_SIZES = {name: calcsize(f"<{code}") for name, code in SCALAR_CODES.items()}
"""Sizes of these types in bytes, which are their alignments too."""

INTEGER_RANGES = {
    **{f"int{n}": (-(1 << (n - 1)), (1 << (n - 1)) - 1) for n in (8, 16, 32, 64)},
    **{f"uint{n}": (0, (1 << n) - 1) for n in (8, 16, 32, 64)},
    "byte": (-0x80, 0xFF),  # an int8 in ROS 1, a uint8 in ROS 2
    "char": (0, 0xFF),
}
"""Smallest and largest values of the integer types."""

OCTETS = frozenset({"byte", "char", "uint8"})
"""Types whose sequences are ``bytes``."""

ARRAY_CODES = {
    name: code for name, code in SCALAR_CODES.items() if name not in OCTETS and name != "bool"
}
"""Type codes of the ``array`` module for types whose sequences are arrays."""

_RCLPY = {
    "bool": "boolean",
    "byte": "octet",
    "char": "uint8",
    "float32": "float",
    "float64": "double",
}
_STAMPS = {"builtin_interfaces/Time": "time", "builtin_interfaces/Duration": "duration"}


class Slot(msgspec.Struct, frozen=True):
    """One field.

    Attributes:
        name: Attribute of the class.
        kind: Message class, or name of a primitive type.
        bound: Largest length of a bounded string in bytes; 0 for no bound.
        shape: One value, a fixed array, a bounded or an unbounded sequence.
        size: Number of elements of a fixed array; largest number of a bounded sequence.
    """

    name: str
    kind: type[Any] | str
    bound: int
    shape: Literal["one", "fixed", "bounded", "sequence"]
    size: int

    @property
    def counted(self) -> bool:
        """Whether the number of elements is on the wire."""
        return self.shape in ("bounded", "sequence")


SEQ = Slot("seq", "uint32", 0, "one", 0)
"""The sequence number of a header, which is not in its schema."""


def slots(cls: Any) -> tuple[Slot, ...]:
    """Return the fields of a message class in the order of the wire."""
    return _slots(cls)


@lru_cache(maxsize=4096)
def _slots(cls: Any) -> tuple[Slot, ...]:
    return tuple(_slot(*entry) for entry in cls._schema)


def _slot(name: str, kind: str | type[Any], suffix: str) -> Slot:
    bound = 0
    if isinstance(kind, str) and "<=" in kind:
        kind, _, limit = kind.partition("<=")
        bound = int(limit)
    if suffix in ("", "[]"):
        return Slot(name, kind, bound, "sequence" if suffix else "one", 0)
    size = int(suffix.strip("[<=]"))
    return Slot(name, kind, bound, "bounded" if "<" in suffix else "fixed", size)


def slot_type(slot: Slot) -> str:
    """Return the type of a field as ROS 1 spells it, such as ``geometry_msgs/Point[]``."""
    if isinstance(slot.kind, str):
        base = slot.kind + (f"<={slot.bound}" if slot.bound else "")
    else:
        base = _STAMPS.get(slot.kind._type, slot.kind._type)
    suffix = {"one": "", "fixed": f"[{slot.size}]", "bounded": f"[<={slot.size}]", "sequence": "[]"}
    return base + suffix[slot.shape]


def rclpy_type(slot: Slot) -> str:
    """Return the type of a field as rclpy spells it, such as ``sequence<double>``."""
    if isinstance(slot.kind, str):
        base = _RCLPY.get(slot.kind, slot.kind) + (f"<{slot.bound}>" if slot.bound else "")
    else:
        base = slot.kind._type
    if slot.shape == "fixed":
        return f"{base}[{slot.size}]"
    if slot.shape == "bounded":
        return f"sequence<{base}, {slot.size}>"
    return f"sequence<{base}>" if slot.shape == "sequence" else base
