"""Messages as the YAML text that ``rostopic echo`` and ``print`` show.

It is line for line the text of genpy's ``strify_message``, so that scripts which read it keep
working.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import yaml

FieldFilter = Callable[[Any], Iterable[str]]
"""Function that returns the names of the fields of a message to show."""

_PLAIN = re.compile(r"[ !#-\[\]-~]{1,60}")
_TIME = "builtin_interfaces/Time"
_STAMPS = frozenset({_TIME, "builtin_interfaces/Duration"})


def strify_message(
    val: Any,
    indent: str = "",
    time_offset: Any = None,
    current_time: Any = None,  # noqa: ARG001  # genpy ignores it too
    field_filter: FieldFilter | None = None,
    fixed_numeric_width: int | None = None,
) -> str:
    """Return a message, or a value of a field, as text.

    Args:
        val: The value.
        indent: Indentation of the lines.
        time_offset: A Time that times are shown relative to.
        current_time: Not used.
        field_filter: Function that returns the names of the fields of a message to show.
        fixed_numeric_width: Width of numbers in characters; their own when not given.
    """
    return _YamlWriter(time_offset, field_filter, fixed_numeric_width).value(val, indent)


class _YamlWriter(NamedTuple):
    offset: Any
    filter: FieldFilter | None
    width: int | None

    def value(self, value: Any, indent: str) -> str:  # noqa: PLR0911  # one per kind of value
        if isinstance(value, bool):
            return str(value)
        if isinstance(value, int | float):
            return self._number(value)
        if isinstance(value, str):
            return _quoted(value)
        if getattr(value, "_type", None) in _STAMPS:
            return self._stamp(value, indent)
        if hasattr(value, "_schema"):
            return self._message(value, indent)
        if isinstance(value, bytes | bytearray | array | list | tuple) or hasattr(value, "tolist"):
            return self._list(value.tolist() if hasattr(value, "tolist") else list(value), indent)
        return str(value)

    def _number(self, value: float) -> str:
        if self.width is None:
            return str(value)
        if isinstance(value, float):
            text = f"{value:.{self.width}f}"
            return text[: max(text.find("."), self.width)]
        return f"{value:{self.width}d}"

    def _stamp(self, value: Any, indent: str) -> str:
        if self.offset is not None and value._type == _TIME:
            value = value - self.offset
        width = self.width
        secs = str(value.sec) if width is None else f"{value.sec:{width}d}"
        nsecs = f"{value.nanosec:{9 if width is None else width}d}"
        return f"\n{indent}secs: {secs}\n{indent}nsecs: {nsecs}"

    def _list(self, values: list[Any], indent: str) -> str:
        if not values:
            return "[]"
        first = values[0]
        if isinstance(first, str):
            text = yaml.dump(values).rstrip("\n")
            return "\n" + "\n".join(indent + line for line in text.splitlines())
        if self.width is not None and type(first) in (int, float):
            return f"[{', '.join(self._number(number) for number in values)}]"
        if isinstance(first, int | float):
            return str(values)
        return "\n" + "\n".join(f"{indent}- {self.value(value, indent + '  ')}" for value in values)

    def _message(self, value: Any, indent: str) -> str:
        names = type(value).__slots__
        if self.filter is not None:
            wanted = set(self.filter(value))
            names = tuple(name for name in names if name in wanted)
        lines = (
            f"{indent}{name}: {self.value(_field(value, name), '  ' + indent)}" for name in names
        )
        return ("\n" if indent else "") + "\n".join(lines)


def _field(value: Any, name: str) -> Any:
    """Return a field; bytes that are held as text, as in Python 2, become numbers."""
    given = getattr(value, name)
    if isinstance(given, str) and (name, "uint8") in {each[:2] for each in value._schema}:
        return [ord(letter) for letter in given]
    return given


def _quoted(value: str) -> str:
    if not value:
        return "''"
    if _PLAIN.fullmatch(value):
        return f'"{value}"'
    text: str = yaml.dump(value, default_style='"')
    return text.rstrip("\n")
