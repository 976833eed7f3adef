"""rosidl_runtime_py: messages as text, filled from values, and their classes by name.

The texts are those that ROS 2's commands print.
"""

from __future__ import annotations

import sys
from array import array
from collections import OrderedDict
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from typing import Any, NamedTuple

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
        truncate_length: Most items of an array, and letters of a text; None for all.
        no_arr: Whether arrays are left out.
        no_str: Whether texts are left out.
    """

    truncate_length: int | None = None
    no_arr: bool = False
    no_str: bool = False


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


def message_to_yaml(
    msg: Message,
    *,
    truncate_length: int | None = None,
    no_arr: bool = False,
    no_str: bool = False,
    flow_style: bool = False,
) -> str:
    """Return a message as YAML.

    Args:
        msg: The message.
        truncate_length: Most items of an array, and letters of a text; all when not given.
        no_arr: Whether to show the types and lengths of arrays only.
        no_str: Whether to show the lengths of texts only.
        flow_style: Whether lists are written in brackets.
    """
    return to_yaml(msg, Limits(truncate_length, no_arr, no_str), flow=flow_style)


def message_to_ordereddict(msg: Message, **options: Any) -> dict[str, Any]:
    """Return a message as a dictionary; the options are those of `message_to_csv`."""
    plain: dict[str, Any] = to_plain(msg, Limits(**options))
    return OrderedDict(plain)


def message_to_csv(msg: Message, **options: Any) -> str:
    """Return the values of a message with commas between them.

    Args:
        msg: The message.
        options: ``truncate_length``, ``no_arr`` and ``no_str``, as of `message_to_yaml`.
    """
    return to_csv(msg, Limits(**options))


def set_message_fields(
    msg: Message,
    values: dict[str, Any],
    expand_header_auto: bool = False,
    expand_time_now: bool = False,
) -> list[Any]:
    """Set fields of a message from a dictionary; see `fill`.

    Args:
        msg: The message.
        values: Values by field.
        expand_header_auto: Whether ``auto`` stands for a header with the time.
        expand_time_now: Whether ``now`` stands for the time.

    Returns:
        The times in the message that the caller has to set.
    """
    return fill(msg, values, stamped=expand_header_auto or expand_time_now)


def get_interface(identifier: str) -> Any:
    """Return the class of ``std_msgs/msg/String``, of a service or of an action.

    Raises:
        ValueError: The text is not such a name.
        ModuleNotFoundError: There is no such package, or it has no interfaces of that kind.
        AttributeError: The package has no such interface.
    """
    parts = identifier.split("/")
    if len(parts) != len(("package", "kind", "name")) or not all(parts):
        raise ValueError(f"expected the full name of an interface, got '{identifier}'")
    return getattr(import_module(f"{parts[0]}.{parts[1]}"), parts[2])


get_message = get_service = get_action = get_interface


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
            if limits.no_arr and slot.shape != "one"
            else to_plain(inner, limits)
            for slot, name, inner in _fields(value)
        }
    if isinstance(value, bytes):
        value = value.decode("latin-1")
    elif isinstance(value, str) and limits.no_str:
        return f"<string length: <{len(value)}>>"
    if isinstance(value, str):
        return value if not _is_long(value, limits) else value[: limits.truncate_length] + "..."
    if isinstance(value, _SEQUENCES):
        items = [to_plain(each, limits) for each in value[: limits.truncate_length]]
        return [*items, "..."] if _is_long(value, limits) else items
    return value


def _is_long(value: Any, limits: Limits) -> bool:
    return limits.truncate_length is not None and len(value) > limits.truncate_length


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
            if limits.no_arr and slot.shape != "one"
            else to_csv(inner, limits)
            for slot, _, inner in _fields(value)
        )
    if isinstance(value, _SEQUENCES):
        items = [to_csv(each, limits) for each in value[: limits.truncate_length]]
        return ",".join([*items, "..."] if _is_long(value, limits) else items)
    if isinstance(value, str):
        return str(to_plain(value, limits))
    if isinstance(value, bytes) and _is_long(value, limits):
        value = value[: limits.truncate_length] + b"..."
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


def fill(message: Message, values: Any, *, stamped: bool = False) -> list[Any]:
    """Set fields of a message from a dictionary, in the way of ``set_message_fields``.

    Args:
        message: The message.
        values: Values by field.
        stamped: Whether ``auto`` is a header with the time, and ``now`` a time.

    Returns:
        These times, which the caller has to set.

    Raises:
        AttributeError: The message has no such field.
        TypeError: A value is of another kind than its field.
        ValueError: A text is not a number.
        MessageError: A number is out of its range.
    """
    stamps: list[Any] = []
    _Filler(stamps, stamped).fill(message, values)
    type(message)._encode(message)
    return stamps


class _Filler(NamedTuple):
    stamps: list[Any]
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
            self.stamps.append(timed)
        else:
            self.fill(message, value)
        return message

    def _several(self, kind: Any, value: Any) -> Any:
        if isinstance(kind, str) and kind in ARRAY_CODES:
            return array(ARRAY_CODES[kind], value)
        items = [self._one(kind, each) for each in value]
        return bytes(items) if kind in {"byte", "char", "uint8"} else items


FILL_ERRORS = (AttributeError, TypeError, ValueError, MessageError, OverflowError)
"""The errors of `fill`."""
