"""The names in generated code: local variables, and the values of its module."""

from __future__ import annotations

import builtins
import keyword
import re
from collections.abc import Sequence
from typing import Any

from rosz.message.layout import CDR, ByteLayout
from rosz.message.schema import Slot

_TAKEN = frozenset({*dir(builtins), *keyword.kwlist, *keyword.softkwlist, "data", "m", "out"})
_RESERVED = re.compile(r"[befhkmnpq][0-9]*")
"""Names that generated code uses for its own variables."""


class LocalNames:
    """Names of the local variables in one generated function, short and distinct."""

    def __init__(self) -> None:
        self._taken = set(_TAKEN)
        self._numbers = 0

    def name(self, base: str) -> str:
        """Return a new name that resembles the name of a field."""
        if base[0].isupper():  # classes have such names
            base = f"the_{base}"
        name = base
        number = 1
        while name in self._taken or _RESERVED.fullmatch(name):
            number += 1
            name = f"{base}_{number}"
        self._taken.add(name)
        return name

    def fresh(self, prefix: str) -> str:
        """Return a new reserved name."""
        self._numbers += 1
        return f"{prefix}{self._numbers}"


class SourceNames:
    """The names that a generated module imports and defines.

    Subclasses know the message types, which are opaque here.

    Args:
        layout: The byte layout that its code encodes and decodes.

    Attributes:
        layout: The byte layout.
        runtime: Names of ``rosz.message.runtime`` that the module imports.
    """

    def __init__(self, layout: ByteLayout) -> None:
        self.layout = layout
        self._defined: dict[str, str] = {}
        self._fresh: list[str] = []
        self._lists: dict[str, str] = {}
        self.runtime: set[str] = set()

    def fields(self, kind: Any) -> tuple[Slot, ...]:
        """Return the fields of a message type, in the order of the layout."""
        raise NotImplementedError

    def cls(self, kind: Any) -> str:
        """Return the name of the class of a message type."""
        raise NotImplementedError

    def make(self, kind: Any, values: Sequence[str]) -> str:
        """Return an expression that makes a message, by the expressions of its fields."""
        raise NotImplementedError

    def use(self, name: str) -> str:
        """Import a name of ``rosz.message.runtime``, and return its name in this module."""
        self.runtime.add(name)
        return f"_{name}"

    def define(self, prefix: str, value: str) -> str:
        """Return the name of a module-level value, defined at its first use."""
        if value not in self._defined:
            number = sum(name.startswith(prefix) for name in self._defined.values()) + 1
            self._defined[value] = f"{prefix}{number}"
            self._fresh.append(f"{prefix}{number} = {value}")
        return self._defined[value]

    def string_list(self, slot: Slot, place: str) -> str:
        """Return the name of the StringList of a field, which its encoder and decoder share."""
        if place not in self._lists:
            limits = []
            if slot.shape == "fixed":
                limits.append(f"size={slot.size}")
            if slot.shape == "bounded":
                limits.append(f"most={slot.size}")
            if slot.bound:
                limits.append(f"bound={slot.bound}")
            if self.layout != CDR:
                limits.append(f"layout={self.use('ROS1')}")
            name = self._lists[place] = f"_s{len(self._lists) + 1}"
            self._fresh.append(f"{name} = {self.use('StringList')}({', '.join(limits)})")
        return self._lists[place]

    def fresh(self) -> list[str]:
        """Return the definitions that are new since the last call."""
        lines, self._fresh = self._fresh, []
        return lines
