"""Messages as plain values for JSON and CBOR, in the spelling of ROS 1 or of ROS 2.

The function that converts messages of a class is compiled from the schema at first use. ROS 1's
spelling has the sequence number of headers, ``secs`` and ``nsecs`` in times, and ROS 1's names of
fields.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any, Literal, TypeAlias

from rosz.message import ARRAY_CODES, OCTETS, Slot, numbers, ros1_fields, shown_name, slots

Spelling: TypeAlias = Literal["ros1", "ros2"]
Plain: TypeAlias = dict[str, Any]

_BINARY = OCTETS - {"byte"}
"""Types whose sequences are binary data; those of ``byte`` are lists of numbers in JSON."""
_TAGS = {"H": 69, "I": 70, "Q": 71, "b": 72, "h": 77, "i": 78, "q": 79, "f": 85, "d": 86}
"""CBOR tags of little-endian arrays (RFC 8746, table 1), by the code of their elements."""


def converter(
    cls: Any, spelling: Spelling, tag: Callable[[int, bytes], Any] | None = None
) -> Callable[[Any], Plain]:
    """Return the function that converts messages of a class.

    Args:
        cls: Class of the messages.
        spelling: Whose names the fields have.
        tag: Function that makes a tagged value for CBOR; without one, numeric sequences are lists.
    """
    made: Callable[[Any], Plain] = _compiled(cls, spelling, tag)
    return made


@lru_cache(maxsize=1024)
def _compiled(
    cls: Any, spelling: Spelling, tag: Callable[[int, bytes], Any] | None
) -> Callable[[Any], Plain]:
    space: dict[str, Any] = {"items": _items, "octets": bytes, "packed": _packed, "tag": tag}
    source = f"def code(m):\n    return {_message(cls, 'm', spelling, tag, space)}"
    exec(source, space)  # noqa: S102  # the text is made of names of fields
    made: Callable[[Any], Plain] = space["code"]
    return made


def shown_fields(cls: Any, spelling: Spelling) -> list[tuple[str, Slot]]:
    """Return the fields of a class, each behind the name that it has in a spelling."""
    if spelling == "ros2":
        return [(shown_name(slot.name), slot) for slot in slots(cls)]
    names = {new: old for old, new in cls._ros1_names.items()}
    return [(names.get(slot.name, shown_name(slot.name)), slot) for slot in ros1_fields(cls)]


def _message(cls: Any, owner: str, spelling: Spelling, tag: Any, space: Any) -> str:
    """Return an expression for a message."""
    entries = []
    for name, slot in shown_fields(cls, spelling):
        value = _value(slot, f"{owner}.{slot.name}", spelling, tag, space)
        entries.append(f"{name!r}: {value}")
    return f"{{{', '.join(entries)}}}"


def _value(slot: Slot, value: str, spelling: Spelling, tag: Any, space: Any) -> str:
    kind: Any = slot.kind
    if not isinstance(kind, str):
        return _nested(slot, value, spelling, tag, space)
    if kind == "byte" and spelling == "ros1":  # an int8 there
        number = value if slot.shape == "one" else "each"
        signed = f"({number} & 255 ^ 128) - 128"
        return signed if slot.shape == "one" else f"[{signed} for each in {value}]"
    if slot.shape == "one":
        return value
    if kind in _BINARY:
        return f"octets({value})"
    if tag is not None and kind in ARRAY_CODES:
        code = ARRAY_CODES[kind]
        return f"tag({_TAGS[code]}, packed({value}, {code!r}))"
    return f"items({value})"


def _nested(slot: Slot, value: str, spelling: Spelling, tag: Any, space: Any) -> str:
    kind: Any = slot.kind
    if slot.shape == "one":
        return _message(kind, value, spelling, tag, space)
    name = f"f{len(space)}"
    space[name] = _compiled(kind, spelling, tag)
    return f"[{name}(each) for each in {value}]"


def _items(value: Any) -> list[Any]:
    items: list[Any] = value.tolist() if hasattr(value, "tolist") else list(value)
    return items


def _packed(value: Any, code: str) -> bytes:
    return bytes(numbers(value, code)[1])
