"""Names in generated modules: attributes, classes, variables, module-level values."""

from __future__ import annotations

import builtins
import keyword
import re

from rosz.idl.spec import FieldType

__all__ = (
    "ACTION_MESSAGES",
    "ACTION_SERVICES",
    "ClassNames",
    "LocalNames",
    "ModuleNames",
    "action_of",
    "attribute",
    "class_name",
    "is_service",
    "is_service_message",
)

ACTION_MESSAGES = ("Goal", "Result", "Feedback", "FeedbackMessage")
"""The messages that ROS 2 makes of an action, behind its name and ``_``."""

ACTION_SERVICES = ("SendGoal", "GetResult")
"""The services that ROS 2 makes of an action."""

SERVICE_MESSAGES = ("Request", "Response", "Event")
"""The messages that ROS 2 makes of a service, behind its name and ``_``."""

_RESERVED = re.compile(r"[befhkmnpq][0-9]*")
"""Names that generated code uses for its own variables."""


def attribute(name: str) -> str:
    """Return the attribute of a field or constant; a keyword of Python gets a ``_``."""
    return f"{name}_" if keyword.iskeyword(name) else name


def class_name(name: str) -> str:
    """Return the class name of a full type name: ``Twist``, ``SetBoolRequest``, ``SetBool``."""
    _, kind, base = name.split("/")  # those of actions are named as rclpy names them
    for part in ("Request", "Response"):
        if kind == "srv" and base.endswith(f"_{part}"):
            return base.removesuffix(f"_{part}") + part
    return attribute(base)


def action_of(base: str) -> str:
    """Return the action that a type in an ``action`` folder belongs to, both without packages.

    ``Fibonacci_Goal`` gives ``Fibonacci``, and so does ``Fibonacci``.
    """
    action, _, part = base.rpartition("_")
    return action if action and part in (*ACTION_MESSAGES, *ACTION_SERVICES) else base


def is_service(name: str) -> bool:
    """Return whether a full name is that of a service, such as one of the two of an action."""
    _, kind, base = name.split("/")
    part = base.removeprefix(f"{action_of(base)}_")
    return (kind == "srv" and not is_service_message(name)) or (
        kind == "action" and part in ACTION_SERVICES
    )


def is_service_message(name: str) -> bool:
    """Return whether a full name is that of a message that ROS 2 makes of a service."""
    _, kind, base = name.split("/")
    return kind == "srv" and base.rpartition("_")[2] in SERVICE_MESSAGES and "_" in base


class LocalNames:
    """Names of the local variables in one generated function, short and distinct."""

    def __init__(self) -> None:
        self._taken = {*dir(builtins), *keyword.kwlist, *keyword.softkwlist, "data", "m", "out"}

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


class ModuleNames:
    """The names that a generated module imports and defines, besides its own classes.

    Args:
        own: Full names of the types whose classes the module defines.
    """

    def __init__(self, own: list[str]) -> None:
        self._own = {class_name(name): name for name in own}
        self._imports: dict[str, str] = {}
        self._defined: dict[str, str] = {}
        self._fresh: list[str] = []
        self._lists: dict[str, str] = {}
        self.runtime: set[str] = set()

    @property
    def imports(self) -> dict[str, str]:
        """Classes of other modules, from full type name to name in this module."""
        return dict(self._imports)

    def cls(self, name: str) -> str:
        """Return the name of a message class in this module."""
        plain = class_name(name)
        if self._own.get(plain) == name:
            return plain
        if name not in self._imports:
            taken = set(self._imports.values()) | set(self._own)
            self._imports[name] = plain if plain not in taken else name.replace("/", "_")
        return self._imports[name]

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

    def string_list(self, kind: FieldType, place: str) -> str:
        """Return the name of the StringList of a field, which its encoder and decoder share."""
        if place not in self._lists:
            limits = []
            if kind.shape == "fixed":
                limits.append(f"size={kind.size}")
            if kind.shape == "bounded":
                limits.append(f"most={kind.size}")
            if kind.bound:
                limits.append(f"bound={kind.bound}")
            name = self._lists[place] = f"_s{len(self._lists) + 1}"
            self._fresh.append(f"{name} = {self.use('StringList')}({', '.join(limits)})")
        return self._lists[place]

    def fresh(self) -> list[str]:
        """Return the definitions that are new since the last call."""
        lines, self._fresh = self._fresh, []
        return lines


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
        plain = self.module.cls(name)
        return self.module.define("_c", plain) if plain in self._hidden else plain
