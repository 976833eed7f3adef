"""The parameters of a node of rclpy.

They live in rosz's parameter store below the node's name, where ``rosz param`` and launch files
read and write them; dots in their names are slashes there. What others set is checked and taken
over by the executor, as with ROS 2's parameter services.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

from rosz.msgs.rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rosz.params.values import type_name
from rosz.ros2.rclpy.exceptions import (
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterAlreadyDeclaredException,
    ParameterNotDeclaredException,
    ParameterUninitializedException,
)
from rosz.ros2.rclpy.parameter import Parameter

if TYPE_CHECKING:
    from rosz.node import Node as RoszNode
    from rosz.params.replica import Changed

__all__ = ("Declared",)

Check = Callable[[list[Parameter]], Any]
"""Gets parameters that are about to be set, and returns a SetParametersResult."""

_MISSING = object()


class Declared:
    """What a node has declared.

    Args:
        node: It.
        overrides: Values that the command line or the caller gives, by name.
        call_soon: Has a function called by the executor that spins the node.
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
        """Declare one; what the command line, a launch file or the store say counts more.

        Raises:
            ParameterAlreadyDeclaredException: It is declared already.
            InvalidParameterTypeException: The value that was given is of another type.
            InvalidParameterValueException: A check refuses it.
        """
        if name in self._known:
            raise ParameterAlreadyDeclaredException([name])
        kind = value if isinstance(value, Parameter.Type) else None
        default = Parameter(name, value=None if kind is not None else value)
        given = _MISSING if ignore_override else self._given(name)
        if given is _MISSING:
            chosen = default
        else:
            expected = kind or default.type_
            free = descriptor is not None and descriptor.dynamic_typing
            chosen = self._fitted(name, given, Parameter.Type.NOT_SET if free else expected)
        refusal = self._refusal([chosen])
        if refusal:
            raise InvalidParameterValueException(name, chosen.value, refusal)
        self._descriptors[name] = descriptor or ParameterDescriptor(name=name)
        self._known[name] = chosen
        self._store(chosen)
        self._node.params.watch(self._path(name), lambda change: self._changed(name, change))
        return chosen

    def _given(self, name: str) -> Any:
        if name in self._overrides:
            return self._overrides[name]
        return self._node.params.get(self._path(name), _MISSING)

    def _fitted(self, name: str, value: Any, kind: Parameter.Type) -> Parameter:
        """Return a parameter of the type that it has been declared with."""
        if kind is Parameter.Type.DOUBLE and type(value) is int:
            value = float(value)  # ROS 1's store and YAML write whole numbers without a point
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

    def _changed(self, name: str, change: Changed) -> None:
        """Have the executor take over what somebody else set."""
        del change
        self._call_soon(lambda: self._take_over(name))

    def _take_over(self, name: str) -> None:
        known = self._known.get(name)
        value = self._node.params.get(self._path(name), _MISSING)
        if known is None or value is _MISSING or value == known.value:
            return
        try:
            changed = self._fitted(name, value, known.type_)
        except InvalidParameterTypeException as error:
            self._node.log.warning("%s; it stays %r", error, known.value)
            return
        reason = self._refusal([changed])
        if reason:
            self._node.log.warning("parameter '%s' stays %r: %s", name, known.value, reason)
        else:
            self._known[name] = changed

    def has(self, name: str) -> bool:
        """Tell whether one is declared."""
        return name in self._known

    def get(self, name: str) -> Parameter:
        """Return one.

        Raises:
            ParameterNotDeclaredException: It is not declared.
            ParameterUninitializedException: It was declared by type alone, and is not set.
        """
        found = self._known.get(name)
        if found is None:
            raise ParameterNotDeclaredException(name)
        if found.type_ is Parameter.Type.NOT_SET and not self._descriptors[name].dynamic_typing:
            raise ParameterUninitializedException(name)
        return found

    def below(self, prefix: str) -> dict[str, Parameter]:
        """Return those whose names begin with a prefix and a dot, by the rest of their names."""
        start = f"{prefix}." if prefix else ""
        return {
            name.removeprefix(start): one
            for name, one in self._known.items()
            if name.startswith(start)
        }

    def descriptor(self, name: str) -> ParameterDescriptor:
        """Return what was said about one when it was declared.

        Raises:
            ParameterNotDeclaredException: It is not declared.
        """
        if name not in self._descriptors:
            raise ParameterNotDeclaredException(name)
        return self._descriptors[name]

    def set(self, parameters: Iterable[Parameter]) -> list[SetParametersResult]:
        """Set some, one after the other; see `set_together`."""
        return [self.set_together([one]) for one in parameters]

    def set_together(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        """Set some, or none of them where one may not be set.

        Raises:
            ParameterNotDeclaredException: One is not declared.
        """
        missing = [one.name for one in parameters if one.name not in self._known]
        if missing:
            raise ParameterNotDeclaredException(missing)
        reasons = [self._unfit(one) for one in parameters]
        reason = next(filter(None, reasons), "") or self._refusal(list(parameters))
        if reason:
            return SetParametersResult(successful=False, reason=reason)
        for one in parameters:
            self._known[one.name] = one
            self._store(one)
        return SetParametersResult(successful=True)

    def _unfit(self, parameter: Parameter) -> str:
        """Return why one cannot be set so; empty if it can."""
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
        """Forget one.

        Raises:
            ParameterNotDeclaredException: It is not declared.
        """
        if name not in self._known:
            raise ParameterNotDeclaredException(name)
        del self._known[name], self._descriptors[name]

    def add_check(self, check: Check) -> None:
        """Have a function asked before parameters are set."""
        self._checks.insert(0, check)

    def remove_check(self, check: Check) -> None:
        """Ask a function no more.

        Raises:
            ValueError: It was not asked.
        """
        self._checks.remove(check)

    def _refusal(self, parameters: list[Parameter]) -> str:
        """Return why a check refuses parameters; empty if none does."""
        for check in self._checks:
            result = check(parameters)
            if not result.successful:
                return result.reason or "a callback refuses it"
        return ""
