"""Writes the source of message, service and action classes."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from typing import Any

from rosz.idl.catalog import Catalog
from rosz.idl.hashes import action_hash, message_hash, message_md5, service_hash, service_md5
from rosz.idl.spec import (
    ACTION_MESSAGES,
    ACTION_SERVICES,
    ActionSpec,
    Field,
    FieldType,
    MessageSpec,
    Scalar,
    ServiceSpec,
    attribute,
    class_name,
)
from rosz.message import ARRAY_CODES, CDR, OCTETS, DecoderSource, EncoderSource, Slot, SourceNames
from rosz.names import short_type

_TIME = "builtin_interfaces/msg/Time"
_DURATION = "builtin_interfaces/msg/Duration"
_HEADER = "std_msgs/msg/Header"

BASES = {
    _TIME: "_TimeValue, _Message",
    _DURATION: "_DurationValue, _Message",
    _HEADER: "_Sequenced",
}
"""Base classes of types that ROS 1 gives more than their fields."""

_ROS1_FIELDS = {
    "sensor_msgs/msg/CameraInfo": {"D": "d", "K": "k", "R": "r", "P": "p"},
    "stereo_msgs/msg/DisparityImage": {"T": "t"},
}
"""Fields that ROS 1 spells in another way, from its name to ours."""

_ROS2_DEFAULTS = {"geometry_msgs/msg/Quaternion": {"w"}, "sensor_msgs/msg/NavSatStatus": {"status"}}
"""Fields that have a default in ROS 2's definition and zero in ROS 1's."""

_PYTHON = {
    "bool": "bool",
    "float32": "float",
    "float64": "float",
    "string": "str",
    "wstring": "str",
}

_WIDTH = 100
_TOKEN = re.compile(r'"(?:\\.|[^"\\])*"|[\[\](){}]|, |[^"\[\](){},]+|,')
_TARGETS = re.compile(r"( *)(\w+(?:, \w+)+) = (.+)")
_SURROGATE = re.compile("[\ud800-\udfff]")
_CONDITION = re.compile(r"( *)if (.+ or .+):")


class ModuleNames(SourceNames):
    """The names that a generated module imports and defines, besides its own classes.

    Args:
        own: Full names of the types whose classes the module defines.
        catalog: Specs of all types in them.
    """

    def __init__(self, own: list[str], catalog: Catalog) -> None:
        super().__init__(CDR)
        self._catalog = catalog
        self._own = {class_name(name): name for name in own}
        self._imports: dict[str, str] = {}
        self._slots: dict[str, tuple[Slot, ...]] = {}

    @property
    def imports(self) -> dict[str, str]:
        """Classes of other modules, from full type name to name in this module."""
        return dict(self._imports)

    def class_of(self, name: str) -> str:
        """Return the name of the class of a type in this module."""
        plain = class_name(name)
        if self._own.get(plain) == name:
            return plain
        if name not in self._imports:
            taken = set(self._imports.values()) | set(self._own)
            self._imports[name] = plain if plain not in taken else name.replace("/", "_")
        return self._imports[name]

    def fields(self, kind: MessageSpec) -> tuple[Slot, ...]:
        """Return the fields of a message; those that are messages have specs as their kinds."""
        if kind.name in self._slots:
            return self._slots[kind.name]
        slots = []
        for field in kind.fields:
            given = field.type
            below: Any = given.base if given.primitive else self._catalog.message(given.base)
            slots.append(Slot(attribute(field.name), below, given.bound, given.shape, given.size))
        return self._slots.setdefault(kind.name, tuple(slots))

    def cls(self, kind: MessageSpec) -> str:
        """Return the name of the class of a message."""
        return self.class_of(kind.name)

    def make(self, kind: MessageSpec, values: Sequence[str]) -> str:
        """Return an expression that makes a message, by the expressions of its fields."""
        unsent = ["0"] if kind.name == _HEADER else []  # the sequence number
        return f"{self.cls(kind)}({', '.join([*unsent, *values])})"


class ClassNames:
    """The names of a module as the body of a class sees them, where a field may hide a class.

    Args:
        module: Names of the module.
        hidden: Names that the class defines.

    Attributes:
        module: Names of the module.
    """

    def __init__(self, module: ModuleNames, hidden: set[str]) -> None:
        self._hidden = hidden
        self.module = module

    def cls(self, name: str) -> str:
        """Return the name of a message class; a second one where the first is hidden."""
        plain = self.module.class_of(name)
        return self.module.define("_c", plain) if plain in self._hidden else plain


def message_class(spec: MessageSpec, catalog: Catalog, module: ModuleNames) -> str:
    """Return the source of a message class.

    Args:
        spec: The message.
        catalog: Specs of the types in it.
        module: Names of the module that the class will be part of.
    """
    name = class_name(spec.name)
    renamed = _ros1_names(spec)
    plain = "_Stamped" if _is_stamped(spec) else "_Message"
    base = "_Renamed" if renamed else BASES.get(spec.name, plain)
    fields = {attribute(field.name) for field in spec.fields}
    names = ClassNames(module, fields | {attribute(constant.name) for constant in spec.constants})
    ros2 = _ROS2_DEFAULTS.get(spec.name, set())
    body = [_field(field, names, ros2=field.name in ros2) for field in spec.fields]
    body += _ros1_fields(renamed)
    body += [
        f"{attribute(constant.name)} = {_literal(constant.value)}" for constant in spec.constants
    ]
    body += _names(spec.name, message_hash(spec, catalog), message_md5(spec, catalog), spec.text)
    body += [f"_schema = {_schema(spec, names)}", ""]
    body += _codec(
        "_encode(m: _Any) -> bytes", EncoderSource(spec, module).lines(), "_plain(m, {0})", name
    )
    body += [""]
    body += _codec(
        f"_decode(data: bytes) -> {name}",
        DecoderSource(spec, module).lines(),
        "_explain(data, {0})",
        name,
    )
    return "\n".join([f"class {name}({base}):", *_docstring(spec.text), *_indented(body)])


def service_class(spec: ServiceSpec, catalog: Catalog) -> str:
    """Return the source of a service class, which refers to those of its two messages."""
    name = class_name(spec.name)
    halves = {"Request": spec.request, "Response": spec.response}
    body = [f"{role} = {class_name(half.name)}" for role, half in halves.items()]
    body += _names(spec.name, service_hash(spec, catalog), service_md5(spec, catalog), spec.text)
    return "\n".join([f"class {name}(_Service):", *_docstring(spec.text), *_indented(body)])


def action_class(spec: ActionSpec, catalog: Catalog) -> str:
    """Return the source of an action class, which refers to those of its messages and services."""
    name = class_name(spec.name)
    parts = (*ACTION_MESSAGES, *ACTION_SERVICES)
    body = [f"{part} = {class_name(f'{spec.name}_{part}')}" for part in parts]
    body += [
        f'_type_name = "{spec.name}"',
        f'_type_hash = "{action_hash(spec, catalog)}"',
        *_text(spec.text),
    ]
    return "\n".join([f"class {name}(_Action):", *_docstring(spec.text), *_indented(body)])


def _indented(lines: list[str]) -> list[str]:
    return [each for line in lines for each in _wrap(f"    {line}" if line else "")]


def _docstring(text: str) -> list[str]:
    """Return the comment at the head of a definition as the lines of a docstring."""
    head: list[str] = []
    for line in text.splitlines():
        words = line.strip("# \t")
        if not line.startswith("#") or not words:
            break
        head.append(f"    {_escape(words)}")
    if not head:
        return []
    head[0] = f'    """{head[0].lstrip()}'
    head[-1] += '"""'
    return [*head, ""]


def _escape(text: str) -> str:
    """Return a line of a comment as it stands in a docstring; quotes become single ones."""
    return "".join(
        letter
        if letter.isprintable() and letter != "\\"
        else letter.encode("unicode_escape").decode()
        for letter in text.replace('"', "'")
    )


def _names(name: str, type_hash: str, md5: str, text: str) -> list[str]:
    return [
        f'_type = "{short_type(name)}"',
        f'_type_name = "{name}"',
        f'_type_hash = "{type_hash}"',
        f'_md5sum = "{md5}"',
        *_text(text),
    ]


def _text(text: str) -> list[str]:
    """Return the lines of a readable literal of a definition."""
    parts = [_literal(line) for line in text.splitlines(keepends=True)]
    if len(parts) <= 1:
        return [f"_text = {parts[0] if parts else _literal('')}"]
    return ["_text = (", *(f"    {part}" for part in parts), ")"]


def _codec(signature: str, lines: list[str], fallback: str, name: str) -> list[str]:
    code = ["@staticmethod", f"def {signature}:", "    try:"]
    code += [f"        {line}" for line in lines]
    return [*code, "    except _FAULTS:", f"        return {fallback.format(name)}"]


def _is_stamped(spec: MessageSpec) -> bool:
    """Return whether a message begins with a header, which ROS 1 fills in."""
    first = spec.fields[0] if spec.fields else None
    return first is not None and (first.name, first.type.base, first.type.shape) == (
        "header",
        _HEADER,
        "one",
    )


def _ros1_names(spec: MessageSpec) -> dict[str, str]:
    """Return the fields that ROS 1 spells in another way, unless the text is ROS 1's."""
    names = {field.name for field in spec.fields}
    renamed = _ROS1_FIELDS.get(spec.name, {})
    return renamed if names.issuperset(renamed.values()) and names.isdisjoint(renamed) else {}


def _ros1_fields(renamed: dict[str, str]) -> list[str]:
    lines = [f"_ros1_names = {json.dumps(renamed)}"] if renamed else []
    for old, new in renamed.items():
        lines += ["", "@property", f"def {old}(self) -> _Any:", f"    return self.{new}"]
        lines += [
            "",
            f"@{old}.setter",
            f"def {old}(self, value: _Any) -> None:",
            f"    self.{new} = value",
        ]
    return [*lines, ""] if lines else []


def _schema(spec: MessageSpec, names: ClassNames) -> str:
    entries = []
    for field in spec.fields:
        kind = field.type
        bound = f"<={kind.bound}" if kind.bound else ""
        base = f'"{kind.base}{bound}"' if kind.primitive else names.cls(kind.base)
        entries.append(f'("{attribute(field.name)}", {base}, "{kind.suffix}")')
    return f"({', '.join(entries)}{',' * (len(entries) == 1)})"


def _field(field: Field, names: ClassNames, *, ros2: bool) -> str:
    default = _default(field, names)
    if ros2 and field.default:
        made = names.module.define("_d", f"_Ros2Default({default})")
        default = f"_field(default_factory={made})"
    return f"{attribute(field.name)}: {_annotation(field.type, names)} = {default}"


def _annotation(kind: FieldType, names: ClassNames) -> str:
    element = _python(kind) if kind.primitive else names.cls(kind.base)
    if kind.shape == "one":
        return element
    if kind.base in OCTETS:
        return "_Bytes"
    return f"_Array[{element}]" if kind.base in ARRAY_CODES else f"list[{element}]"


def _default(field: Field, names: ClassNames) -> str:
    if isinstance(field.default, tuple):
        return _default_list(field.type, field.default, names)
    if field.default is not None:
        return _literal(field.default)
    if field.type.shape == "one":
        return _zero(field.type, names)
    return _zeros(field.type, names)


def _zero(kind: FieldType, names: ClassNames) -> str:
    if not kind.primitive:
        return f"_field(default_factory={names.cls(kind.base)})"
    return {"str": '""', "float": "0.0", "bool": "False", "int": "0"}[_python(kind)]


def _zeros(kind: FieldType, names: ClassNames) -> str:
    fixed = kind.size if kind.shape == "fixed" else 0
    if kind.base in OCTETS:
        return names.module.define("_z", f"bytes({fixed})") if fixed else 'b""'
    if not fixed:
        return "[]"
    if kind.base in ARRAY_CODES:
        make = f"([{_zero(kind, names)}] * {fixed}).copy"
        return f"_field(default_factory={names.module.define('_d', make)})"
    if kind.primitive:
        return f"_field(default_factory=lambda: [{_zero(kind, names)}] * {fixed})"
    return f"_field(default_factory=lambda: [{names.cls(kind.base)}() for _ in range({fixed})])"


def _python(kind: FieldType) -> str:
    return _PYTHON.get(kind.base, "int")


def _default_list(kind: FieldType, values: tuple[Scalar, ...], names: ClassNames) -> str:
    listed = f"[{', '.join(_literal(value) for value in values)}]"
    if kind.base in OCTETS:
        return names.module.define("_z", repr(bytes(int(value) & 0xFF for value in values)))
    return f"_field(default_factory=lambda: {listed})"


def _literal(value: object) -> str:
    if isinstance(value, float) and not math.isfinite(value):
        return "_nan" if math.isnan(value) else "_inf" if value > 0 else "-_inf"
    if not isinstance(value, str):
        return repr(value)
    text = json.dumps(value, ensure_ascii=False)
    return _SURROGATE.sub(lambda half: f"\\u{ord(half[0]):x}", text)


def _wrap(line: str) -> list[str]:
    """Break a line that is too long, at ``or`` or at commas inside brackets."""
    if len(line) <= _WIDTH or line.lstrip().startswith(('"', "#")):
        return [line]
    condition = _CONDITION.fullmatch(line)
    if condition:
        first, *rest = condition[2].split(" or ")
        indent = condition[1]
        parts = [f"{indent}    {first}", *(f"{indent}    or {part}" for part in rest)]
        return [f"{indent}if (", *parts, f"{indent}):"]
    targets = _TARGETS.fullmatch(line)
    if targets:  # a tuple without brackets gets some
        line = f"{targets[1]}({targets[2]}) = {targets[3]}"
    indent = " " * (len(line) - len(line.lstrip()) + 4)
    lines: list[str] = []
    current: list[tuple[str, int]] = []
    for chunk in _chunks(line):
        current.append(chunk)
        while len(current) > 1 and sum(len(text) for text, _ in current) > _WIDTH:
            # Behind a piece as far outside as possible, and of these the last.
            cuts = range(1, len(current))
            cut = min(cuts, key=lambda cut: (current[cut - 1][1], -cut))
            lines.append("".join(text for text, _ in current[:cut]).rstrip())
            current = [(indent, 99), *current[cut:]]
            if len(current) == 2:  # noqa: PLR2004  # the indentation and one piece: as it is
                break
    return [*lines, "".join(text for text, _ in current)]


def _chunks(line: str) -> list[tuple[str, int]]:
    """Return the pieces of a line between commas, each with the bracket depth at its end."""
    chunks: list[tuple[str, int]] = []
    current = ""
    depth = 0
    for part in _TOKEN.findall(line):
        current += part
        if len(part) == 1:
            depth += (part in "([{") - (part in ")]}")
        elif part == ", " and depth:
            chunks.append((current, depth))
            current = ""
    return [*chunks, (current, 99)]
