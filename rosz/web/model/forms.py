"""Forms made of message types: fields that a page shows one by one, and the same as YAML text.

The text is what counts. It may leave fields out and may hold ``now`` and ``auto``, as on a command
line of ROS 1; a field that a page changes is written into it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any, Literal

import msgspec
import yaml

from rosz.errors import DefinitionError, EncodeError, UsageError, YamlError
from rosz.idl import Constant, MessageSpec, parse_message
from rosz.introspect import make_message, read_arguments
from rosz.message import INTEGER_RANGES, Slot, shown_name, slot_type, slots, to_plain
from rosz.params.yaml import read_plain
from rosz.time import DurationValue, TimeValue

_WIDE = frozenset({"int64", "uint64"})
"""Types whose values a browser's numbers do not hold."""
_LINE = 90
_WORD = re.compile(r"\w+")
_CONSTANT = re.compile(r"[\w/<=]+\s+(\w+)\s*=")
_EDITORS: dict[str, Literal["bool", "text"]] = {"bool": "bool", "string": "text", "wstring": "text"}


class FormField(msgspec.Struct, frozen=True):
    """One field of a form.

    Attributes:
        path: Names of the fields that lead to it, and its own.
        kind: How it is edited; ``yaml`` is a value that is written as YAML on one line, ``message``
            a group of fields.
        type: Type as ROS 1 spells it.
        hint: The comment of its definition.
        low: Smallest value of an integer.
        high: Largest value of an integer.
        choices: Names of values that the definition has constants for.
        fields: Fields of a group.
    """

    path: tuple[str, ...]
    kind: Literal["bool", "integer", "number", "text", "choice", "yaml", "message"]
    type: str
    hint: str = ""
    low: int | None = None
    high: int | None = None
    choices: dict[Any, str] = {}
    fields: tuple[FormField, ...] = ()

    @property
    def name(self) -> str:
        """Name of the field."""
        return self.path[-1]

    @property
    def size(self) -> int:
        """Number of fields that are edited in it."""
        return sum(field.size for field in self.fields) if self.kind == "message" else 1


def form_of(cls: type[Any]) -> str:
    """Return the fields of a message with their default values, as YAML."""
    return _as_yaml(cls()) if slots(cls) else ""


def read_form(cls: type[Any], text: str, now: int) -> Any:
    """Return the message of a form; fields that are left out have their default value.

    Args:
        cls: Class of the message.
        text: A dictionary of fields in YAML.
        now: ROS time in nanoseconds, for ``now`` and ``auto``.

    Raises:
        UsageError: The text is not YAML.
        EncodeError: A value does not fit.
    """
    return make_message(cls, [_document(text)], now)


def _document(text: str) -> Any:
    given = read_arguments([text.strip() or "{}"])
    return next((document for document in given if document is not None), {})


def form_fields(cls: type[Any], path: tuple[str, ...] = ()) -> tuple[FormField, ...]:
    """Return the fields of a message class for a form."""
    spec = _spec(cls)
    return tuple(_field(slot, spec, path) for slot in slots(cls))


def _spec(cls: type[Any]) -> MessageSpec | None:
    """Return the definition of a class; None if its text is not a whole one."""
    try:
        return parse_message(cls._type_name, cls._text)
    except DefinitionError:
        return None


def _field(slot: Slot, spec: MessageSpec | None, above: tuple[str, ...]) -> FormField:
    name = shown_name(slot.name)
    path, written, hint = (*above, name), slot_type(slot), _hint(spec, name)
    kind = slot.kind
    if not isinstance(kind, str):
        if slot.shape != "one" or issubclass(kind, TimeValue | DurationValue):
            return FormField(path, "yaml", written, hint)
        return FormField(path, "message", written, hint, fields=form_fields(kind, path))
    if slot.shape != "one" or kind in _WIDE:
        return FormField(path, "yaml", written, hint)
    if choices := _choices(spec, name, kind):
        return FormField(path, "choice", written, hint, choices=choices)
    if kind in INTEGER_RANGES:
        return FormField(path, "integer", written, hint, *INTEGER_RANGES[kind])
    return FormField(path, _EDITORS.get(kind, "number"), written, hint)


def _hint(spec: MessageSpec | None, name: str) -> str:
    """Return the comment in the line of a field."""
    if spec is None:
        return ""
    lines = spec.text.splitlines()
    comments = (lines[field.line - 1] for field in spec.fields if field.name == name and field.line)
    return next(comments, "").partition("#")[2].strip()


def _choices(spec: MessageSpec | None, name: str, kind: str) -> dict[Any, str]:
    """Return the constants that are meant for a field.

    A definition does not say which field its constants are for. They are those that have the name
    of the field in theirs, those below a comment that names it, or those of its type if it is the
    only field of that type.
    """
    if spec is None or kind in ("bool", "float32", "float64"):
        return {}
    constants = [constant for constant in spec.constants if _fits(constant, kind)]
    chosen = [constant for constant in constants if f"_{name.upper()}_" in f"_{constant.name}"]
    if not chosen:
        headings = _headings(spec.text)
        chosen = [
            constant
            for constant in constants
            if name in _WORD.findall(headings.get(constant.name, ""))
        ]
    if not chosen:
        same = [field for field in spec.fields if field.type.base == kind]
        chosen = (
            [constant for constant in constants if constant.type == kind] if len(same) == 1 else []
        )
    names: dict[Any, list[str]] = {}
    for constant in chosen:
        names.setdefault(constant.value, []).append(constant.name)
    return {value: ", ".join(alike) for value, alike in names.items()}


def _fits(constant: Constant, kind: str) -> bool:
    """Return whether a constant is a value of a type; uint8 constants of int32 fields are usual."""
    if kind in INTEGER_RANGES and isinstance(constant.value, int):
        low, high = INTEGER_RANGES[kind]
        return low <= constant.value <= high
    return constant.type == kind


def _headings(text: str) -> dict[str, str]:
    """Return the comment above the block of each constant of a definition."""
    headings: dict[str, str] = {}
    heading, comment = "", False
    for line in map(str.strip, text.splitlines()):
        if line.startswith("#"):
            heading, comment = f"{heading} {line}" if comment else line, True
            continue
        comment = False
        constant = _CONSTANT.match(line)
        if constant:
            headings[constant[1]] = heading
        else:
            heading = ""
    return headings


class Form:
    """The fields of one message as a page edits them.

    Args:
        cls: Class of the message.

    Attributes:
        text: The message as YAML.
        fault: Why the text is not a message; empty if it is one.
        fields: The fields.
    """

    def __init__(self, cls: type[Any]) -> None:
        self.text: str = form_of(cls)
        self.fault: str = ""
        self.fields: tuple[FormField, ...] = form_fields(cls)
        self._cls = cls
        self._message: Any = cls()
        self._given: Any = to_plain(self._message)

    def write(self, text: str, now: int) -> None:
        """Take a text. If it is not a message, the fields keep their values.

        Args:
            text: The message as YAML.
            now: ROS time in nanoseconds, for ``now`` and ``auto``.
        """
        self.text, self.fault = text, ""
        try:
            given = _document(text)
            self._message = make_message(self._cls, [given], now)
        except (UsageError, EncodeError) as error:
            self.fault = str(error)
        else:
            self._given = given if isinstance(given, dict) else to_plain(self._message)

    def value(self, field: FormField) -> Any:
        """Return the value of a field for its editor; text if it is edited as YAML."""
        if field.kind != "yaml":
            return self._at(field.path)
        given = self._given
        for name in field.path:
            given = given.get(name) if isinstance(given, dict) else None
        if isinstance(given, str | int):  # a name such as "now"; nanoseconds
            return str(given)
        return _as_yaml(self._at(field.path), flow=True)

    def _at(self, path: Sequence[str]) -> Any:
        value = self._message
        for name in path:
            names = {shown_name(slot.name): slot.name for slot in slots(type(value))}
            value = getattr(value, names[name])
        return value

    def change(self, field: FormField, value: Any, now: int) -> str:
        """Write a field into the text, and return why that is not possible; empty if it is.

        Args:
            field: The field.
            value: The value; text if the field is edited as YAML.
            now: ROS time in nanoseconds, for ``now`` and ``auto``.
        """
        if self.fault:
            return f"the text is not valid, so no field can be written into it: {self.fault}"
        if field.kind == "yaml":
            try:
                value = next(iter(read_plain(value, f"<{'.'.join(field.path)}>")), None)
            except YamlError as error:
                return str(error)
        elif field.kind == "integer" and isinstance(value, float) and value.is_integer():
            value = int(value)
        before = self.text
        self.write(_as_yaml(_with(self._cls, self._given, self._message, field.path, value)), now)
        fault, self.fault = self.fault, ""
        if fault:
            self.text = before
        return fault


def _with(cls: type[Any], given: Any, message: Any, path: Sequence[str], value: Any) -> Any:
    """Return a dictionary of fields with another value at a path, in the order of the type."""
    plain: dict[str, Any] = dict(given) if isinstance(given, dict) else to_plain(message)
    name, *rest = path
    if rest:
        slot = next(slot for slot in slots(cls) if shown_name(slot.name) == name)
        inner: Any = slot.kind
        plain[name] = _with(inner, plain.get(name, {}), getattr(message, slot.name), rest, value)
    else:
        plain[name] = value
    order = [shown_name(slot.name) for slot in slots(cls)]
    return {name: plain[name] for name in order if name in plain} | plain


def _as_yaml(value: Any, *, flow: bool | None = None) -> str:
    """Return a value as YAML, with the innermost collections, or all, on one line each."""
    text: str = yaml.safe_dump(
        _listed(value),
        sort_keys=False,
        default_flow_style=flow,
        allow_unicode=True,
        width=math.inf if flow else _LINE,
    )
    return text.rstrip("\n").removesuffix("\n...")


def _listed(value: Any) -> Any:
    """Return a value with lists in place of arrays and bytes, and dictionaries of messages."""
    if isinstance(value, TimeValue | DurationValue):
        return {"secs": value.secs, "nsecs": value.nsecs}
    if hasattr(value, "_schema"):
        value = {shown_name(slot.name): getattr(value, slot.name) for slot in slots(type(value))}
    if isinstance(value, dict):
        return {name: _listed(item) for name, item in value.items()}
    if hasattr(value, "tolist"):
        return value.tolist()
    return [_listed(item) for item in value] if isinstance(value, bytes | list | tuple) else value
