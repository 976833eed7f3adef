"""rclpy.parameter: a parameter with its type and value."""

from __future__ import annotations

import array
from collections.abc import Sequence
from enum import IntEnum
from typing import Any

from rosz.errors import UsageError
from rosz.msgs.rcl_interfaces.msg import Parameter as ParameterMessage
from rosz.msgs.rcl_interfaces.msg import ParameterValue
from rosz.params.yaml_nodes import read_plain

__all__ = ("PARAMETER_SEPARATOR_STRING", "Parameter", "get_parameter_value")

PARAMETER_SEPARATOR_STRING = "."


class Parameter:
    """A parameter.

    Args:
        name: Its name.
        type_: Its type; by the value when not given.
        value: Its value.

    Raises:
        UsageError: The value is of no type that there is, or not of the one given.
    """

    class Type(IntEnum):
        """What a value is."""

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
                UsageError: It has none.
            """
            return _type_of(parameter_value)

        def check(self, parameter_value: Any) -> bool:
            """Tell whether a value is of this type."""
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
        """Its name."""
        return self._name

    @property
    def type_(self) -> Type:
        """Its type."""
        return self._type

    @property
    def value(self) -> Any:
        """Its value."""
        return self._value

    def get_parameter_value(self) -> ParameterValue:
        """Return its value as a message, with one field for each type."""
        message = ParameterValue(type=int(self._type))
        field = _FIELDS.get(self._type)
        if field is not None:
            setattr(message, field, self._value)
        return message

    def to_parameter_msg(self) -> ParameterMessage:
        """Return it as a message."""
        return ParameterMessage(name=self._name, value=self.get_parameter_value())

    @classmethod
    def from_parameter_msg(cls, param_msg: ParameterMessage) -> Parameter:
        """Return what a message says."""
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
            return _Type.BYTE_ARRAY  # as rclpy takes an empty list
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
    """Return what a text is as a parameter, by the rules of YAML."""
    value = next(read_plain(string_value, "<value>"), None)
    return Parameter("", value=value).get_parameter_value()
