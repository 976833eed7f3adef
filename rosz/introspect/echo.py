"""Messages of a topic as text: ``rostopic echo``.

The forms are YAML, JSON and rows of numbers for plotting (``-p``); arrays and strings can be left
out of each (``--noarr``, ``--nostr``).
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable, Iterator
from functools import lru_cache
from typing import Any

import msgspec

from rosz.introspect.fields import FieldPath, Filter
from rosz.message import Message, strify_message, to_jsonable
from rosz.names import printable
from rosz.time import DurationValue, TimeValue

_CLEAR = "\033[2J\033[;H"
_DUMP_WIDTH = 16
_STAMPS = frozenset({"builtin_interfaces/Time", "builtin_interfaces/Duration"})


class EchoOptions(msgspec.Struct, frozen=True, kw_only=True):
    """The options of an `Echo`.

    Attributes:
        plot: Whether to show rows of numbers.
        as_json: Whether to show JSON, one line for each message.
        clear: Whether to clear the screen before each message.
        width: Width of numbers in characters; 0 for their own width.
        offset: Whether to show times as seconds from now.
        no_arrays: Whether to leave out arrays.
        no_strings: Whether to leave out strings.
        condition: Filter that a message must pass.
    """

    plot: bool = False
    as_json: bool = False
    clear: bool = False
    width: int = 0
    offset: bool = False
    no_arrays: bool = False
    no_strings: bool = False
    condition: Filter | None = None


class Echo(msgspec.Struct, eq=False):
    """Formats the messages of one topic.

    Args:
        topic: Name of the topic, for the filter.
        type_name: Type of the part that is shown, as ROS 1 spells it.
        path: Path from a message to the part that is shown.
        options: How messages are shown.
        now: Function that returns ROS time in nanoseconds.
    """

    _topic: str
    _type_name: str
    _path: FieldPath
    _options: EchoOptions
    _now: Callable[[], int]
    _has_head: bool = False

    def text(self, message: Any) -> str | None:
        """Return the text of a message to print; None if the filter refuses it.

        Raises:
            LookupError: The message has no element at an index of the path.
            RoszError: The filter fails.
        """
        condition = self._options.condition
        if condition is not None and not condition.accepts(message, self._topic):
            return None
        value = self._path.read(message)
        if self._options.plot:
            return self._plot(value)
        no_arrays, no_strings = self._options.no_arrays, self._options.no_strings
        if no_arrays or no_strings:
            value = shorten(value, self._type_name, no_arrays, no_strings)
        if self._options.as_json:
            return printable(msgspec.json.encode(to_jsonable(value)).decode() + "\n")
        return self._yaml(value)

    def _yaml(self, value: Any) -> str:
        offset = None
        if self._options.offset:
            from rosz.msgs.builtin_interfaces.msg import Time

            offset = Time.from_nsec(self._now())
        text = strify_message(
            value, time_offset=offset, fixed_numeric_width=self._options.width or None
        )
        return f"{_CLEAR * self._options.clear}{text}\n---\n"

    # Rows of numbers.

    def _plot(self, value: Any) -> str:
        """Return the row of a message, or of a value in it, behind a head if it is the first.

        The first column is the time of the message's header, or else now; bytes are left out, as
        ``rostopic`` does.
        """
        time = now = self._now()
        offset = now if self._options.offset else 0
        if isinstance(value, Message) and value._has_header:
            time = value.header.stamp.to_nsec()  # type: ignore[attr-defined]  # it has one
        row = f"{time - offset}," + ",".join(plot_values(value, offset, self._fields)) + "\n"
        if self._has_head:
            return row
        self._has_head = True
        return f"%time,{','.join(plot_columns(value, 'field', self._fields))}\n{row}"

    def _fields(self, message: Message) -> Iterator[str]:
        """Yield the fields of a message that are shown."""
        no_arrays, no_strings = self._options.no_arrays, self._options.no_strings
        for name, type_name in zip(message.__slots__, message._slot_types, strict=True):
            if not (no_arrays and "[" in type_name) and not (
                no_strings and type_name.startswith("string")
            ):
                yield name


def shorten(value: Any, type_name: str, no_arrays: bool, no_strings: bool) -> Any:
    """Return a value, with notes in place of the parts that are left out.

    Args:
        value: A message, or a value in it.
        type_name: Type of the value, as ROS 1 spells it.
        no_arrays: Whether to leave out arrays.
        no_strings: Whether to leave out strings.
    """
    element, bracket, _ = type_name.partition("[")
    text = no_strings and element.startswith("string")
    if bracket and (no_arrays or text):
        return f"<array type: {element}, length: {len(value)}>"
    if text and not bracket:
        return f"<string length: {len(value)}>"
    if not isinstance(value, Message) or value._type in _STAMPS:
        return value
    shortened = _untyped(type(value))()
    for name, inner in zip(value.__slots__, value._slot_types, strict=True):
        setattr(shortened, name, shorten(getattr(value, name), inner, no_arrays, no_strings))
    return shortened


@lru_cache(maxsize=1024)
def _untyped(cls: type[Message]) -> type[Any]:
    """Return a class with the fields of a message class, which hold any value."""
    return type(cls.__name__, (), {"__slots__": cls.__slots__, "_schema": (), "_type": cls._type})


FieldNames = Callable[[Any], Iterable[str]]
"""Function that returns the names of the fields of a message to show."""


def plot_columns(value: Any, name: str, fields: FieldNames) -> Iterator[str]:
    """Yield the names of the columns of a value.

    Args:
        value: A message, or a value in it.
        name: Name of the value.
        fields: Function that returns the names of the fields to show.
    """
    if isinstance(value, Message) and not isinstance(value, TimeValue | DurationValue):
        for field, inner in _inner(value, fields):
            yield from plot_columns(inner, f"{name}.{field}", fields)
    elif isinstance(value, list | tuple | array):
        for number, item in enumerate(value):
            yield from plot_columns(item, f"{name}{number}", fields)
    elif not isinstance(value, bytes):
        yield name


def plot_values(value: Any, offset: int, fields: FieldNames) -> Iterator[str]:
    """Yield the texts in the columns of a value.

    Args:
        value: A message, or a value in it.
        offset: Time that is subtracted from all times, in nanoseconds.
        fields: Function that returns the names of the fields to show.
    """
    if isinstance(value, bool):
        yield "1" if value else "0"
    elif isinstance(value, TimeValue):
        yield str(value.to_nsec() - offset)
    elif isinstance(value, DurationValue):
        yield str(value.to_nsec())
    elif isinstance(value, Message):
        for _, inner in _inner(value, fields):
            yield from plot_values(inner, offset, fields)
    elif isinstance(value, list | tuple | array):
        for item in value:
            yield from plot_values(item, offset, fields)
    elif not isinstance(value, bytes):
        yield printable(str(value))


def _inner(message: Message, fields: FieldNames) -> Iterator[tuple[str, Any]]:
    """Yield the names and values of the fields of a message that are shown."""
    types = dict(zip(message.__slots__, message._slot_types, strict=True))
    for name in fields(message):
        value = getattr(message, name)
        # Programs of ROS 1 may hold bytes as text.
        as_text = isinstance(value, str) and types.get(name, "").startswith("uint8[")
        yield name, [ord(character) for character in value] if as_text else value


def dump_bytes(data: bytes) -> str:
    """Return bytes as lines of offset, hexadecimal numbers and text."""
    lines: list[str] = []
    for start in range(0, len(data), _DUMP_WIDTH):
        row = data[start : start + _DUMP_WIDTH]
        text = "".join(chr(octet) if 0x20 <= octet < 0x7F else "." for octet in row)  # noqa: PLR2004
        lines.append(f"{start:08x}  {row.hex(' '):<{_DUMP_WIDTH * 3 - 1}}  |{text}|")
    return "\n".join(lines)
