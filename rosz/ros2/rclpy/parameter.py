"""rclpy.parameter: parameters with their types and values, and the parameters of a node.

The parameters of a node are stored in rosz's parameter store below the name of the node, where
``rosz param`` and launch files read and write them; dots in their names become slashes there. What
other programs set is checked and applied by the executor, as with ROS 2's parameter services.
"""

from __future__ import annotations

import array
from collections.abc import Callable, Iterable, Sequence
from enum import IntEnum
from typing import TYPE_CHECKING, Any

from rosz.errors import UsageError
from rosz.msgs.rcl_interfaces.msg import Parameter as ParameterMessage
from rosz.msgs.rcl_interfaces.msg import ParameterDescriptor, ParameterValue, SetParametersResult
from rosz.params import type_name
from rosz.params.yaml import read_plain
from rosz.ros2.rclpy.exceptions import (
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterAlreadyDeclaredException,
    ParameterNotDeclaredException,
    ParameterUninitializedException,
)

if TYPE_CHECKING:
    from rosz.node import Node as RoszNode
    from rosz.params.replica import Changed

__all__ = ("PARAMETER_SEPARATOR_STRING", "NodeParameters", "Parameter", "get_parameter_value")

PARAMETER_SEPARATOR_STRING = "."


class Parameter:
    """A parameter.

    Args:
        name: Name of the parameter.
        type_: Type of the value; derived from the value when not given.
        value: Value of the parameter.

    Raises:
        UsageError: The value has none of the types of parameters, or not the given one.
    """

    class Type(IntEnum):
        """The type of a value."""

        NOT_SET = 0
        BOOL = 1
        INTEGER = 2
        DOUBLE = 3
        STRING = 4
        BYTE_ARRAY = 5
        BOOL_ARRAY = 6
        INTEGER_ARRAY = 7
        DOUBLE_ARRAY = 8
        STRING_ARRAY = 9

        @classmethod
        def from_parameter_value(cls, parameter_value: Any) -> Parameter.Type:
            """Return the type of a value.

            Raises:
                UsageError: Parameters cannot have such a value.
            """
            return _type_of(parameter_value)

        def check(self, parameter_value: Any) -> bool:
            """Return whether a value is of this type."""
            try:
                found = _type_of(parameter_value)
            except UsageError:
                return False
            return found is self or (
                _is_empty(parameter_value) and self >= Parameter.Type.BYTE_ARRAY
            )

    def __init__(self, name: str, type_: Type | None = None, value: Any = None) -> None:
        found = _type_of(value)
        if type_ is not None and type_ is not found and not type_.check(value):
            raise UsageError(
                f"parameter '{name}' has the value {value!r}; expected one of type {type_.name}"
            )
        self._name, self._value = name, value
        self._type = found if type_ is None else type_

    @property
    def name(self) -> str:
        """Name of the parameter."""
        return self._name

    @property
    def type_(self) -> Type:
        """Type of the value."""
        return self._type

    @property
    def value(self) -> Any:
        """Value of the parameter."""
        return self._value

    def get_parameter_value(self) -> ParameterValue:
        """Return the value as a message, which has one field for each type."""
        message = ParameterValue(type=int(self._type))
        field = _FIELDS.get(self._type)
        if field is not None:
            setattr(message, field, self._value)
        return message

    def to_parameter_msg(self) -> ParameterMessage:
        """Return the parameter as a message."""
        return ParameterMessage(name=self._name, value=self.get_parameter_value())

    @classmethod
    def from_parameter_msg(cls, param_msg: ParameterMessage) -> Parameter:
        """Return the parameter of a message."""
        kind = cls.Type(param_msg.value.type)
        field = _FIELDS.get(kind)
        value: Any = None if field is None else getattr(param_msg.value, field)
        if isinstance(value, array.array):
            value = value.tolist()
        return cls(param_msg.name, kind, value)

    def __repr__(self) -> str:
        return f"Parameter(name={self._name!r}, type_={self._type.name}, value={self._value!r})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Parameter) and (self._name, self._type, self._value) == (
            other.name,
            other.type_,
            other.value,
        )

    __hash__ = None  # type: ignore[assignment]


_Type = Parameter.Type
_SCALARS: dict[type, Parameter.Type] = {
    type(None): _Type.NOT_SET,
    bool: _Type.BOOL,
    int: _Type.INTEGER,
    float: _Type.DOUBLE,
    str: _Type.STRING,
    bytes: _Type.BYTE_ARRAY,
}
_ARRAYS = {
    bool: _Type.BOOL_ARRAY,
    int: _Type.INTEGER_ARRAY,
    float: _Type.DOUBLE_ARRAY,
    str: _Type.STRING_ARRAY,
    bytes: _Type.BYTE_ARRAY,
}
_FIELDS = {
    _Type.BOOL: "bool_value",
    _Type.INTEGER: "integer_value",
    _Type.DOUBLE: "double_value",
    _Type.STRING: "string_value",
    _Type.BYTE_ARRAY: "byte_array_value",
    _Type.BOOL_ARRAY: "bool_array_value",
    _Type.INTEGER_ARRAY: "integer_array_value",
    _Type.DOUBLE_ARRAY: "double_array_value",
    _Type.STRING_ARRAY: "string_array_value",
}


def _type_of(value: Any) -> Parameter.Type:
    scalar = _SCALARS.get(type(value))
    if scalar is not None:
        return scalar
    if isinstance(value, Sequence | array.array):
        kinds = {type(one) for one in value}
        if not kinds:
            return _Type.BYTE_ARRAY  # rclpy's type of an empty list
        found = _ARRAYS.get(kinds.pop())
        if found is not None and not kinds:
            return found
    raise UsageError(
        f"a parameter cannot be {value!r}; expected a bool, int, float, str, bytes or a list of one"
        " of them"
    )


def _is_empty(value: Any) -> bool:
    return isinstance(value, Sequence) and not value and not isinstance(value, str)


def get_parameter_value(string_value: str) -> ParameterValue:
    """Return the parameter value of a text, by the rules of YAML."""
    value = next(read_plain(string_value, "<value>"), None)
    return Parameter("", value=value).get_parameter_value()


Check = Callable[[list[Parameter]], Any]
"""A function called with parameters before they are set; returns a SetParametersResult."""

_MISSING = object()


class NodeParameters:
    """The declared parameters of a node.

    Args:
        node: The node.
        overrides: Values from the command line or the caller, by name.
        call_soon: Function that passes a function to the executor that spins the node.
    """

    def __init__(
        self,
        node: RoszNode,
        overrides: dict[str, Any],
        call_soon: Callable[[Callable[[], object]], None],
    ) -> None:
        self._node = node
        self._overrides = overrides
        self._call_soon = call_soon
        self._known: dict[str, Parameter] = {}
        self._descriptors: dict[str, ParameterDescriptor] = {}
        self._checks: list[Check] = []

    def declare(
        self,
        name: str,
        value: Any = None,
        descriptor: ParameterDescriptor | None = None,
        ignore_override: bool = False,
    ) -> Parameter:
        """Declare a parameter; see `rclpy.node.Node.declare_parameter`.

        Raises:
            ParameterException: The declaration is refused; the subclass tells the reason.
        """
        if name in self._known:
            raise ParameterAlreadyDeclaredException([name])
        kind = value if isinstance(value, Parameter.Type) else None
        default = Parameter(name, value=None if kind is not None else value)
        given = _MISSING if ignore_override else self._override(name)
        if given is _MISSING:
            chosen = default
        else:
            expected = kind or default.type_
            free = descriptor is not None and descriptor.dynamic_typing
            chosen = self._convert(name, given, Parameter.Type.NOT_SET if free else expected)
        refusal = self._refusal([chosen])
        if refusal:
            raise InvalidParameterValueException(name, chosen.value, refusal)
        self._descriptors[name] = descriptor or ParameterDescriptor(name=name)
        self._known[name] = chosen
        self._store(chosen)
        self._node.params.watch(self._path(name), lambda change: self._on_change(name, change))
        return chosen

    def _override(self, name: str) -> Any:
        if name in self._overrides:
            return self._overrides[name]
        return self._node.params.get(self._path(name), _MISSING)

    def _convert(self, name: str, value: Any, kind: Parameter.Type) -> Parameter:
        """Return a parameter of the declared type."""
        if kind is Parameter.Type.DOUBLE and type(value) is int:
            value = float(value)  # YAML and ROS 1 write whole numbers without a point
        if kind is Parameter.Type.DOUBLE_ARRAY and isinstance(value, list):
            value = [float(one) if type(one) is int else one for one in value]
        if kind is not Parameter.Type.NOT_SET and not kind.check(value):
            raise InvalidParameterTypeException(name, kind.name, type_name(value))
        return Parameter(name, None if kind is Parameter.Type.NOT_SET else kind, value)

    def _path(self, name: str) -> str:
        return f"~{name.replace('.', '/')}"

    def _store(self, parameter: Parameter) -> None:
        if parameter.type_ is not Parameter.Type.NOT_SET:
            self._node.params.set(self._path(parameter.name), parameter.value)

    def _on_change(self, name: str, _change: Changed) -> None:
        """Let the executor apply what another program set."""
        self._call_soon(lambda: self._update(name))

    def _update(self, name: str) -> None:
        known = self._known.get(name)
        value = self._node.params.get(self._path(name), _MISSING)
        if known is None or value is _MISSING or value == known.value:
            return
        try:
            changed = self._convert(name, value, known.type_)
        except InvalidParameterTypeException as error:
            self._node.log.warning("%s; it stays %r", error, known.value)
            return
        reason = self._refusal([changed])
        if reason:
            self._node.log.warning("parameter '%s' stays %r: %s", name, known.value, reason)
        else:
            self._known[name] = changed

    def has(self, name: str) -> bool:
        """Return whether a parameter is declared."""
        return name in self._known

    def get(self, name: str) -> Parameter:
        """Return a parameter.

        Raises:
            ParameterNotDeclaredException: The parameter is not declared.
            ParameterUninitializedException: It was declared by type only, and has no value.
        """
        found = self._known.get(name)
        if found is None:
            raise ParameterNotDeclaredException(name)
        if found.type_ is Parameter.Type.NOT_SET and not self._descriptors[name].dynamic_typing:
            raise ParameterUninitializedException(name)
        return found

    def below(self, prefix: str) -> dict[str, Parameter]:
        """Return the parameters below a prefix, by the rest of their names."""
        start = f"{prefix}." if prefix else ""
        return {
            name.removeprefix(start): one
            for name, one in self._known.items()
            if name.startswith(start)
        }

    def descriptor(self, name: str) -> ParameterDescriptor:
        """Return the descriptor of a parameter.

        Raises:
            ParameterNotDeclaredException: The parameter is not declared.
        """
        if name not in self._descriptors:
            raise ParameterNotDeclaredException(name)
        return self._descriptors[name]

    def set(self, parameters: Iterable[Parameter]) -> list[SetParametersResult]:
        """Set parameters one by one; see `set_atomically`."""
        return [self.set_atomically([one]) for one in parameters]

    def set_atomically(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        """Set all parameters, or none if one is refused.

        Raises:
            ParameterNotDeclaredException: A parameter is not declared.
        """
        missing = [one.name for one in parameters if one.name not in self._known]
        if missing:
            raise ParameterNotDeclaredException(missing)
        reasons = [self._mismatch(one) for one in parameters]
        reason = next(filter(None, reasons), "") or self._refusal(list(parameters))
        if reason:
            return SetParametersResult(successful=False, reason=reason)
        for one in parameters:
            self._known[one.name] = one
            self._store(one)
        return SetParametersResult(successful=True)

    def _mismatch(self, parameter: Parameter) -> str:
        """Return why a parameter cannot have a value; empty if it can."""
        descriptor, known = self._descriptors[parameter.name], self._known[parameter.name].type_
        if descriptor.read_only:
            return f"Trying to set a read-only parameter: {parameter.name}."
        loose = descriptor.dynamic_typing or Parameter.Type.NOT_SET in {known, parameter.type_}
        if loose or known is parameter.type_:
            return ""
        return (
            f"Wrong parameter type, expected 'Type.{known.name}' got 'Type.{parameter.type_.name}'"
        )

    def undeclare(self, name: str) -> None:
        """Remove a declaration.

        Raises:
            ParameterNotDeclaredException: The parameter is not declared.
        """
        if name not in self._known:
            raise ParameterNotDeclaredException(name)
        del self._known[name], self._descriptors[name]

    def add_check(self, check: Check) -> None:
        """Call a function before parameters are set."""
        self._checks.insert(0, check)

    def remove_check(self, check: Check) -> None:
        """Remove a function of `add_check`.

        Raises:
            ValueError: The function was not added.
        """
        self._checks.remove(check)

    def _refusal(self, parameters: list[Parameter]) -> str:
        """Return why a check refuses parameters; empty if all accept them."""
        for check in self._checks:
            result = check(parameters)
            if not result.successful:
                return result.reason or "a callback refuses it"
        return ""
