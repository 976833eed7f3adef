"""The values of parameters as ROS 2 sends them.

ROS 2 has values of ten types. Other values of the store, such as lists of mixed items, are YAML
text there.
"""

from __future__ import annotations

from collections.abc import Mapping

from rosz.errors import ParamError
from rosz.msgs.rcl_interfaces.msg import ParameterType, ParameterValue
from rosz.params import DELETED, Deleted, Value, normalise, type_name

_FIELDS = {
    ParameterType.PARAMETER_BOOL: "bool_value",
    ParameterType.PARAMETER_INTEGER: "integer_value",
    ParameterType.PARAMETER_DOUBLE: "double_value",
    ParameterType.PARAMETER_STRING: "string_value",
    ParameterType.PARAMETER_BYTE_ARRAY: "byte_array_value",
    ParameterType.PARAMETER_BOOL_ARRAY: "bool_array_value",
    ParameterType.PARAMETER_INTEGER_ARRAY: "integer_array_value",
    ParameterType.PARAMETER_DOUBLE_ARRAY: "double_array_value",
    ParameterType.PARAMETER_STRING_ARRAY: "string_array_value",
}
_TYPES: Mapping[type, int] = {
    bool: ParameterType.PARAMETER_BOOL,
    int: ParameterType.PARAMETER_INTEGER,
    float: ParameterType.PARAMETER_DOUBLE,
    str: ParameterType.PARAMETER_STRING,
    bytes: ParameterType.PARAMETER_BYTE_ARRAY,
}
_ARRAYS: Mapping[frozenset[type], int] = {
    frozenset(): ParameterType.PARAMETER_BYTE_ARRAY,  # as rclpy reads an empty list
    frozenset({bool}): ParameterType.PARAMETER_BOOL_ARRAY,
    frozenset({int}): ParameterType.PARAMETER_INTEGER_ARRAY,
    frozenset({float}): ParameterType.PARAMETER_DOUBLE_ARRAY,
    frozenset({int, float}): ParameterType.PARAMETER_DOUBLE_ARRAY,
    frozenset({str}): ParameterType.PARAMETER_STRING_ARRAY,
}

_CONVERSIONS = frozenset(
    {
        (ParameterType.PARAMETER_INTEGER, ParameterType.PARAMETER_DOUBLE),
        (ParameterType.PARAMETER_INTEGER_ARRAY, ParameterType.PARAMETER_DOUBLE_ARRAY),
    }
)


def type_of(value: Value) -> int:
    """Return the number of a value's type; ``PARAMETER_NOT_SET`` if ROS 2 has none for it."""
    if type(value) is list:
        return _ARRAYS.get(frozenset(map(type, value)), ParameterType.PARAMETER_NOT_SET)
    return _TYPES.get(type(value), ParameterType.PARAMETER_NOT_SET)


def to_ros2(value: Value) -> ParameterValue:
    """Return a value as ROS 2 sends it: as YAML text if ROS 2 has no type for it."""
    number = type_of(value)
    if number == ParameterType.PARAMETER_NOT_SET:
        from rosz.params.yaml import inline

        return ParameterValue(ParameterType.PARAMETER_STRING, string_value=inline(value))
    return _made(number, value)


def to_type(value: Value, number: int, name: str) -> ParameterValue:
    """Return a value for a parameter of some type: ints become floats, and ``[]`` any array.

    Args:
        value: The value.
        number: Type of the parameter.
        name: Name of the parameter, for the error.

    Raises:
        ParamError: ROS 2 has no type for the value.
    """
    actual = type_of(value)
    if actual == ParameterType.PARAMETER_NOT_SET:
        raise ParamError(f"'{name}' cannot be the {type_name(value)} {value!r:.60} in ROS 2")
    if (actual, number) in _CONVERSIONS or (value == [] and number in _ARRAYS.values()):
        actual = number
    return _made(actual, value)


def _made(number: int, value: Value) -> ParameterValue:
    if number == ParameterType.PARAMETER_BYTE_ARRAY:
        value = bytes(value)
    elif number == ParameterType.PARAMETER_DOUBLE:
        value = float(value)
    return ParameterValue(number, **{_FIELDS[number]: value})


def from_ros2(value: ParameterValue) -> Value | Deleted:
    """Return the value for the store; "not set" means to delete the parameter.

    Raises:
        ParamError: The type of the value does not exist.
    """
    if value.type == ParameterType.PARAMETER_NOT_SET:
        return DELETED
    field = _FIELDS.get(value.type)
    if field is None:
        raise ParamError(f"'{value.type}' is not a type of parameter; expected 0 to {len(_FIELDS)}")
    return normalise(getattr(value, field))
