"""The generator that ``.cfg`` files use (ROS wiki, dynamic_reconfigure/Tutorials).

In ROS 1 it writes C++ and Python files. Here it writes nothing: the description goes to the caller
of `rosz.ros1.client.dynamic_reconfigure.cfgfile.run`.
"""

from __future__ import annotations

import inspect
import os
import re
import sys
import textwrap
from collections.abc import Sequence
from contextvars import ContextVar
from string import Template
from typing import Any, Literal

import msgspec

from rosz.errors import ParamError
from rosz.reconfigure import Setting

# ROS 1's module exports its own imports as well, and some files use them.
__all__ = (
    "ParameterGenerator",
    "Template",
    "bool_t",
    "double_t",
    "inspect",
    "int_t",
    "os",
    "re",
    "str_t",
    "sys",
    "textwrap",
)

Kind = Literal["bool", "int", "str", "double"]
Scalar = bool | int | str | float

str_t: Kind = "str"
bool_t: Kind = "bool"
int_t: Kind = "int"
double_t: Kind = "double"

_DEFAULTS: dict[Kind, Scalar] = {"str": "", "bool": False, "int": 0, "double": 0.0}
_TYPE_NAMES = "int_t, double_t, str_t or bool_t"


class Generated(msgspec.Struct, frozen=True):
    """The settings that a file describes.

    Attributes:
        package: Package that the file names.
        node: Node that the file names.
        name: Name of the module, without ``Config``.
        description: Root group, in the form of generated modules.
        constants: Values by name.
    """

    package: str
    node: str
    name: str
    description: dict[str, Any]
    constants: dict[str, Scalar]


results: ContextVar[list[Generated] | None] = ContextVar("results", default=None)
"""List that `ParameterGenerator.generate` appends to while a file runs."""


class Group:
    """Parameters, and groups of them, that belong together."""

    def __init__(
        self,
        gen: ParameterGenerator,
        name: str,
        type: str,  # noqa: A002  # ROS 1's name
        state: bool,
        around: Group | None,
    ) -> None:
        self.gen = gen
        self.name = name.replace(" ", "_")
        self.type = type
        self.state = bool(state)
        self.id = gen.count_group()
        self.parent = around.id if around is not None else self.id
        self.parameters: list[dict[str, Any]] = []
        self.groups: list[Group] = []
        self._around = around
        self._place = _place()

    def add_group(self, name: str, type: str = "", state: bool = True) -> Group:  # noqa: A002
        """Return a new group inside this one.

        Args:
            name: Spaces become underscores.
            type: How a window shows it: empty, ``collapse``, ``tab``, ``hide`` or ``apply``.
            state: Whether it is shown by default.
        """
        group = Group(self.gen, name, type, state, self)
        self.groups.append(group)
        return group

    def add(  # noqa: PLR0917  # ROS 1's signature
        self,
        name: str,
        paramtype: str,
        level: int,
        description: str,
        default: Any = None,
        min: Any = None,  # noqa: A002
        max: Any = None,  # noqa: A002
        edit_method: str = "",
    ) -> None:
        """Describe a parameter.

        Args:
            name: A letter, then letters, digits and underscores.
            paramtype: ``int_t``, ``double_t``, ``str_t`` or ``bool_t``.
            level: Bits that a server's callback gets when the parameter changes.
            description: Purpose, as shown to users.
            default: Default value: 0, empty or false if not given.
            min: Least value of a number.
            max: Greatest value of a number.
            edit_method: Enumeration, as `ParameterGenerator.enum` returns it.

        Raises:
            ParamError: The name is not legal or is taken, or a value does not fit the type.
        """
        kind = _kind(name, paramtype)
        if not isinstance(level, int):
            raise ParamError(f"'{name}' has the level {level!r}; expected a whole number")
        if kind in {bool_t, str_t} and not (min is None and max is None):
            raise ParamError(f"'{name}' is of type '{kind}', which has no min and max")
        first = _DEFAULTS[kind] if default is None else default
        setting = Setting(name, first, level=level, min=min, max=max, kind=kind)
        self.gen.take_name(name)
        self.parameters.append(
            {
                "name": name,
                "type": kind,
                "default": setting.default,
                "level": level,
                "description": description,
                "min": setting.min,
                "max": setting.max,
                **_place(),
                "edit_method": edit_method,
                **_c_types(kind),
            }
        )

    def get_parameters(self) -> list[dict[str, Any]]:
        """Return the parameters of the group, then those of the groups in it."""
        return self.parameters + [
            parameter for group in self.groups for parameter in group.get_parameters()
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return the group in the form of generated modules."""
        names = self.path()
        return {
            "name": self.name,
            "type": self.type,
            "state": self.state,
            "cstate": "true" if self.state else "false",
            "id": self.id,
            "parent": self.parent,
            "parameters": self.parameters,
            "groups": [group.to_dict() for group in self.groups],
            **self._place,
            "class": "::".join(names).upper(),
            "parentclass": "::".join(names[:-1]).upper(),
            "parentname": (self._around or self).name,
            "field": "::".join([*(name.upper() for name in names[:-1]), self.name.lower()]),
            "upper": self.name.upper(),
            "lower": self.name.lower() if self._around is not None else "groups",
        }

    def path(self) -> list[str]:
        """Return the names of the groups around the group, and its own."""
        outer = self._around.path() if self._around is not None else []
        return [*outer, self.name]


class ParameterGenerator:
    """Collects the groups, parameters and constants of a ``.cfg`` file."""

    def __init__(self) -> None:
        self._groups = 0
        self._names: dict[str, int] = {}
        self.constants: list[dict[str, Any]] = []
        self.group = Group(self, "Default", "", True, None)
        self.add_group = self.group.add_group
        self.add = self.group.add

    def const(self, name: str, type: str, value: Any, descr: str) -> dict[str, Any]:  # noqa: A002
        """Return a constant for an enumeration.

        Args:
            name: Name of the constant.
            type: ``int_t``, ``double_t``, ``str_t`` or ``bool_t``.
            value: Value of the constant.
            descr: Meaning, as shown to users.

        Raises:
            ParamError: The value does not fit the type.
        """
        kind = _kind(name, type)
        legal = name if name.isidentifier() else "constant"  # as in ROS 1, any text may be a name
        constant = {
            "name": name,
            "type": kind,
            "value": Setting(legal, value, kind=kind).default,
            **_place(),
            "description": descr,
            **_c_types(kind),
        }
        self.constants.append(constant)
        return constant

    def enum(self, constants: Sequence[dict[str, Any]], description: str) -> str:
        """Return an enumeration for the ``edit_method`` of a parameter.

        Raises:
            ParamError: The constants are not all of one type.
        """
        if len({constant["type"] for constant in constants}) != 1:
            types = (
                ", ".join(f"{constant['name']} ({constant['type']})" for constant in constants)
                or "none"
            )
            raise ParamError(f"expected constants of one type in an enumeration, got {types}")
        return repr({"enum": list(constants), "enum_description": description})

    def generate(self, pkgname: str, nodename: str, name: str) -> int:
        """Finish the description.

        Args:
            pkgname: Name of the package.
            nodename: Name of the node.
            name: Name of the module, without ``Config``.

        Returns:
            The exit code 0.
        """
        collected = results.get()
        if collected is not None:
            constants = {constant["name"]: constant["value"] for constant in self.constants}
            collected.append(Generated(pkgname, nodename, name, self.group.to_dict(), constants))
        return 0

    def count_group(self) -> int:
        """Return the id of a new group."""
        self._groups += 1
        return self._groups - 1

    def take_name(self, name: str) -> None:
        """Raise a ParamError for a name that another parameter has."""
        if name in self._names:
            raise ParamError(f"there is a parameter '{name}' already, in line {self._names[name]}")
        self._names[name] = _place()["srcline"]


def _kind(name: str, given: str) -> Kind:
    for kind in _DEFAULTS:
        if given == kind:
            return kind
    raise ParamError(f"'{name}' has the unknown type {given!r}; expected {_TYPE_NAMES}")


def _c_types(kind: Kind) -> dict[str, str]:
    if kind == str_t:
        return {"ctype": "std::string", "cconsttype": "const char * const"}
    return {"ctype": kind, "cconsttype": f"const {kind}"}


def _place() -> dict[str, Any]:
    """Return the line of the calling file, in the form of generated modules."""
    frame = inspect.currentframe()
    while frame is not None and frame.f_code.co_filename == __file__:
        frame = frame.f_back
    if frame is None:
        return {"srcline": 0, "srcfile": ""}
    return {"srcline": frame.f_lineno, "srcfile": os.path.basename(frame.f_code.co_filename)}  # noqa: PTH119
