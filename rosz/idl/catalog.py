"""Specs by name: reads definitions when they are needed and checks what they refer to."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import msgspec

from rosz.errors import DefinitionError, TypeNotFound, near_miss
from rosz.idl.grammar import parse_message, parse_service
from rosz.idl.spec import PRIMITIVES, Field, MessageSpec, ServiceSpec

__all__ = ("Catalog", "Definition")


class Definition(msgspec.Struct, frozen=True):
    """A text and where it was read."""

    text: str
    path: str


class Catalog:
    """All definitions that can be reached, parsed once each.

    Args:
        find: Gives the definition of a full name (``std_msgs/msg/String``, ``std_srvs/srv/Empty``);
            raises TypeNotFound.
    """

    def __init__(self, find: Callable[[str], Definition]) -> None:
        self._find = find
        self._messages: dict[str, MessageSpec] = {}
        self._services: dict[str, ServiceSpec] = {}
        self._checked: set[str] = set()

    def message(self, name: str) -> MessageSpec:
        """Return the spec of a message, all types in it known to exist.

        Raises:
            TypeNotFound: There is no such type.
            DefinitionError: It, or a type in it, is not well-formed, is missing, or holds itself.
        """
        spec = self._message(name)
        self._check(spec, ())
        return spec

    def service(self, name: str) -> ServiceSpec:
        """Return the spec of a service, all types in it known to exist.

        Raises:
            TypeNotFound: There is no such type.
            DefinitionError: It, or a type in it, is not well-formed, is missing, or holds itself.
        """
        if name not in self._services:
            definition = self._find(name)
            spec = parse_service(name, definition.text, definition.path)
            self._check(spec.request, ())
            self._check(spec.response, ())
            self._services[name] = spec
        return self._services[name]

    def below(self, spec: MessageSpec) -> dict[str, MessageSpec]:
        """Return all message types that a message holds, at any depth, by name."""
        found: dict[str, MessageSpec] = {}
        rest = [spec]
        while rest:
            for nested in self.nested(rest.pop()):
                if nested.name not in found:
                    found[nested.name] = nested
                    rest.append(nested)
        return found

    def nested(self, spec: MessageSpec) -> Iterator[MessageSpec]:
        """Yield the specs of the fields that are messages."""
        return (self._message(field.type.base) for field in spec.fields if not field.type.primitive)

    def _message(self, name: str) -> MessageSpec:
        if name not in self._messages:
            definition = self._find(name)
            self._messages[name] = parse_message(name, definition.text, definition.path)
        return self._messages[name]

    def _check(self, spec: MessageSpec, above: tuple[str, ...]) -> None:
        if spec.name in self._checked:
            return
        for field in spec.fields:
            if not field.type.primitive:
                self._check(self._nested(spec, field, (*above, spec.name)), (*above, spec.name))
        self._checked.add(spec.name)

    def _nested(self, spec: MessageSpec, field: Field, above: tuple[str, ...]) -> MessageSpec:
        base = field.type.base
        if base in above:
            chain = " → ".join((*above[above.index(base) :], base))
            raise DefinitionError(
                f"a message cannot hold itself: {chain}", spec.path, field.line, field.column
            )
        try:
            return self._message(base)
        except TypeNotFound as error:
            written = field.type.written
            told = "/" in written or str(error).endswith("?")
            hint = "" if told else near_miss(written.lower(), PRIMITIVES)
            raise DefinitionError(
                f"type '{written}' of field '{field.name}': {error}{hint}",
                spec.path,
                field.line,
                field.column,
            ) from error
