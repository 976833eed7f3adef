"""Messages from and to plain values, JSON and YAML.

What fills a message may leave fields out, or list them by position; a time may be ``now``, and a
header ``auto``. An unknown field, or a value of another kind, is an error that names the field.
"""

from __future__ import annotations

import base64
import binascii
import json
import keyword
import math
from array import array
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, NoReturn, TypeAlias, TypeVar

import yaml

from rosz.errors import EncodeError, near_miss
from rosz.message.base import Message, Sequenced, ros1_slots
from rosz.message.schema import ARRAY_CODES, INTEGER_RANGES, OCTETS, Slot, slots
from rosz.message.schema_codec import shown
from rosz.message.sequences import numbers
from rosz.message.text import strify_message
from rosz.time import DurationValue, TimeValue, normal

_NOT_FINITE = {"NaN": math.nan, "Infinity": math.inf, "-Infinity": -math.inf}
_FLOATS = frozenset({"float32", "float64"})
_TEXTS = frozenset({"string", "wstring"})


def fill_message_args(msg: Message, msg_args: Any, keys: Mapping[str, Any] | None = None) -> None:
    """Set fields of a message from the values of a command line, as genpy's function does.

    Args:
        msg: The message.
        msg_args: A dict of fields; a list with one such dict; a list of all fields in order; or
            None, which is an empty list.
        keys: Times, durations and messages, by the texts that stand for them. If ``now`` is one
            of these, ``auto`` is a header with that time.

    Raises:
        EncodeError: A name is not a field of its message, a value does not fit its field, or the
            number of values is wrong.
    """
    _Filler(msg._type, keys or {}).fill(msg, [] if msg_args is None else _sole(msg_args), "")


def _sole(values: Any) -> Any:
    """Return the only element of a list if it is a dict, else the value itself."""
    sole = isinstance(values, list) and len(values) == 1 and isinstance(values[0], dict)
    return values[0] if sole else values


def shown_name(name: str) -> str:
    """Return the name of a field in its definition: without the ``_`` after a keyword of Python."""
    bare = name.removesuffix("_")
    return bare if keyword.iskeyword(bare) else name


class _Filler(NamedTuple):
    """Sets fields of one message, and names the field where a value does not fit."""

    type_name: str
    keys: Mapping[str, Any]
    null_is_nan: bool = False

    def _refuse(self, path: str, expected: str, value: Any) -> NoReturn:
        given = shown(value) if value is not None else "nothing"
        raise EncodeError(self.type_name, path, f"expected {expected}, got {given}")

    def fill(self, message: Message, value: Any, path: str) -> None:
        """Set the fields of a message from a dict or a list."""
        cls = type(message)
        prefix = f"{path}." if path else ""
        if isinstance(value, dict):
            for name, given in value.items():
                slot = self._slot(cls, name, path)
                member = "" if given is None and slot.kind in _TEXTS else given
                setattr(message, slot.name, self._value(slot, member, f"{prefix}{name}", message))
            return
        if not isinstance(value, list | tuple):
            self._refuse(path, f"{cls._type} as a dict or a list", value)
        fields = self._positional(cls, len(value), path)
        for slot, given in zip(fields, value, strict=True):
            setattr(message, slot.name, self._value(slot, given, prefix + slot.name, message))

    def _positional(self, cls: type[Message], count: int, path: str) -> list[Slot]:
        fields = list(slots(cls))
        if issubclass(cls, Sequenced) and count == len(fields) + 1:
            return [ros1_slots(cls)["seq"], *fields]  # as ROS 1 counts
        if count != len(fields):
            names = ", ".join(shown_name(slot.name) for slot in fields)
            values = {0: "no values", 1: "1 value"}.get(len(fields), f"{len(fields)} values")
            owner = f"of {cls._type} " if path else ""
            what = f"{values} for the fields {owner}({names})" if fields else values
            raise EncodeError(self.type_name, path, f"expected {what}, got {count}")
        return fields

    def _slot(self, cls: type[Message], name: Any, path: str) -> Slot:
        fields_by_name = {shown_name(slot.name): slot for slot in slots(cls)}
        fields_by_name |= ros1_slots(cls)
        if name in fields_by_name:
            return fields_by_name[name]
        fields = (
            near_miss(str(name), fields_by_name)
            or f"; it has {', '.join(fields_by_name) or 'no fields'}"
        )
        owner = cls._type if path else "it"
        raise EncodeError(self.type_name, path, f"{owner} has no field '{name}'{fields}")

    def _value(self, slot: Slot, value: Any, path: str, owner: Message) -> Any:
        if slot.shape == "one":
            return self._element(slot, value, path, getattr(owner, slot.name))
        if isinstance(slot.kind, str) and slot.kind in OCTETS and isinstance(value, str):
            try:
                value = base64.b64decode(value, validate=True)
            except binascii.Error:
                self._refuse(path, "a list of octets, or Base64", value)
        if not isinstance(value, list | tuple | bytes | bytearray) and not hasattr(value, "tolist"):
            kind = slot.kind if isinstance(slot.kind, str) else slot.kind._type
            self._refuse(path, f"a list of {kind}", value)
        if slot.shape == "fixed" and len(value) != slot.size:
            self._refuse(path, f"{slot.size} elements", value)
        if slot.shape == "bounded" and len(value) > slot.size:
            self._refuse(path, f"at most {slot.size} elements", value)
        return self._elements(slot, value, path)

    def _elements(self, slot: Slot, value: Any, path: str) -> Any:
        if isinstance(slot.kind, str) and slot.kind in OCTETS and isinstance(value, bytes):
            return value
        elements = [
            self._element(slot, item, f"{path}[{index}]", None) for index, item in enumerate(value)
        ]
        if isinstance(slot.kind, str):
            if slot.kind in OCTETS:
                return bytes(element & 0xFF for element in elements)
            if slot.kind in ARRAY_CODES:
                code = ARRAY_CODES[slot.kind]
                try:
                    return array(code, bytes(numbers(elements, code)[1]))
                except OverflowError:
                    self._refuse(path, f"elements in the range of {slot.kind}", value)
        return elements

    def _element(self, slot: Slot, value: Any, path: str, before: Any) -> Any:
        kind = slot.kind
        if not isinstance(kind, str):
            return self._message(kind, value, path, before)
        if kind in _TEXTS:
            if isinstance(value, bool | int | float):
                self._refuse(path, f"{kind} (quote it: \"'{value}'\")", value)
            if not isinstance(value, str):
                self._refuse(path, kind, value)
            return value
        if kind in _FLOATS:
            return self._float(kind, value, path)
        if kind == "bool":
            if value not in (True, False, 0, 1) or isinstance(value, float):
                self._refuse(path, kind, value)
            return bool(value)
        return self._integer(kind, value, path)

    def _integer(self, kind: str, value: Any, path: str) -> int:
        if isinstance(value, bytes) and len(value) == 1 and kind in OCTETS:
            return value[0]
        if not hasattr(value, "__index__"):
            self._refuse(path, kind, value)
        number: int = value.__index__()
        low, high = INTEGER_RANGES[kind]
        if not low <= number <= high:
            self._refuse(path, f"{kind} ({low} to {high})", value)
        return number

    def _float(self, kind: str, value: Any, path: str) -> float:
        if isinstance(value, str):
            try:  # YAML 1.1 reads 1e-5 and inf as strings
                return _NOT_FINITE[value] if value in _NOT_FINITE else float(value)
            except ValueError:
                self._refuse(path, kind, value)
        if value is None and self.null_is_nan:
            return math.nan
        if isinstance(value, bool) or not hasattr(value, "__float__"):
            self._refuse(path, kind, value)
        try:
            return float(value)
        except OverflowError:
            self._refuse(path, f"{kind} in its range", value)

    def _message(self, cls: Any, value: Any, path: str, before: Any) -> Message:
        if isinstance(value, Message):
            return value
        if isinstance(value, str) and value:
            return self._named(cls, value, path)
        if isinstance(value, int) and issubclass(cls, TimeValue | DurationValue):
            return self._build(cls, *normal(0, value))  # nanoseconds
        if isinstance(value, float) and issubclass(cls, TimeValue | DurationValue):
            self._refuse(path, "nanoseconds as an integer, {secs: …, nsecs: …} or 'now'", value)
        message: Message = before if isinstance(before, cls) else cls()
        self.fill(message, {} if value in (None, "") else value, path)
        return message

    def _named(self, cls: Any, name: str, path: str) -> Message:
        """Return the message that a name stands for."""
        now = self.keys.get("now")
        if name == "now" and now is not None and issubclass(cls, TimeValue):
            return self._time(cls, now)
        if name == "auto" and now is not None and issubclass(cls, Sequenced):
            header = self._build(cls)
            stamp: Any = header
            stamp.stamp = self._time(type(stamp.stamp), now)
            return header
        value = self.keys.get(name)
        if not isinstance(value, Message):
            names = sorted({*self.keys, *(("auto",) if now is not None else ())})
            choice = f" or one of {', '.join(names)}" if names else ""
            self._refuse(path, cls._type + choice, name)
        return value

    def _time(self, cls: Any, now: Any) -> Message:
        time = now() if callable(now) else now
        return self._build(cls, time.sec, time.nanosec)

    def _build(self, cls: Any, *members: Any) -> Message:
        message: Message = cls(*members)
        return message


_M = TypeVar("_M", bound=Message)

_NO_YAML = (yaml.YAMLError, ValueError, AttributeError, RecursionError)
"""The errors that PyYAML raises: its own, and those of the constructors that it calls."""

Now: TypeAlias = "TimeValue | Callable[[], TimeValue]"
"""The meaning of ``now``: a time, or a function that returns it."""


def to_plain(message: Message) -> dict[str, Any]:
    """Return a message as a dict by field name, of dicts, lists, numbers, strings and bytes."""
    return {
        shown_name(slot.name): _plain(getattr(message, slot.name)) for slot in slots(type(message))
    }


def to_json(message: Message) -> str:
    """Return a message as JSON.

    Sequences of octets are Base64 strings; numbers that JSON lacks are ``"NaN"``, ``"Infinity"``
    and ``"-Infinity"``. :func:`from_json` reads all of them.
    """
    return json.dumps(to_jsonable(to_plain(message)), ensure_ascii=False, allow_nan=False)


def to_jsonable(value: Any) -> Any:
    """Return a message, or any value of a field, as values that JSON has; see `to_json`."""
    if hasattr(value, "_schema"):
        value = {shown_name(name): getattr(value, name) for name in type(value).__slots__}
    if isinstance(value, dict):
        return {name: to_jsonable(element) for name, element in value.items()}
    if isinstance(value, bytes | bytearray):
        return base64.b64encode(value).decode()
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [to_jsonable(element) for element in value]
    if isinstance(value, float) and not math.isfinite(value):
        return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    return value


def to_yaml(message: Message) -> str:
    """Return a message as YAML, as ``rostopic echo`` shows it."""
    return strify_message(message)


def from_plain(
    cls: type[_M], value: Any, now: Now | None = None, *, null_is_nan: bool = False
) -> _M:
    """Build a message from plain values.

    Args:
        cls: Class of the message.
        value: A dict of some fields, a list of all fields in order, or None for the defaults.
        now: Meaning of ``now`` and ``auto``; none when not given.
        null_is_nan: Whether None in a floating-point field is NaN, not an error: JavaScript writes
            numbers that are not finite as ``null``.

    Raises:
        EncodeError: A name is not a field of its message, or a value does not fit its field.
    """
    message = cls()
    if value is not None:
        filler = _Filler(cls._type, {} if now is None else {"now": now}, null_is_nan=null_is_nan)
        filler.fill(message, _sole(value), "")
    return message


def from_json(cls: type[_M], text: str | bytes) -> _M:
    """Build a message from JSON.

    Raises:
        EncodeError: The text is not JSON, or does not fit the class.
    """
    try:
        value = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise EncodeError(cls._type, "", f"not JSON: {error}") from error
    return from_plain(cls, value)


def from_yaml(cls: type[_M], text: str, now: Now | None = None) -> _M:
    """Build a message from YAML: a dict, a list of all fields, or the value of the only field.

    Raises:
        EncodeError: The text is not YAML, or does not fit the class.
    """
    try:
        value = yaml.safe_load(text)
    except _NO_YAML as error:
        reason = " ".join(str(error).split())
        raise EncodeError(cls._type, "", f"not YAML: {reason}") from error
    if value is not None and not isinstance(value, dict | list):
        value = [value]
    return from_plain(cls, value, now)


def _plain(value: Any) -> Any:
    if isinstance(value, Message):
        return to_plain(value)
    if isinstance(value, bytes | bytearray | memoryview):
        return bytes(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(element) for element in value]
    return value
