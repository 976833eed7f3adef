"""What a message class says about its fields, read once per class."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Literal, TypeAlias

import msgspec

__all__ = (
    "ARRAY_CODES",
    "OCTETS",
    "SCALAR_CODES",
    "Schema",
    "Slot",
    "rclpy_type",
    "slot_type",
    "slots",
)

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
        bound: Most bytes of a bounded string, 0 where there is no bound.
        shape: One value, a fixed array, a bounded or an unbounded sequence.
        size: Elements of a fixed array, most elements of a bounded sequence.
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


def slots(cls: Any) -> tuple[Slot, ...]:
    """Return the fields of a class in the order of the wire."""
    return _slots(cls)


@lru_cache(maxsize=4096)
def _slots(cls: Any) -> tuple[Slot, ...]:
    return tuple(_slot(*entry) for entry in cls._schema)


def _slot(name: str, kind: str | type[Any], suffix: str) -> Slot:
    bound = 0
    if isinstance(kind, str) and "<=" in kind:
        kind, _, limit = kind.partition("<=")
        bound = int(limit)
    inside = suffix[1:-1]
    if not suffix:
        return Slot(name, kind, bound, "one", 0)
    if not inside:
        return Slot(name, kind, bound, "sequence", 0)
    if inside.startswith("<="):
        return Slot(name, kind, bound, "bounded", int(inside[2:]))
    return Slot(name, kind, bound, "fixed", int(inside))


def slot_type(slot: Slot) -> str:
    """Spell the type of a field as ROS 1 does, such as ``geometry_msgs/Point[]`` or ``time``."""
    if isinstance(slot.kind, str):
        base = slot.kind + (f"<={slot.bound}" if slot.bound else "")
    else:
        base = _STAMPS.get(slot.kind._type, slot.kind._type)
    suffix = {"one": "", "fixed": f"[{slot.size}]", "bounded": f"[<={slot.size}]", "sequence": "[]"}
    return base + suffix[slot.shape]


def rclpy_type(slot: Slot) -> str:
    """Spell the type of a field as rclpy does, such as ``sequence<double>``."""
    if isinstance(slot.kind, str):
        base = _RCLPY.get(slot.kind, slot.kind) + (f"<{slot.bound}>" if slot.bound else "")
    else:
        base = slot.kind._type
    if slot.shape == "fixed":
        return f"{base}[{slot.size}]"
    if slot.shape == "bounded":
        return f"sequence<{base}, {slot.size}>"
    return f"sequence<{base}>" if slot.shape == "sequence" else base
