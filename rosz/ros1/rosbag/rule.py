"""Rules that make a message of one definition a message of another one.

Rules are classes that programs and rule files (``.bmr``) derive from `MessageUpdateRule`. Where
there is none, a rule is written from the two definitions, as text that a person can complete.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, Protocol

from rosz.bags.ros1_form import ros1_definition
from rosz.errors import RoszError
from rosz.idl import parse_message
from rosz.message import SCALAR_CODES, Message
from rosz.ros1.genpy import generate_dynamic

__all__ = (
    "BagMigrationException",
    "MessageUpdateRule",
    "Migrator",
    "Step",
    "clean_name",
    "constants_from_def",
    "get_message_key",
    "get_path_key",
    "migration_default_value",
    "qualified_name",
    "warn",
    "write_half_rule",
    "write_rule",
)

_BUILTIN = frozenset({*SCALAR_CODES, "string", "wstring", "time", "duration"})
_INTEGERS = frozenset(SCALAR_CODES) - {"float32", "float64"}
_FLOATS = ("float32", "float64")
_OCTETS = ("byte", "uint8")
_TYPE = re.compile(r"([^\[]+)(?:\[(\d*)\])?")


class BagMigrationException(Exception):
    """Messages cannot be migrated."""


def warn(text: str) -> None:
    """Write a line to standard error."""
    sys.stderr.write(f"{text}\n")


class _TypeParts(NamedTuple):
    """A type of a field: its base, whether it is an array, and the length of a fixed one."""

    base: str
    is_array: bool
    length: int | None


def _parse(type_text: str) -> _TypeParts:
    match = _TYPE.fullmatch(type_text)
    base, length = match.groups() if match is not None else (type_text, None)
    return _TypeParts(base, length is not None, int(length) if length else None)


# Names and keys.


def clean_name(name: str, top_name: str) -> str:
    """Return the name of a type without ``std_msgs`` and without the package of another type.

    Args:
        name: Name of the type, such as ``std_msgs/Header``.
        top_name: The type whose definition has it.
    """
    parts = name.split("/")
    for package in ("std_msgs", top_name.split("/", maxsplit=1)[0]):
        if package in parts:
            parts.remove(package)
    return "/".join(parts)


def qualified_name(name: str, top_name: str) -> str:
    """Return the name of a type with its package; see `clean_name` for the arguments."""
    short = clean_name(name, top_name)
    if short.count("/") == 1 or _parse(short).base in _BUILTIN:
        return short
    package = "std_msgs" if short == "Header" else top_name.split("/", maxsplit=1)[0]
    return f"{package}/{short}"


def get_message_key(c: Any) -> tuple[str, str] | None:
    """Return type and MD5 sum of a message or a class; None for what is neither."""
    try:
        return c._type, c._md5sum
    except AttributeError:
        return None


def get_path_key(c1: Any, c2: Any) -> tuple[Any, Any]:
    """Return the keys of two classes."""
    return get_message_key(c1), get_message_key(c2)


class Step(Protocol):
    """A step of a path."""

    rule: MessageUpdateRule


class Migrator(Protocol):
    """What a rule uses of the migrator, for the types in its messages."""

    def find_path(self, old_class: Any, new_class: Any) -> Sequence[Step]:
        """Return the steps from one class to another one."""

    def filter_rules_unique(self, rules: Sequence[MessageUpdateRule]) -> list[MessageUpdateRule]:
        """Return the rules, each pair of classes once."""

    def migrate(self, msg_from: Any, msg_to: Any) -> None:
        """Fill a message from one of another class."""

    def migrate_array(self, msg_from_array: Sequence[Any], msg_to_array: Sequence[Any]) -> None:
        """Fill messages from those of another class."""


class MessageUpdateRule:
    """How messages of an old definition become messages of a new one.

    Attributes:
        old_type: Name of the old type, such as ``std_msgs/String``.
        old_full_text: Its definition, with those of the types in it.
        new_type: Name of the new type; another one makes it a rule that renames.
        new_full_text: Its definition.
        migrated_types: Pairs of names of types in them that `update` hands to `migrate`.
        order: Place among the rules of the old type.
        valid: Whether `update` is complete.
        text: Source of a rule that was written from two definitions.
        migrator: The migrator that uses the rule.
        location: Where the rule is defined.
        old_class: Class of the old messages; None if the definition is empty or not well-formed.
        new_class: Class of the new messages.
        sub_rules: Rules for the types in the messages.

    Args:
        migrator: The migrator that uses the rule.
        location: Where the rule is defined.
    """

    old_type = ""
    old_full_text = ""
    new_type = ""
    new_full_text = ""
    migrated_types: Sequence[tuple[str, str]] = ()
    order = -1
    valid = False
    text = ""

    def __init__(self, migrator: Migrator, location: str) -> None:
        self.migrator = migrator
        self.location = location
        self.rename_rule: bool = self.old_type != self.new_type
        self.old_types = _classes(self.old_type, self.old_full_text, location)
        self.new_types = _classes(self.new_type, self.new_full_text, location)
        self.old_class: Any = self.old_types.get(self.old_type)
        self.new_class: Any = self.new_types.get(self.new_type)
        self.old_md5sum: str = getattr(self.old_class, "_md5sum", "")
        self.new_md5sum: str = getattr(self.new_class, "_md5sum", "")
        self.sub_rules: list[MessageUpdateRule] = []
        self.sub_rules_done = False
        self.sub_rules_valid = False

    def find_sub_paths(self) -> None:
        """Find the rules for the types in the messages."""
        self.sub_rules_done = self.sub_rules_valid = True
        own = get_path_key(self.old_class, self.new_class)
        for old_name, new_name in self.migrated_types:
            try:
                pair = self.get_old_class(old_name), self.get_new_class(new_name)
            except KeyError as error:
                warn(f"WARNING: rule [{self.location}] migrates type {error}, which it has not")
                self.sub_rules_valid = False
                continue
            if get_path_key(*pair) == own:
                continue  # a rule that uses itself
            self.sub_rules += [node.rule for node in self.migrator.find_path(*pair)]
            if not all(rule.valid for rule in self.sub_rules):
                warn(f"WARNING: rule [{self.location}] cannot migrate {old_name} to {new_name}")
                self.sub_rules_valid = False
        self.sub_rules = self.migrator.filter_rules_unique(self.sub_rules)

    def get_new_class(self, t: str) -> Any:
        """Return the class of a type in the new definition.

        Raises:
            KeyError: It has no such type.
        """
        return _class_in(self.new_types, t, self.new_type)

    def get_old_class(self, t: str) -> Any:
        """Return the class of a type in the old definition.

        Raises:
            KeyError: It has no such type.
        """
        return _class_in(self.old_types, t, self.old_type)

    def migrate(self, msg_from: Any, msg_to: Any) -> None:
        """Fill a message in the new message from one in the old message.

        Raises:
            BagMigrationException: The types are not in `migrated_types`, or have no valid rules.
        """
        self._check_listed(type(msg_from), type(msg_to))
        self.migrator.migrate(msg_from, msg_to)

    def migrate_array(self, msg_from_array: Any, msg_to_array: Any, msg_to_name: str) -> None:
        """Fill a list in the new message from a list in the old message.

        Args:
            msg_from_array: Messages of the old type.
            msg_to_array: List of the new messages, whose elements are replaced.
            msg_to_name: Name of their type.

        Raises:
            BagMigrationException: The types are not in `migrated_types`, or have no valid rules.
        """
        kind = self.get_new_class(msg_to_name)
        del msg_to_array[:]
        if len(msg_from_array):
            self._check_listed(type(msg_from_array[0]), kind)
            msg_to_array.extend(kind() for _ in msg_from_array)
            self.migrator.migrate_array(msg_from_array, msg_to_array)

    def _check_listed(self, old: Any, new: Any) -> None:
        pair = clean_name(old._type, self.old_type), clean_name(new._type, self.new_type)
        if pair not in [tuple(one) for one in self.migrated_types]:
            raise BagMigrationException(
                f"rule [{self.location}] migrates {pair[0]} to {pair[1]}, which is not in its"
                " migrated_types"
            )

    def get_class_def(self) -> str | None:
        """Return the text of a rule that was written from two definitions; None for others."""
        return self.text or None

    def apply(self, old_msg: Any) -> Any:
        """Return the new message of an old one.

        Raises:
            BagMigrationException: The rule is not complete, or not for such messages.
        """
        reason = ""
        if not self.valid:
            reason = "is not valid"
        elif not self.sub_rules_done:
            reason = "was applied before find_sub_paths()"
        elif not self.sub_rules_valid:
            reason = "has types without valid rules"
        elif get_message_key(old_msg) != get_message_key(self.old_class):
            found, wanted = get_message_key(old_msg), get_message_key(self.old_class)
            reason = f"is for {wanted}, and was applied to {found}"
        if reason:
            raise BagMigrationException(f"rule [{self.location}] {reason}")
        new_msg = self.new_class()
        self.update(old_msg, new_msg)
        return new_msg

    def update(self, old_msg: Any, new_msg: Any) -> None:
        """Fill a new message from an old one; rules define this.

        Raises:
            BagMigrationException: The rule does not define it.
        """
        del old_msg, new_msg
        raise BagMigrationException(f"rule [{self.location}] does not define update()")


def _classes(name: str, text: str, location: str) -> dict[str, type[Message]]:
    if not name:
        return {}
    try:
        return generate_dynamic(name, text)
    except RoszError as error:
        warn(f"ERROR: rule [{location}]: {error}")
        return {}


def _class_in(types: dict[str, type[Message]], name: str, top: str) -> Any:
    package = top.split("/", maxsplit=1)[0]
    for each in (name, f"std_msgs/{name}", f"{package}/{name}"):
        if each in types:
            return types[each]
    raise KeyError(name)


# Writing of rules.


def constants_from_def(core_type: str, msg_def: str) -> set[tuple[str, Any, str]]:
    """Return name, value and type of the constants of a type.

    Args:
        core_type: Name of the type.
        msg_def: Its definition, maybe with those of the types in it.
    """
    text = msg_def.split("=" * 80, maxsplit=1)[0]
    package, _, base = core_type.partition("/")
    spec = parse_message(f"{package}/msg/{base}", text, f"<{core_type}>")
    return {(one.name, one.value, one.type) for one in spec.constants}


def migration_default_value(field_type: str) -> str:
    """Return the source of the value that a field of a type has where the old message has none."""
    base, is_array, length = _parse(field_type)
    if is_array:
        if base in _OCTETS:
            return f"bytes({length})" if length else "b''"
        return "[" + ",".join([migration_default_value(base)] * (length or 0)) + "]"
    if base in _INTEGERS:
        return "0"
    if base in _FLOATS:
        return "0."
    return "''" if base == "string" else f"self.get_new_class('{base}')()"


def write_rule(
    old_class: Any, new_class: Any, renames: dict[str, set[str]]
) -> type[MessageUpdateRule]:
    """Return a rule that copies the fields that both classes have.

    It is valid if these are all, with the same types, and no constant has changed.

    Args:
        old_class: Class of the old messages.
        new_class: Class of the new messages.
        renames: Types that each type may become.
    """
    writer = _Writer(old_class, new_class, renames)
    name = f"update_{old_class._type.replace('/', '_')}_{old_class._md5sum}"
    return _compile(name, old_class, new_class, writer)


def write_half_rule(old_class: Any) -> type[MessageUpdateRule]:
    """Return an invalid rule for messages whose new type is not known."""
    name = f"update__{old_class._type.replace('/', '_')}__{old_class._md5sum}"
    return _compile(name, old_class, None, _Writer(None, None, {}, valid=False))


class _Writer:
    """Writes the body of a rule."""

    def __init__(
        self, old: Any, new: Any, renames: dict[str, set[str]], *, valid: bool = True
    ) -> None:
        self._old, self._new = old, new
        self._renames = renames
        self.valid = valid
        self.migrated: dict[tuple[str, str], None] = {}
        self.lines: list[str] = []
        if new is not None:
            self._write()

    def _write(self) -> None:
        old, new = self._old, self._new
        old_constants, new_constants = _constants(old), _constants(new)
        for name, _, _ in sorted(old_constants - new_constants, key=lambda one: one[0]):
            self._refuse(f"Constant '{name}' has changed")
        left = dict(zip(old.__slots__, old._slot_types, strict=True))
        for field, kind in zip(new.__slots__, new._slot_types, strict=True):
            was = left.pop(field, None)
            reason = (
                "No matching field name in old message"
                if was is None
                else self._copy(field, _parse(was), _parse(kind))
            )
            if reason:
                self._refuse(reason)
                self.lines.append(f"new_msg.{field} = {migration_default_value(kind)}")
        for field in left:
            self._refuse(f"No field to match field {field} from old message")

    def _refuse(self, reason: str) -> None:
        self.valid = False
        self.lines.append(f"#{reason}")

    def _copy(self, field: str, was: _TypeParts, now: _TypeParts) -> str:
        """Write the copying of a field; return why it cannot be copied, or an empty text."""
        if was.is_array != now.is_array:
            return "Could not match array with nonarray"
        if was.length != now.length:
            lengths = [one.length or "variable length" for one in (was, now)]
            return f"Array converted from {lengths[0]} to {lengths[1]}"
        if now.base in _BUILTIN:
            if was.base != now.base:
                return "Primitive type changed"
            self.lines.append(f"new_msg.{field} = old_msg.{field}")
            return ""
        whole = (
            qualified_name(was.base, self._old._type),
            qualified_name(now.base, self._new._type),
        )
        names = clean_name(was.base, self._old._type), clean_name(now.base, self._new._type)
        if whole[0] != whole[1] and whole[1] not in self._renames.get(whole[0], ()):
            return f"No migration path between [{names[0]}] and [{names[1]}]"
        self.migrated[names] = None
        call = (
            f"self.migrate_array(old_msg.{field}, new_msg.{field}, '{now.base}')"
            if now.is_array
            else f"self.migrate(old_msg.{field}, new_msg.{field})"
        )
        self.lines.append(call)
        return ""


def _constants(cls: Any) -> set[tuple[str, Any, str]]:
    spec = parse_message(cls._type_name, cls._text, f"<{cls._type}>")
    return {(one.name, one.value, one.type) for one in spec.constants}


def _compile(name: str, old: Any, new: Any, writer: _Writer) -> type[MessageUpdateRule]:
    new_type, new_text = ("", "") if new is None else (new._type, _quoted(new))
    text = "\n".join(
        [
            f"class {name}(MessageUpdateRule):",
            f'    old_type = "{old._type}"',
            f'    old_full_text = """\n{_quoted(old)}\n"""\n',
            f'    new_type = "{new_type}"',
            f'    new_full_text = """\n{new_text}\n"""\n',
            "    order = 0",
            f"    migrated_types = {_listed(writer.migrated)}\n",
            f"    valid = {writer.valid}\n",
            "    def update(self, old_msg, new_msg):",
            *(f"        {line}" for line in writer.lines),
            "        pass" if all(line.startswith("#") for line in writer.lines) else "",
            "",
        ]
    )
    space: dict[str, Any] = {"MessageUpdateRule": MessageUpdateRule}
    exec(text, space)  # noqa: S102  # the text is made of names and definitions
    made: type[MessageUpdateRule] = space[name]
    made.text = text
    return made


def _quoted(cls: Any) -> str:
    text = ros1_definition(cls).strip()
    return text.replace("\\", "\\\\").replace('"""', '\\"\\"\\"')


def _listed(pairs: Iterable[tuple[str, str]]) -> str:
    rows = "".join(f'\n        ("{old}", "{new}"),' for old, new in pairs)
    return f"[{rows}\n    ]" if rows else "[]"
