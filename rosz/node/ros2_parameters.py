"""A node's private parameters as ROS 2 sees them: dotted names, and values of ten types.

``/talker/gains/p`` of the store is the parameter ``gains.p`` of the node ``/talker``. What the
store may hold beyond ROS 2's types, such as lists of different things, is shown as YAML text and
cannot be set from there.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from rosz.errors import ParamError
from rosz.msgs.rcl_interfaces.msg import (
    ListParametersResult,
    Parameter,
    ParameterDescriptor,
    ParameterType,
    ParameterValue,
)
from rosz.params.merge import Change, condense
from rosz.params.paths import Path, joined, split
from rosz.params.values import Value, normalise, type_name
from rosz.params.writes import DELETED, Deleted

if TYPE_CHECKING:
    from rosz.node.node import Node

__all__ = ("Ros2Parameters", "from_ros2", "to_ros2")

_DOT = "."
_SIM_TIME = "use_sim_time"
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
    frozenset(): ParameterType.PARAMETER_BYTE_ARRAY,  # what rclpy takes an empty list for
    frozenset({bool}): ParameterType.PARAMETER_BOOL_ARRAY,
    frozenset({int}): ParameterType.PARAMETER_INTEGER_ARRAY,
    frozenset({float}): ParameterType.PARAMETER_DOUBLE_ARRAY,
    frozenset({int, float}): ParameterType.PARAMETER_DOUBLE_ARRAY,
    frozenset({str}): ParameterType.PARAMETER_STRING_ARRAY,
}


def _type_of(value: Value) -> int:
    """Return the number of a value's type; ``PARAMETER_NOT_SET`` where ROS 2 has none for it."""
    if type(value) is list:
        return _ARRAYS.get(frozenset(map(type, value)), ParameterType.PARAMETER_NOT_SET)
    return _TYPES.get(type(value), ParameterType.PARAMETER_NOT_SET)


def to_ros2(value: Value) -> ParameterValue:
    """Return a value as ROS 2 sends it; as YAML text if it has no type for it."""
    number = _type_of(value)
    if number == ParameterType.PARAMETER_NOT_SET:
        from rosz.params.yaml import inline

        return ParameterValue(ParameterType.PARAMETER_STRING, string_value=inline(value))
    if number == ParameterType.PARAMETER_BYTE_ARRAY:
        value = bytes(value)
    return ParameterValue(number, **{_FIELDS[number]: value})


def from_ros2(value: ParameterValue) -> Value | Deleted:
    """Return what a value of ROS 2 means; one that is not set deletes.

    Raises:
        ParamError: It is of no type that there is.
    """
    if value.type == ParameterType.PARAMETER_NOT_SET:
        return DELETED
    field = _FIELDS.get(value.type)
    if field is None:
        raise ParamError(f"'{value.type}' is no type of parameter; expected 0 to {len(_FIELDS)}")
    return normalise(getattr(value, field))


class Ros2Parameters:
    """The parameters of one node.

    Args:
        node: It.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._base = split(node.name)

    def values(self) -> dict[str, tuple[Path, Value]]:
        """Return all parameters by their names, with their places in the store."""
        top = self._node.params.get(self._node.name, None)
        leaves = _leaves(self._base, top) if type(top) is dict else ()
        return {_DOT.join(path[len(self._base) :]): (path, value) for path, value in leaves}

    def get(self, names: Iterable[str]) -> list[ParameterValue]:
        """Return the values of some parameters; "not set" for those that are not there."""
        known = self._all()
        return [to_ros2(known[name]) if name in known else ParameterValue() for name in names]

    def describe(self, names: Iterable[str]) -> list[ParameterDescriptor]:
        """Return what there is to say about some parameters: anybody may set them to anything."""
        known = self._all()
        return [
            _described(name, known[name]) if name in known else ParameterDescriptor(name)
            for name in names
        ]

    def names(self, prefixes: Iterable[str], depth: int) -> ListParametersResult:
        """Return the names of parameters, and all that stands before a last dot in them.

        Args:
            prefixes: Only these, and what lies below them; all when there are none.
            depth: Only so many levels below; 0 for all.
        """
        wanted = [prefix.split(_DOT) for prefix in prefixes] or [[]]
        names = [
            name
            for name in sorted(self._all())
            if any(_lies_below(name.split(_DOT), prefix, depth) for prefix in wanted)
        ]
        above = {name.rpartition(_DOT)[0] for name in names}
        return ListParametersResult(names, sorted(above - {""}))

    def write(self, parameters: Iterable[Parameter]) -> None:
        """Set or delete parameters as one change.

        Raises:
            ParamError: One of them cannot be set to that; nothing has changed then.
            ClosedError: The node is shut down.
        """
        known = self.values()
        changes = [self._change(parameter, known) for parameter in parameters]
        replica = self._node.context.params
        replica.write(condense(changes), origin=f"{self._node.name} for ROS 2 ({replica.label})")

    def _all(self) -> dict[str, Value]:
        """Return the values by name, with the one that every node of ROS 2 has."""
        found = {name: value for name, (_, value) in self.values().items()}
        return {_SIM_TIME: self._node.clock.simulated, **found}

    def _change(self, parameter: Parameter, known: Mapping[str, tuple[Path, Value]]) -> Change:
        name, value = parameter.name, from_ros2(parameter.value)
        if name in known:
            path, before = known[name]
            if _type_of(before) == ParameterType.PARAMETER_NOT_SET:
                raise ParamError(
                    f"'{name}' is a {type_name(before)} that ROS 2 has no type for: set"
                    f" '{joined(path)}' with 'rosz param set'"
                )
            return path, value
        if name == _SIM_TIME:
            raise ParamError(
                "'use_sim_time' is the same for all nodes: set '/use_sim_time' with"
                " 'rosz param set' before they start"
            )
        path = split(joined((*self._base, *name.split(_DOT))))
        if path == self._base:
            raise ParamError(f"'{name}' is no name of a parameter")
        if value is DELETED:
            raise ParamError(f"'{name}' is not set")
        if any(other.startswith(f"{name}{_DOT}") for other in known):
            raise ParamError(f"'{name}' is no parameter: there are parameters below it")
        return path, value


def _leaves(path: Path, value: Value) -> Iterator[tuple[Path, Value]]:
    if type(value) is dict:
        for key, item in value.items():
            yield from _leaves((*path, key), item)
    else:
        yield path, value


def _lies_below(name: list[str], prefix: list[str], depth: int) -> bool:
    if name[: len(prefix)] != prefix:
        return False
    return not depth or len(name) - len(prefix) <= depth


def _described(name: str, value: Any) -> ParameterDescriptor:
    number = _type_of(value)
    if number == ParameterType.PARAMETER_NOT_SET:
        return ParameterDescriptor(
            name,
            ParameterType.PARAMETER_STRING,
            additional_constraints=f"YAML of a {type_name(value)}, which ROS 2 has no type for",
            read_only=True,
        )
    return ParameterDescriptor(name, number, read_only=name == _SIM_TIME, dynamic_typing=True)
