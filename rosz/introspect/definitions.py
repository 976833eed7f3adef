"""Definitions of messages and services, as rosmsg and rossrv show them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import msgspec

from rosz.errors import TypeNotFound, UsageError, near_miss
from rosz.idl import Catalog, MessageSpec, full_name, identity
from rosz.names import short_type
from rosz.typestore import Kind, TypeStore

_PRIMITIVE_IN_ROS1 = {
    "builtin_interfaces/msg/Time": "time",
    "builtin_interfaces/msg/Duration": "duration",
}
_HEADER = "std_msgs/msg/Header"


class TypeSummary(msgspec.Struct, frozen=True):
    """A type with its hashes and fields.

    Attributes:
        name: Name as ROS 1 spells it.
        type_name: Full name.
        md5: Hash of ROS 1.
        hash: Hash of ROS 2, which is part of the keys of topics of the type.
        parts: Types by field name, of the message or of request and response.
        constants: Values by constant name, of the same parts.
        text: Text of the definition.
    """

    name: str
    type_name: str
    md5: str
    hash: str
    parts: list[dict[str, str]]
    constants: list[dict[str, Any]]
    text: str


class Definitions:
    """The definitions of one kind.

    Args:
        store: Types by name.
        kind: ``msg``, ``srv`` or ``action``.
    """

    def __init__(self, store: TypeStore, kind: Kind) -> None:
        self._store = store
        self._kind = kind
        self._catalog = Catalog(store.definition)

    def find(self, name: str) -> list[str]:
        """Return the full names that a name stands for: one, or all of that base name.

        Args:
            name: ``pkg/Name``, ``pkg/msg/Name``, or ``Name`` alone; a suffix ``.msg`` is ignored.

        Raises:
            TypeNotFound: The type does not exist.
            UsageError: The name is not valid for a type.
        """
        name = name.removesuffix(f".{self._kind}")
        if "::" in name or "." in name:
            raise UsageError(f"'{name}' is not a type; expected a form such as 'std_msgs/String'")
        if "/" not in name:
            types = self._store.names(self._kind)
            matching = [type_name for type_name in types if type_name.rpartition("/")[2] == name]
            if not matching:
                bases = {type_name.rpartition("/")[2] for type_name in types}
                raise TypeNotFound(name, f"no package has it{near_miss(name, bases)}")
            return [full_name(type_name, self._kind) for type_name in matching]
        package, _, rest = name.partition("/")
        full = f"{package}/{self._kind}/{rest.removeprefix(f'{self._kind}/')}"
        try:
            self._store.definition(full)
        except (TypeNotFound, ValueError):  # the latter for too many slashes
            # The store raises an error that says why.
            store = self._store
            {"msg": store.message, "srv": store.service, "action": store.action}[self._kind](name)
        return [full]

    def show(self, name: str) -> str:
        """Return a definition with the fields of the types in it, as ``rosmsg show`` prints it."""
        return "---\n".join(
            "".join(f"{line}\n" for line in self._lines(part, ""))
            for part in self._catalog.parts(name)
        )

    def _lines(self, spec: MessageSpec, indent: str) -> Iterator[str]:
        for constant in spec.constants:
            yield f"{indent}{constant.type} {constant.name}={constant.text}"
        if spec.name == _HEADER and all(field.name != "seq" for field in spec.fields):
            yield f"{indent}uint32 seq"  # not on the wire; receivers set it
        for field in spec.fields:
            yield f"{indent}{_written(field.type)} {field.name}"
            if not field.type.primitive and field.type.base not in _PRIMITIVE_IN_ROS1:
                yield from self._lines(self._catalog.message(field.type.base), f"{indent}  ")

    def text(self, name: str) -> str:
        """Return the text of a definition.

        Raises:
            RoszError: The definition cannot be read.
        """
        return self._store.definition(name).text

    def md5(self, name: str) -> str:
        """Return the hash of a type in ROS 1."""
        return identity(name, self._catalog)[1]

    def hash(self, name: str) -> str:
        """Return the hash of a type in ROS 2."""
        return identity(name, self._catalog)[0]

    def summary(self, name: str) -> TypeSummary:
        """Return a type with its hashes and fields.

        Raises:
            RoszError: The definition, or one that it refers to, is missing or not well-formed.
        """
        parts = self._catalog.parts(name)
        type_hash, md5 = identity(name, self._catalog)
        return TypeSummary(
            name=short_type(name),
            type_name=name,
            md5=md5,
            hash=type_hash,
            parts=[{field.name: _written(field.type) for field in part.fields} for part in parts],
            constants=[
                {constant.name: constant.value for constant in part.constants} for part in parts
            ],
            text=self.text(name),
        )


def _written(kind: Any) -> str:
    """Return the type of a field as ROS 1 spells it."""
    if kind.primitive:
        base = kind.base + (f"<={kind.bound}" if kind.bound else "")
    else:
        base = _PRIMITIVE_IN_ROS1.get(kind.base) or short_type(kind.base)
    return f"{base}{kind.suffix}"
