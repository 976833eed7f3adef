"""The two byte layouts of messages: CDR, and that of ROS 1.

Both have the same fields one behind the other, in little-endian order. CDR aligns numbers and ends
strings with a zero. The layout of ROS 1 is that of its definitions (ROS wiki, "msg", and genpy's
generated code): a ``time`` is two uint32 and a ``duration`` two int32, a header has its sequence
number, and fields that ROS 2 has added to a type are absent.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any, Literal

import msgspec

from rosz.message.schema import SEQ, Slot, slots

_ADDED_BY_ROS2: dict[str, set[str]] = {
    "sensor_msgs/Range": {"variance"},
    "shape_msgs/SolidPrimitive": {"polygon"},
    "visualization_msgs/Marker": {"texture_resource", "texture", "uv_coordinates", "mesh_file"},
}
"""Fields that are not in ROS 1's definition of a type. Decoding leaves them at their defaults."""

_STAMPS = {"builtin_interfaces/Time": "uint32", "builtin_interfaces/Duration": "int32"}
"""The type of both numbers of ROS 1's built-in ``time`` and ``duration``."""


def ros1_fields(cls: Any) -> tuple[Slot, ...]:
    """Return the fields of a message class in the order of ROS 1's layout."""
    return _ros1_fields(cls)


@lru_cache(maxsize=4096)
def _ros1_fields(cls: Any) -> tuple[Slot, ...]:
    kind = _STAMPS.get(cls._type)
    if kind is not None:
        return tuple(Slot(slot.name, kind, 0, "one", 0) for slot in slots(cls))
    absent = _ADDED_BY_ROS2.get(cls._type, set())
    fields = tuple(slot for slot in slots(cls) if slot.name not in absent)
    return (SEQ, *fields) if cls._sequenced else fields


class ByteLayout(msgspec.Struct, frozen=True):
    """The layout of messages in bytes.

    Attributes:
        header: The bytes before a message.
        alignment: Largest alignment. Numbers are aligned to their size, at most to this, counted
            from the first byte behind the header.
        zeros: Number of zeros behind a string, which its length counts.
        empty: Size of a message without fields.
        errors: How bytes of a string that are not UTF-8 are read.
        fields: Function that returns the fields of a message class.
    """

    header: bytes
    alignment: int
    zeros: int
    empty: int
    errors: Literal["strict", "replace"]
    fields: Callable[[Any], tuple[Slot, ...]]

    def limit(self, alignment: int) -> int:
        """Return the alignment that numbers of a size have."""
        return min(alignment, self.alignment)

    def encode(self, text: Any) -> bytes:
        """Return the UTF-8 bytes of a string, with the zeros behind it.

        Raises:
            ValueError: The string has U+0000, which ends a string in CDR, or half a surrogate pair.
            AttributeError: The value is not a string.
        """
        octets: bytes = text.encode()
        if self.zeros and 0 in octets:
            at = text.index("\0")
            raise ValueError(
                f"the character at index {at} is NUL, which ends a string on the wire; "
                "send bytes in a field of type uint8[]"
            )
        return octets + bytes(self.zeros)


CDR = ByteLayout(b"\0\1\0\0", alignment=8, zeros=1, empty=1, errors="strict", fields=slots)
"""XCDR1, little-endian, with the header that says so."""

# roscpp sends any bytes as a string, and genpy replaces those that are not UTF-8.
ROS1 = ByteLayout(b"", alignment=1, zeros=0, empty=0, errors="replace", fields=ros1_fields)
