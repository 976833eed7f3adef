"""Messages of a topic as text, one after the other: ``rostopic echo``."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable
from keyword import iskeyword
from math import isfinite, isnan
from typing import Any

import msgspec

from rosz.introspect.expression import Filter
from rosz.introspect.fields import FieldPath
from rosz.introspect.shorten import Shortener

__all__ = ("Echo", "EchoOptions", "dump_bytes", "plain")

CLEAR = "\033[2J\033[;H"
_DUMP_WIDTH = 16


class EchoOptions(msgspec.Struct, frozen=True, kw_only=True):
    """How messages are shown.

    Attributes:
        plot: As rows of numbers.
        as_json: As JSON, one line for each.
        clear: Clear the screen before each.
        width: Of numbers, in characters; 0 for as wide as they are.
        offset: Show times as seconds from now.
        no_arrays: Leave out arrays.
        no_strings: Leave out texts.
        condition: Show only those that it accepts.
    """

    plot: bool = False
    as_json: bool = False
    clear: bool = False
    width: int = 0
    offset: bool = False
    no_arrays: bool = False
    no_strings: bool = False
    condition: Filter | None = None


class Echo:
    """Turns the messages of one topic into text.

    Args:
        topic: Name of the topic, for the filter.
        kind: Type of what is shown, as ROS 1 spells it.
        path: From a message to what is shown.
        options: How.
        now: Gives ROS time in nanoseconds.
    """

    def __init__(
        self, topic: str, kind: str, path: FieldPath, options: EchoOptions, now: Callable[[], int]
    ) -> None:
        self._topic = topic
        self._kind = kind
        self._path = path
        self._options = options
        self._now = now
        self._shortener = Shortener(no_arrays=options.no_arrays, no_strings=options.no_strings)
        self._headed = False

    def text(self, message: Any) -> str | None:
        """Return what to print for a message; ``None`` if it is not wanted.

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
        if not self._shortener.idle:
            value = self._shortener.apply(value, self._kind)
        if self._options.as_json:
            return _json(value)
        return self._yaml(value)

    def _plot(self, value: Any) -> str:
        from rosz.introspect.plot import plot_head, plot_row

        now = self._now()
        offset = now if self._options.offset else 0
        row = plot_row(value, self._shortener.fields, now, offset) + "\n"
        if self._headed:
            return row
        self._headed = True
        return f"{plot_head(value, self._shortener.fields)}\n{row}"

    def _yaml(self, value: Any) -> str:
        from rosz.message.text import strify_message

        offset = None
        if self._options.offset:
            from rosz.msgs.builtin_interfaces.msg import Time

            offset = Time.from_nsec(self._now())
        text = strify_message(
            value, time_offset=offset, fixed_numeric_width=self._options.width or None
        )
        return f"{CLEAR * self._options.clear}{text}\n---\n"


def _json(value: Any) -> str:
    return msgspec.json.encode(plain(value)).decode() + "\n"


def plain(value: Any) -> Any:
    """Return a message, or a value in one, as what JSON has; see `rosz.message.values.to_json`."""
    if hasattr(value, "_schema"):
        return {_shown(name): plain(getattr(value, name)) for name in type(value).__slots__}
    if isinstance(value, bytes | bytearray):
        return b64encode(value).decode()
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    if isinstance(value, float) and not isfinite(value):
        return "NaN" if isnan(value) else "Infinity" if value > 0 else "-Infinity"
    return value


def _shown(name: str) -> str:
    """Return the name of a field without what sets it apart from a word of Python."""
    return name[:-1] if name.endswith("_") and iskeyword(name[:-1]) else name


def dump_bytes(data: bytes) -> str:
    """Return bytes as lines of offset, hexadecimal numbers and text."""
    lines: list[str] = []
    for start in range(0, len(data), _DUMP_WIDTH):
        row = data[start : start + _DUMP_WIDTH]
        text = "".join(chr(octet) if 0x20 <= octet < 0x7F else "." for octet in row)  # noqa: PLR2004
        lines.append(f"{start:08x}  {row.hex(' '):<{_DUMP_WIDTH * 3 - 1}}  |{text}|")
    return "\n".join(lines)
