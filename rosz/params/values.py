"""The values that a parameter can hold.

They are ROS 1's values without the limits of XML-RPC: bool, int (64 bit), float, str, list (mixed,
nested), dict with str keys, bytes, and timestamps (``datetime.datetime``, ``datetime.date``).
``None`` is not a value, as in ROS 1: delete a parameter that shall not be set.
"""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from typing import Any, Final

from rosz.errors import ParamError
from rosz.names import LONGEST_PATH

Value = Any
"""The value of a parameter: one of the types above, nested at most `MAX_DEPTH` deep."""

MAX_DEPTH: Final = 100
"""Levels of lists and dicts in one value; the limit also stops a value that contains itself."""

_LOWEST: Final = -(1 << 63)
_HIGHEST: Final = (1 << 63) - 1
_NAMES: Final[dict[type, str]] = {
    bool: "bool",
    int: "int",
    float: "float",
    str: "str",
    list: "list",
    dict: "dict",
    bytes: "bytes",
    dt.datetime: "timestamp",
    dt.date: "date",
    type(None): "null",
}
_EXPECTED: Final = "expected bool, int, float, str, list, dict, bytes or a timestamp"


class _RefusedError(Exception):
    """A part of a value is refused; the trail to it grows while the exception propagates."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        self.trail: list[str] = []
        super().__init__(reason)


def type_name(value: object) -> str:
    """Return the name of a value's type in messages, such as ``int``, ``timestamp`` or ``null``."""
    return _NAMES.get(type(value), type(value).__name__)


def unsound_text(text: str) -> str:
    """Return why a text cannot be written as UTF-8, or an empty text if it can."""
    if text.isascii():
        return ""
    try:
        text.encode()
    except UnicodeEncodeError as error:
        bad = ascii(text[error.start])[1:-1]
        return f"character '{bad}' at position {error.start + 1} is half of a surrogate pair"
    return ""


def normalise(value: object, name: str = "") -> Value:
    """Return a private copy of a value in the store's own types.

    Tuples become lists, and instances of subclasses become instances of the base class. Objects
    with a ``tolist`` method (numpy scalars and arrays, ``array.array``) become its result.

    Args:
        value: Value to set.
        name: Name of the parameter, for the error message.

    Raises:
        ParamError: A parameter cannot hold the value, or a part of it; the message names the place.
    """
    try:
        return _normalise(value, 0, LONGEST_PATH - len(name.encode(errors="replace")))
    except _RefusedError as refused:
        start = f"'{name}' cannot be set: " if name else ""
        inside = f"at {''.join(reversed(refused.trail))}: " if refused.trail else ""
        raise ParamError(f"{start}{inside}{refused.reason}") from None


def copy(value: Value) -> Value:
    """Return a deep copy of a value."""
    kind = type(value)
    if kind is dict:
        return {key: copy(item) for key, item in value.items()}
    if kind is list:
        return [copy(item) for item in value]
    return value


def convert(value: Value, wanted: type, name: str, origin: str) -> Value:
    """Return a value as the type that its reader expects.

    An int becomes a float where a float is expected, as in ROS 1; nothing else is converted.

    Args:
        value: Value that is set.
        wanted: Type of the store's own types.
        name: Name of the parameter, for the error message.
        origin: Writer of the value, for the error message.

    Raises:
        ParamError: The value has another type, or no parameter has the wanted type.
    """
    kind = type(value)
    if kind is wanted:
        return value
    if wanted is float and kind is int:
        return float(value)
    if wanted not in _NAMES or wanted is type(None):
        raise ParamError(f"no parameter has the type '{wanted.__name__}'; {_EXPECTED}")
    by = f" (set by {origin})" if origin else ""
    raise ParamError(
        f"parameter '{name}' is the {type_name(value)} {_short(value)}{by}; "
        f"expected {_NAMES[wanted]}; set it to one, or read it without a type"
    )


def _short(value: Value) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."  # noqa: PLR2004  # a line on the screen


def _normalise(value: Any, depth: int, room: int) -> Value:
    kind = type(value)
    if kind is str:
        return _text(value)
    if kind is float or kind is bool:
        return value
    if kind is int:
        return _integer(value)
    if depth >= MAX_DEPTH:
        raise _RefusedError(f"it is nested more than {MAX_DEPTH} deep, or contains itself")
    if isinstance(value, dict):
        return _mapping(value, depth, room)
    if isinstance(value, (list, tuple)):
        return _sequence(value, depth, room)
    return _unusual(value, depth, room)


def _text(value: str) -> str:
    reason = unsound_text(value)
    if reason:
        raise _RefusedError(reason)
    return value


def _integer(value: int) -> int:
    if _LOWEST <= value <= _HIGHEST:
        return value
    raise _RefusedError(
        f"the int {value:#x} does not fit 64 bits; expected {_LOWEST} to {_HIGHEST}"
    )


def _mapping(value: dict[Any, Any], depth: int, room: int) -> dict[str, Value]:
    items: dict[str, Value] = {}
    for key, item in value.items():
        if not isinstance(key, str):
            raise _RefusedError(f"the key {key!r} is a {type_name(key)}; expected a str")
        text = str.__str__(key)
        try:
            left = room - len(_text(text).encode()) - 1
            if left < 0:
                raise _RefusedError(f"its name would have more than {LONGEST_PATH} bytes")  # noqa: TRY301
            items[text] = _normalise(item, depth + 1, left)
        except _RefusedError as refused:
            refused.trail.append(f"/{text:.60}")
            raise
    return items


def _sequence(value: list[Any] | tuple[Any, ...], depth: int, room: int) -> list[Value]:
    items: list[Value] = []
    for index, item in enumerate(value):
        try:
            items.append(_normalise(item, depth + 1, room))
        except _RefusedError as refused:
            refused.trail.append(f"[{index}]")
            raise
    return items


def _unusual(value: Any, depth: int, room: int) -> Value:
    """Convert an object that is not one of the store's types but becomes one without loss."""
    if value is None:
        raise _RefusedError(
            "null is not a parameter value; delete the parameter, or set '' or {} instead"
        )
    for base, convert_from in _BASES:
        if isinstance(value, base):
            return convert_from(value)
    to_list = getattr(value, "tolist", None)
    if callable(to_list):
        return _normalise(to_list(), depth + 1, room)
    raise _RefusedError(f"a {type(value).__name__} is not a parameter value; {_EXPECTED}")


def _moment(value: dt.datetime) -> dt.datetime:
    # The name of a time zone is lost on the way to another process; its offset is not.
    return dt.datetime.fromisoformat(value.isoformat())


_BASES: Final[tuple[tuple[Any, Callable[[Any], Value]], ...]] = (
    (int, lambda value: _integer(int(value))),
    (float, float),
    (str, lambda value: _text(str.__str__(value))),
    ((bytes, bytearray, memoryview), bytes),
    (dt.datetime, _moment),
    (dt.date, lambda value: dt.date(value.year, value.month, value.day)),
)
