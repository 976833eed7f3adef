"""What a parameter may hold, and what it may not.

ROS 1's values, without XML-RPC's limits: bool, int (64 bit), float, str, list (mixed, nested),
dict with str keys, bytes, and timestamps (``datetime.datetime``, ``datetime.date``). ``None`` is no
value, as in ROS 1: a parameter that is not to be set is deleted.
"""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from typing import Any, Final

from rosz.errors import ParamError

__all__ = (
    "MAX_DEPTH",
    "Value",
    "convert",
    "copy",
    "normalise",
    "type_name",
    "unsound_text",
)

Value = Any
"""A parameter's value: one of the types above, nested at most `MAX_DEPTH` deep."""

MAX_DEPTH: Final = 100
"""Levels of lists and dicts in one value; also what stops a value that contains itself."""

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
    """A part of a value that cannot be kept; the way to it grows as the error climbs."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        self.trail: list[str] = []
        super().__init__(reason)


def type_name(value: object) -> str:
    """Return what a value's type is called in messages: ``int``, ``timestamp``, ``null`` …."""
    return _NAMES.get(type(value), type(value).__name__)


def unsound_text(text: str) -> str:
    """Say which character keeps a text from being written as UTF-8; empty where none does."""
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

    Tuples become lists, subclasses their base, and whatever has ``tolist`` (numpy scalars and
    arrays, ``array.array``) what that returns.

    Args:
        value: What somebody wants to set.
        name: The parameter's name, for the message.

    Raises:
        ParamError: It, or something in it, is no parameter value; the message names the place.
    """
    try:
        return _normalise(value, 0)
    except _RefusedError as refused:
        start = f"'{name}' cannot be set: " if name else ""
        inside = f"at {''.join(reversed(refused.trail))}: " if refused.trail else ""
        raise ParamError(f"{start}{inside}{refused.reason}") from None


def copy(value: Value) -> Value:
    """Return a value that shares nothing mutable with the one given."""
    kind = type(value)
    if kind is dict:
        return {key: copy(item) for key, item in value.items()}
    if kind is list:
        return [copy(item) for item in value]
    return value


def convert(value: Value, wanted: type, name: str, origin: str) -> Value:
    """Return a value as the type that its reader asked for.

    An int is a float where a float is asked for, as in ROS 1; nothing else is converted.

    Args:
        value: What is set.
        wanted: One of the store's types.
        name: The parameter's name, for the message.
        origin: Who set it, for the message.

    Raises:
        ParamError: It has another type, or ``wanted`` is no type of parameters.
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


def _normalise(value: Any, depth: int) -> Value:
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
        return _mapping(value, depth)
    if isinstance(value, (list, tuple)):
        return _sequence(value, depth)
    return _unusual(value, depth)


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


def _mapping(value: dict[Any, Any], depth: int) -> dict[str, Value]:
    found: dict[str, Value] = {}
    for key, item in value.items():
        if not isinstance(key, str):
            raise _RefusedError(f"the key {key!r} is a {type_name(key)}; expected a str")
        try:
            found[_text(str.__str__(key))] = _normalise(item, depth + 1)
        except _RefusedError as refused:
            refused.trail.append(f"/{key}")
            raise
    return found


def _sequence(value: list[Any] | tuple[Any, ...], depth: int) -> list[Value]:
    found: list[Value] = []
    for index, item in enumerate(value):
        try:
            found.append(_normalise(item, depth + 1))
        except _RefusedError as refused:
            refused.trail.append(f"[{index}]")
            raise
    return found


def _unusual(value: Any, depth: int) -> Value:
    """Take what is no plain value of the store but can be made one without loss."""
    if value is None:
        raise _RefusedError(
            "null is no parameter value; delete the parameter, or set '' or {} instead"
        )
    for base, convert_from in _BASES:
        if isinstance(value, base):
            return convert_from(value)
    to_list = getattr(value, "tolist", None)
    if callable(to_list):
        return _normalise(to_list(), depth + 1)
    raise _RefusedError(f"a {type(value).__name__} is no parameter value; {_EXPECTED}")


def _moment(value: dt.datetime) -> dt.datetime:
    # A zone by name would not survive the way to another process; its offset does.
    return dt.datetime.fromisoformat(value.isoformat())


_BASES: Final[tuple[tuple[Any, Callable[[Any], Value]], ...]] = (
    (int, lambda value: _integer(int(value))),
    (float, float),
    (str, lambda value: _text(str.__str__(value))),
    ((bytes, bytearray, memoryview), bytes),
    (dt.datetime, _moment),
    (dt.date, lambda value: dt.date(value.year, value.month, value.day)),
)
