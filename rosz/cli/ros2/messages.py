"""Messages as ROS 2's commands print and fill them (rosidl_runtime_py, rosidl_generator_py)."""

from __future__ import annotations

import sys
from array import array
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any, NamedTuple

from rosz.cli.ros2.graph import CommandFailed
from rosz.errors import MessageError
from rosz.message import ARRAY_CODES, Message, Slot, shown_name, slots
from rosz.time import TimeValue

_TEXTS = {"string", "wstring"}
_NAMES = {
    "bool": "boolean",
    "byte": "octet",
    "char": "uint8",
    "float32": "float",
    "float64": "double",
}


class Limits(NamedTuple):
    """The parts of messages that are left out.

    Attributes:
        length: Most items of an array, and letters of a text; None for all.
        no_arrays: Whether arrays are left out.
        no_texts: Whether texts are left out.
    """

    length: int | None = None
    no_arrays: bool = False
    no_texts: bool = False


_NO_LIMITS = Limits()
_SEQUENCES = (list, array, memoryview)


def _fields(message: Message) -> Iterator[tuple[Slot, str, Any]]:
    """Yield the fields of a message, with their names and values as ROS 2's Python has them."""
    for slot in slots(type(message)):
        value = getattr(message, slot.name)
        if slot.kind == "byte":
            value = bytes([value]) if slot.shape == "one" else [bytes([each]) for each in value]
        elif isinstance(value, bytes):
            value = memoryview(value)  # a sequence of numbers, which is cut without a copy
        yield slot, shown_name(slot.name), value


def to_yaml(value: Any, limits: Limits = _NO_LIMITS, *, flow: bool = False) -> str:
    """Return a message as YAML."""
    import yaml

    text: str = yaml.dump(
        to_plain(value, limits),
        Dumper=_dumper(),
        allow_unicode=True,
        width=sys.maxsize,
        default_flow_style=flow,
    )
    return text


@cache
def _dumper() -> Any:
    """Return a writer of YAML that has mappings in blocks, also with flow style, as ROS 2 has."""
    import yaml

    def represent(dumper: Any, values: dict[str, Any]) -> Any:
        pairs = [tuple(map(dumper.represent_data, item)) for item in values.items()]
        return yaml.MappingNode("tag:yaml.org,2002:map", pairs)

    made: Any = type("Ros2Dumper", (yaml.Dumper,), {})
    made.add_representer(dict, represent)
    return made


def to_plain(value: Any, limits: Limits) -> Any:
    """Return a message as a dictionary, or a value as what YAML has for it."""
    if isinstance(value, Message):
        return {
            name: _array_note(slot, inner)
            if limits.no_arrays and slot.shape != "one"
            else to_plain(inner, limits)
            for slot, name, inner in _fields(value)
        }
    if isinstance(value, bytes):
        value = value.decode("latin-1")
    elif isinstance(value, str) and limits.no_texts:
        return f"<string length: <{len(value)}>>"
    if isinstance(value, str):
        return value if not _is_long(value, limits) else value[: limits.length] + "..."
    if isinstance(value, _SEQUENCES):
        items = [to_plain(each, limits) for each in value[: limits.length]]
        return [*items, "..."] if _is_long(value, limits) else items
    return value


def _is_long(value: Any, limits: Limits) -> bool:
    return limits.length is not None and len(value) > limits.length


def _array_note(slot: Slot, value: Any) -> str:
    kind = slot.kind
    name = _NAMES.get(kind, kind) if isinstance(kind, str) else kind._type_name
    if slot.shape == "fixed":
        return f"<array type: {name}[{slot.size}]>"
    bound = f"[{slot.size}]" if slot.shape == "bounded" else ""
    return f"<sequence type: {name}{bound}, length: {len(value)}>"


def to_csv(value: Any, limits: Limits) -> str:
    """Return the values of a message, with commas between them."""
    if isinstance(value, Message):
        return ",".join(
            _array_note(slot, inner)
            if limits.no_arrays and slot.shape != "one"
            else to_csv(inner, limits)
            for slot, _, inner in _fields(value)
        )
    if isinstance(value, _SEQUENCES):
        items = [to_csv(each, limits) for each in value[: limits.length]]
        return ",".join([*items, "..."] if _is_long(value, limits) else items)
    if isinstance(value, str):
        return str(to_plain(value, limits))
    if isinstance(value, bytes) and _is_long(value, limits):
        value = value[: limits.length] + b"..."
    return str(value)


def to_repr(value: Any) -> str:
    """Return a message as Python, as rclpy's messages show themselves."""
    if isinstance(value, _SEQUENCES):
        return f"[{', '.join(map(to_repr, value))}]"
    if not isinstance(value, Message):
        return repr(value)
    shown = (f"{slot.name}={_array_repr(slot, inner)}" for slot, _, inner in _fields(value))
    return f"{value._type_name.replace('/', '.')}({', '.join(shown)})"


def _array_repr(slot: Slot, value: Any) -> str:
    numeric = slot.shape == "fixed" and slot.kind in {*ARRAY_CODES, "uint8", "char"}
    if numeric:
        try:
            import numpy as np  # rclpy has such arrays, where they may have several lines
        except ImportError:
            return f"array({list(value)!r})"
        return repr(np.array(value, dtype=ARRAY_CODES.get(str(slot.kind), "B")))
    return to_repr(value)


def read_values(text: str) -> Any:
    """Return the values of a message that are given on a command line.

    Raises:
        CommandFailed: The text is not YAML.
    """
    import yaml

    try:
        return yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise CommandFailed(f"the values are not YAML: {' '.join(str(error).split())}") from error


def fill(message: Message, values: Any, *, stamped: bool = False) -> list[Callable[[int], None]]:
    """Set fields of a message from a dictionary, in the way of ``set_message_fields``.

    Args:
        message: The message.
        values: Values by field.
        stamped: Whether ``auto`` is a header with the time, and ``now`` a time.

    Returns:
        Functions that set these times to one in nanoseconds.

    Raises:
        AttributeError: The message has no such field.
        TypeError: A value is of another kind than its field.
        ValueError: A text is not a number.
        MessageError: A number is out of its range.
    """
    stamps: list[Callable[[int], None]] = []
    _Filler(stamps, stamped).fill(message, values)
    type(message)._encode(message)
    return stamps


class _Filler(NamedTuple):
    stamps: list[Callable[[int], None]]
    stamped: bool

    def fill(self, message: Any, values: Any) -> None:
        if not isinstance(values, dict):
            raise TypeError(
                f"Value '{values}' is expected to be a dictionary but is a {type(values).__name__}"
            )
        fields = {shown_name(slot.name): slot for slot in slots(type(message))}
        for name, value in values.items():
            slot = fields.get(name)
            if slot is None:
                base = message._type_name.rpartition("/")[2]
                raise AttributeError(f"'{base}' object has no attribute '{name}'")
            if slot.shape == "one":
                setattr(
                    message, slot.name, self._one(slot.kind, value, getattr(message, slot.name))
                )
            else:
                setattr(message, slot.name, self._several(slot.kind, value))

    def _one(self, kind: Any, value: Any, before: Any = None) -> Any:
        if kind in _TEXTS:
            return str(value)
        if kind == "bool":
            return bool(value)
        if kind in {"float32", "float64"}:
            return float(value)
        if isinstance(kind, str):
            return value[0] if isinstance(value, bytes) and value else int(value)
        message = before if value in ("auto", "now") and before is not None else kind()
        timed = message if value == "now" else getattr(message, "stamp", None)
        if self.stamped and value in ("auto", "now") and isinstance(timed, TimeValue):
            self.stamps.append(lambda now: _set_time(timed, now))
        else:
            self.fill(message, value)
        return message

    def _several(self, kind: Any, value: Any) -> Any:
        if isinstance(kind, str) and kind in ARRAY_CODES:
            return array(ARRAY_CODES[kind], value)
        items = [self._one(kind, each) for each in value]
        return bytes(items) if kind in {"byte", "char", "uint8"} else items


def _set_time(time: Any, now: int) -> None:
    time.sec, time.nanosec = divmod(now, 1_000_000_000)


FILL_ERRORS = (AttributeError, TypeError, ValueError, MessageError, OverflowError)
"""The errors of `fill`."""
