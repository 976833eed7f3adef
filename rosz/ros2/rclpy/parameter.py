"""rclpy.parameter: parameters with their types and values, and the parameters of a node.

The parameters of a node are stored in rosz's parameter store below the name of the node, where
``rosz param`` and launch files read and write them; dots in their names become slashes there. What
other programs set is checked and applied by the executor, as with ROS 2's parameter services.
"""

from __future__ import annotations

import array
import math
import threading
from collections.abc import Callable, Sequence
from enum import IntEnum
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

from msgspec.structs import replace

from rosz.errors import RoszError, UsageError
from rosz.msgs.rcl_interfaces.msg import Parameter as ParameterMessage
from rosz.msgs.rcl_interfaces.msg import ParameterDescriptor, ParameterValue, SetParametersResult
from rosz.node import Node as RoszNode
from rosz.node.ros2 import type_of
from rosz.params import type_name
from rosz.params.yaml import read_plain
from rosz.ros2.rclpy import exceptions

PARAMETER_SEPARATOR_STRING = "."
_SPIN_SECONDS = 10.0
"""Time limit for the executor to set what another program sets."""


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
                actual = _type_of(parameter_value)
            except UsageError:
                return False
            return actual is self or (
                _is_empty(parameter_value) and self >= Parameter.Type.BYTE_ARRAY
            )

    def __init__(self, name: str, type_: Type | None = None, value: Any = None) -> None:
        value = _plain(value)
        actual = _type_of(value)
        if type_ is not None and type_ is not actual and not type_.check(value):
            raise UsageError(
                f"parameter '{name}' has the value {value!r}; expected one of type {type_.name}"
            )
        self._name, self._value = name, value
        self._type = actual if type_ is None else type_

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
        if self._type is not _Type.NOT_SET:
            setattr(message, _field(self._type), self._value)
        return message

    def to_parameter_msg(self) -> ParameterMessage:
        """Return the parameter as a message."""
        return ParameterMessage(name=self._name, value=self.get_parameter_value())

    @classmethod
    def from_parameter_msg(cls, param_msg: ParameterMessage) -> Parameter:
        """Return the parameter of a message."""
        kind = cls.Type(param_msg.value.type)
        return cls(param_msg.name, kind, parameter_value_to_python(param_msg.value))

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
_Callback: TypeAlias = Callable[[list[Parameter]], Any]


def _field(kind: Parameter.Type) -> str:
    """Return the name of the field of messages for values of a type."""
    return f"{kind.name.lower()}_value"


def _plain(value: Any) -> Any:
    """Return a value without subclasses of Python's types in it, such as enums and numpy's."""
    if isinstance(value, list | tuple):
        return type(value)(map(_plain, value))
    plain: dict[type, Callable[[Any], Any]] = {
        int: int.__int__,
        float: float.__float__,
        str: str.__str__,
    }
    kind = next((kind for kind in type(value).__mro__ if kind in plain or kind is bool), bool)
    return value if kind is bool else plain[kind](value)


def _type_of(value: Any) -> Parameter.Type:
    value = _plain(value)
    if value is None:
        return _Type.NOT_SET
    is_array = isinstance(value, Sequence | array.array) and not isinstance(value, str | bytes)
    elements = list(value) if is_array else [value]
    if len({*map(type, elements)}) <= 1:  # rclpy does not mix ints with floats
        if is_array and elements and type(elements[0]) is bytes:
            return _Type.BYTE_ARRAY
        number = type_of(elements if is_array else value)
        if number:
            return _Type(number)
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


def parameter_value_to_python(parameter_value: ParameterValue) -> Any:
    """Return the value of a message; None if it is not set."""
    kind = Parameter.Type(parameter_value.type)
    value = None if kind is _Type.NOT_SET else getattr(parameter_value, _field(kind))
    return value.tolist() if isinstance(value, array.array) else value


def parameter_dict_from_yaml_file(
    parameter_file: str,
    use_wildcard: bool = False,
    target_nodes: Sequence[str] | None = None,
    namespace: str = "",
) -> dict[str, ParameterMessage]:
    """Return the parameters of a file of ROS 2's form as messages, by their names.

    Args:
        parameter_file: Path of the file: nodes, below them ``ros__parameters``.
        use_wildcard: Whether the parameters of ``/**`` count, too; those of nodes come first.
        target_nodes: Nodes whose parameters to take; all of the file when not given.
        namespace: Prefix of the names.

    Raises:
        UsageError: The file cannot be read, or it lacks a node or ``ros__parameters``.
        ParamError: It is not YAML.
    """
    try:
        text = Path(parameter_file).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"cannot read '{parameter_file}': {error}") from None
    nodes = next(read_plain(text, parameter_file), None)
    if not isinstance(nodes, dict):
        raise UsageError(f"'{parameter_file}' has no nodes; expected NODE: ros__parameters: …")
    chosen = list(target_nodes or (name for name in nodes if name != _WILDCARD))
    missing = [name for name in chosen if name not in nodes]
    if missing:
        raise UsageError(
            f"'{parameter_file}' has no parameters of '{missing[0]}', only of {', '.join(nodes)}"
        )
    if use_wildcard and _WILDCARD in nodes:
        chosen.insert(0, _WILDCARD)
    values: dict[str, Any] = {}
    for name in chosen:
        below = nodes[name].get("ros__parameters") if isinstance(nodes[name], dict) else None
        if not isinstance(below, dict):
            raise UsageError(f"'{parameter_file}' has no 'ros__parameters' below '{name}'")
        values |= _leaves(below, namespace)
    return {name: Parameter(name, value=value).to_parameter_msg() for name, value in values.items()}


def _leaves(values: dict[Any, Any], prefix: str) -> dict[str, Any]:
    """Return nested parameters by their dotted names."""
    leaves: dict[str, Any] = {}
    for key, value in values.items():
        name = f"{prefix}{key}"
        leaves |= _leaves(value, f"{name}.") if isinstance(value, dict) else {name: value}
    return leaves


_WILDCARD = "/**"
_MISSING = object()


class NodeParameters:
    """The methods of `rclpy.node.Node` for its parameters.

    ``overrides`` are the values from the command line or the caller.
    """

    def __init__(
        self,
        node: RoszNode,
        overrides: dict[str, Any],
        call_soon: Callable[[Callable[[], object]], None],
    ) -> None:
        self.rosz_node: RoszNode = node
        self._rosz_overrides = overrides
        self._rosz_update_soon = call_soon
        self._rosz_known: dict[str, Parameter] = {}
        self._rosz_descriptors: dict[str, ParameterDescriptor] = {}
        self._rosz_before: list[_Callback] = []
        self._rosz_checks: list[_Callback] = []
        node.parameter_owner = _DeclaredParameters(self, call_soon)
        self._rosz_after: list[_Callback] = []

    def declare_parameter(
        self,
        name: str,
        value: Any = None,
        descriptor: ParameterDescriptor | None = None,
        ignore_override: bool = False,
    ) -> Parameter:
        """Declare a parameter; the command line and launch files override its default value.

        Args:
            name: Name of the parameter.
            value: Default value, or a ``Parameter.Type`` for a parameter without a value.
            descriptor: Description of the parameter.
            ignore_override: Whether to use the default value in any case.

        Raises:
            ParameterAlreadyDeclaredException: The parameter is declared already.
            InvalidParameterTypeException: The overriding value is of another type.
            InvalidParameterValueException: A callback refuses the value.
        """
        if name in self._rosz_known:
            raise exceptions.ParameterAlreadyDeclaredException([name])
        kind = value if isinstance(value, Parameter.Type) else None
        chosen = Parameter(name, value=None if kind is not None else value)
        given = _MISSING
        if not ignore_override:
            given = self._rosz_overrides.get(name, _MISSING)
            if given is _MISSING:
                given = self.rosz_node.params.get(_path(name), _MISSING)
        if given is not _MISSING:
            free = descriptor is not None and descriptor.dynamic_typing
            chosen = _convert(name, given, _Type.NOT_SET if free else kind or chosen.type_)
        refusal = self._rosz_refusal([chosen])
        if refusal:
            raise exceptions.InvalidParameterValueException(name, chosen.value, refusal)
        self._rosz_descriptors[name] = descriptor or ParameterDescriptor(name=name)
        self._rosz_set(chosen)
        self.rosz_node.params.watch(
            _path(name), lambda _: self._rosz_update_soon(lambda: self._rosz_update(name))
        )
        self._rosz_tell([chosen])
        return chosen

    def declare_parameters(
        self, namespace: str, parameters: Sequence[tuple[Any, ...]], ignore_override: bool = False
    ) -> list[Parameter]:
        """Declare several parameters: tuples of the arguments of `declare_parameter`.

        Args:
            namespace: Prefix of the names, without the dot; may be empty.
            parameters: Name, and optionally default value and descriptor, of each parameter.
            ignore_override: Whether to use the default values in any case.
        """
        start = f"{namespace}." if namespace else ""
        declared: list[Parameter] = []
        for name, *rest in parameters:
            value, descriptor = (*rest, None, None)[:2]
            declared.append(
                self.declare_parameter(start + name, value, descriptor, ignore_override)
            )
        return declared

    def _rosz_set(self, parameter: Parameter) -> None:
        self._rosz_known[parameter.name] = parameter
        params, path = self.rosz_node.params, _path(parameter.name)
        kept = parameter.type_ is _Type.NOT_SET or params.get(path, _MISSING) == parameter.value
        if not kept:
            params.set(path, parameter.value)

    def _rosz_update(self, name: str) -> None:
        """Apply the value that another program has set."""
        parameter = self._rosz_known.get(name)
        value = self.rosz_node.params.get(_path(name), _MISSING)
        if parameter is None or value is _MISSING or value == parameter.value:
            return
        try:
            changed = _convert(name, value, parameter.type_)
        except exceptions.InvalidParameterTypeException as error:
            self._rosz_refuse(parameter, str(error))
            return
        result = self.set_parameters_atomically([changed])
        if not result.successful:
            self._rosz_refuse(parameter, result.reason)

    def _rosz_refuse(self, parameter: Parameter, reason: str) -> None:
        """Put the value of the node back into the store, which has got another one."""
        self.rosz_node.log.warning(
            "parameter '%s' stays %r: %s", parameter.name, parameter.value, reason
        )
        self._rosz_set(parameter)

    def undeclare_parameter(self, name: str) -> None:
        """Remove the declaration of a parameter."""
        if name not in self._rosz_known:
            raise exceptions.ParameterNotDeclaredException(name)
        del self._rosz_known[name], self._rosz_descriptors[name]

    def has_parameter(self, name: str) -> bool:
        """Return whether a parameter is declared."""
        return name in self._rosz_known

    def get_parameter(self, name: str) -> Parameter:
        """Return a parameter.

        Raises:
            ParameterNotDeclaredException: The parameter is not declared.
            ParameterUninitializedException: It was declared by type only, and has no value.
        """
        parameter = self._rosz_known.get(name)
        if parameter is None:
            raise exceptions.ParameterNotDeclaredException(name)
        if parameter.type_ is _Type.NOT_SET and not self._rosz_descriptors[name].dynamic_typing:
            raise exceptions.ParameterUninitializedException(name)
        return parameter

    def get_parameters(self, names: Sequence[str]) -> list[Parameter]:
        """Return several parameters."""
        return [self.get_parameter(name) for name in names]

    def get_parameter_or(self, name: str, alternative_value: Any = None) -> Any:
        """Return a parameter, or an alternative value if it is not declared."""
        return self.get_parameter(name) if name in self._rosz_known else alternative_value

    def get_parameters_by_prefix(self, prefix: str) -> dict[str, Parameter]:
        """Return the parameters below a prefix, by the rest of their names."""
        start = f"{prefix}." if prefix else ""
        return {
            name.removeprefix(start): parameter
            for name, parameter in self._rosz_known.items()
            if name.startswith(start)
        }

    def describe_parameter(self, name: str) -> ParameterDescriptor:
        """Return the descriptor of a parameter."""
        if name not in self._rosz_descriptors:
            raise exceptions.ParameterNotDeclaredException(name)
        return self._rosz_descriptors[name]

    def set_parameters(self, parameter_list: Sequence[Parameter]) -> list[SetParametersResult]:
        """Set parameters one by one, and return one result for each."""
        return [self.set_parameters_atomically([parameter]) for parameter in parameter_list]

    def set_parameters_atomically(self, parameter_list: Sequence[Parameter]) -> SetParametersResult:
        """Set all parameters or none.

        Raises:
            ParameterNotDeclaredException: A parameter is not declared.
        """
        parameter_list = list(parameter_list)
        for change in self._rosz_before:
            parameter_list = list(change(parameter_list))
        if not parameter_list:
            return SetParametersResult(successful=False, reason="no parameter is left to set")
        names = [parameter.name for parameter in parameter_list]
        missing = [name for name in names if name not in self._rosz_known]
        if missing:
            raise exceptions.ParameterNotDeclaredException(missing)
        reasons = [self._rosz_mismatch(parameter) for parameter in parameter_list]
        reason = next(filter(None, reasons), "") or self._rosz_refusal(parameter_list)
        if reason:
            return SetParametersResult(successful=False, reason=reason)
        for parameter in parameter_list:
            self._rosz_set(parameter)
        self._rosz_tell(parameter_list)
        return SetParametersResult(successful=True)

    def _rosz_mismatch(self, parameter: Parameter) -> str:
        """Return why a parameter cannot have a value; empty if it can."""
        descriptor = self._rosz_descriptors[parameter.name]
        declared, given = self._rosz_known[parameter.name].type_, parameter.type_
        if descriptor.read_only:
            return f"Trying to set a read-only parameter: {parameter.name}."
        if given is _Type.NOT_SET and not descriptor.dynamic_typing:
            return "Static parameter cannot be undeclared"
        if not descriptor.dynamic_typing and declared not in {given, _Type.NOT_SET}:
            return f"Wrong parameter type, expected '{declared:d}' got '{given:d}'"
        for limits in (*descriptor.integer_range, *descriptor.floating_point_range):
            if given in {_Type.INTEGER, _Type.DOUBLE}:
                return _outside(parameter, limits)
        return ""

    def add_on_set_parameters_callback(self, callback: _Callback) -> None:
        """Call a function that may refuse parameters before they are set."""
        self._rosz_checks.insert(0, callback)

    def remove_on_set_parameters_callback(self, callback: _Callback) -> None:
        """Remove a function of `add_on_set_parameters_callback`."""
        self._rosz_checks.remove(callback)

    def add_pre_set_parameters_callback(self, callback: _Callback) -> None:
        """Call a function that returns which parameters to set instead of given ones."""
        self._rosz_before.insert(0, callback)

    def remove_pre_set_parameters_callback(self, callback: _Callback) -> None:
        """Remove a function of `add_pre_set_parameters_callback`."""
        self._rosz_before.remove(callback)

    def add_post_set_parameters_callback(self, callback: _Callback) -> None:
        """Call a function with the parameters after they were set."""
        self._rosz_after.insert(0, callback)

    def remove_post_set_parameters_callback(self, callback: _Callback) -> None:
        """Remove a function of `add_post_set_parameters_callback`."""
        self._rosz_after.remove(callback)

    def _rosz_tell(self, parameters: list[Parameter]) -> None:
        for callback in self._rosz_after:
            callback(parameters)

    def _rosz_refusal(self, parameters: list[Parameter]) -> str:
        """Return why a callback refuses parameters; empty if all accept them."""
        for check in self._rosz_checks:
            result = check(parameters)
            if not result.successful:
                return result.reason or "a callback refuses it"
        return ""


class _DeclaredParameters:
    """Answers for the declared parameters of a node when another program asks for them."""

    def __init__(
        self, node: NodeParameters, call_soon: Callable[[Callable[[], object]], None]
    ) -> None:
        self._node = node
        self._call_soon = call_soon

    def describe(self, names: Sequence[str]) -> list[ParameterDescriptor]:
        """Return the descriptors of parameters; none if one is not declared."""
        try:
            kinds = [parameter.type_ for parameter in self._node.get_parameters(names)]
        except (
            exceptions.ParameterNotDeclaredException,
            exceptions.ParameterUninitializedException,
        ):
            return []
        return [
            replace(self._node.describe_parameter(name), name=name, type=int(kind))
            for name, kind in zip(names, kinds, strict=True)
        ]

    def change(self, parameters: Sequence[ParameterMessage]) -> SetParametersResult:
        """Let the executor set all parameters or none, since callbacks check them."""
        results: list[SetParametersResult] = []
        done = threading.Event()

        def change() -> None:
            try:
                own = [Parameter.from_parameter_msg(parameter) for parameter in parameters]
                results.append(self._node.set_parameters_atomically(own))
            except RoszError as error:
                results.append(SetParametersResult(successful=False, reason=str(error)))
            finally:
                done.set()

        self._call_soon(change)
        if not done.wait(_SPIN_SECONDS) or not results:
            reason = f"the node has not spun for {_SPIN_SECONDS:g} s"
            return SetParametersResult(successful=False, reason=reason)
        return results[0]


def _outside(parameter: Parameter, limits: Any) -> str:
    """Return why a number is not in a range; empty if it is."""
    low, high, step = limits.from_value, limits.to_value, limits.step
    name, value = parameter.name, parameter.value
    near = partial(math.isclose, rel_tol=1e-9)
    if near(value, low) or near(value, high):
        return ""
    if not low < value < high:
        return f"Parameter {name} out of range. Min: {low}, Max: {high}, value: {value}"
    if step and not near(round((value - low) / step) * step + low, value):
        return (
            f"The parameter value for {name} is not a valid step. Min: {low}, max: {high}, value:"
            f" {value}, step: {step}"
        )
    return ""


def _path(name: str) -> str:
    return f"~{name.replace('.', '/')}"


def _convert(name: str, value: Any, kind: Parameter.Type) -> Parameter:
    """Return a parameter of the declared type."""
    if kind is _Type.NOT_SET:
        return Parameter(name, None, value)
    if kind is _Type.DOUBLE and type(value) is int:
        value = float(value)  # YAML and ROS 1 write whole numbers without a point
    if kind is _Type.DOUBLE_ARRAY and isinstance(value, list):
        value = [float(element) if type(element) is int else element for element in value]
    if not kind.check(value):
        raise exceptions.InvalidParameterTypeException(name, kind.name, type_name(value))
    return Parameter(name, kind, value)
