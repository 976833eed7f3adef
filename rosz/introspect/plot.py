"""Messages as lines of numbers with commas between, for plotting: ``rostopic echo -p``."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from rosz.message import Message
from rosz.time import DurationValue, TimeValue

__all__ = ("plot_head", "plot_row")

FieldFilter = Callable[[Any], Iterable[str]]


def plot_head(value: Any, fields: FieldFilter) -> str:
    """Return the first line: a name for each number of a row like that of `value`."""
    return "%time," + ",".join(_names(value, "field", fields))


def plot_row(value: Any, fields: FieldFilter, time: int, offset: int = 0) -> str:
    """Return the row of a message, or of a value in it.

    Args:
        value: What to show; octets are left out, as ROS 1's tool does.
        fields: Gives the fields of a message that are shown.
        time: Nanoseconds, for the first column unless the value has a header.
        offset: Nanoseconds that times are told from.
    """
    if isinstance(value, Message) and value._has_header:
        time = value.header.stamp.to_nsec()  # type: ignore[attr-defined]  # it has one
    return f"{time - offset}," + ",".join(_values(value, fields, offset))


def _names(value: Any, name: str, fields: FieldFilter) -> Iterator[str]:
    if isinstance(value, Message) and not isinstance(value, TimeValue | DurationValue):
        shown = set(fields(value))
        for slot in value.__slots__:
            if slot in shown:
                yield from _names(getattr(value, slot), f"{name}.{slot}", fields)
    elif isinstance(value, list | tuple | array):
        for number, one in enumerate(value):
            if isinstance(one, Message) and not isinstance(one, TimeValue | DurationValue):
                yield from _names(one, f"{name}{number}", fields)
            else:
                yield f"{name}{number}"
    elif not isinstance(value, bytes):
        yield name


def _values(value: Any, fields: FieldFilter, offset: int) -> Iterator[str]:
    if isinstance(value, bool):
        yield "1" if value else "0"
    elif isinstance(value, TimeValue):
        yield str(value.to_nsec() - offset)
    elif isinstance(value, DurationValue):
        yield str(value.to_nsec())
    elif isinstance(value, Message):
        shown = set(fields(value))
        for slot in value.__slots__:
            if slot in shown:
                yield from _values(getattr(value, slot), fields, offset)
    elif isinstance(value, list | tuple | array):
        for one in value:
            yield from _values(one, fields, offset)
    elif not isinstance(value, bytes):
        yield str(value)
