"""What nodes of rclpy offer for their parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from rosz.msgs.rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rosz.ros2.rclpy.declared import Declared
from rosz.ros2.rclpy.exceptions import ParameterNotDeclaredException
from rosz.ros2.rclpy.parameter import Parameter

__all__ = ("NodeParameters",)


class NodeParameters:
    """The parameters of a node."""

    _rosz_declared: Declared

    def declare_parameter(
        self,
        name: str,
        value: Any = None,
        descriptor: ParameterDescriptor | None = None,
        ignore_override: bool = False,
    ) -> Parameter:
        """Declare a parameter; what the command line or a launch file says counts more.

        Args:
            name: Its name.
            value: Its default value, or a ``Parameter.Type`` for one without.
            descriptor: What there is to say about it.
            ignore_override: Whether the default counts, whatever else is said.

        Raises:
            ParameterAlreadyDeclaredException: It is declared already.
            InvalidParameterTypeException: What was given is of another type.
        """
        return self._rosz_declared.declare(name, value, descriptor, ignore_override)

    def declare_parameters(
        self, namespace: str, parameters: Sequence[tuple[Any, ...]], ignore_override: bool = False
    ) -> list[Parameter]:
        """Declare several parameters: tuples of what `declare_parameter` takes.

        Args:
            namespace: What their names begin with, before a dot; may be empty.
            parameters: Name, and perhaps default value and descriptor, of each.
            ignore_override: Whether the defaults count.
        """
        start = f"{namespace}." if namespace else ""
        declared: list[Parameter] = []
        for name, *rest in parameters:
            value, descriptor = (*rest, None, None)[:2]
            declared.append(
                self._rosz_declared.declare(start + name, value, descriptor, ignore_override)
            )
        return declared

    def undeclare_parameter(self, name: str) -> None:
        """Forget a parameter."""
        self._rosz_declared.undeclare(name)

    def has_parameter(self, name: str) -> bool:
        """Tell whether a parameter is declared."""
        return self._rosz_declared.has(name)

    def get_parameter(self, name: str) -> Parameter:
        """Return a parameter.

        Raises:
            ParameterNotDeclaredException: It is not declared.
            ParameterUninitializedException: It was declared by type alone, and is not set.
        """
        return self._rosz_declared.get(name)

    def get_parameters(self, names: Sequence[str]) -> list[Parameter]:
        """Return several parameters."""
        return [self._rosz_declared.get(name) for name in names]

    def get_parameter_or(self, name: str, alternative_value: Any = None) -> Any:
        """Return a parameter, or something else where it is not declared."""
        try:
            return self._rosz_declared.get(name)
        except ParameterNotDeclaredException:
            return alternative_value

    def get_parameters_by_prefix(self, prefix: str) -> dict[str, Parameter]:
        """Return the parameters of a namespace, by the rest of their names."""
        return self._rosz_declared.below(prefix)

    def describe_parameter(self, name: str) -> ParameterDescriptor:
        """Return what was said about a parameter when it was declared."""
        return self._rosz_declared.descriptor(name)

    def set_parameters(self, parameter_list: Sequence[Parameter]) -> list[SetParametersResult]:
        """Set parameters; each result tells whether that one was set."""
        return self._rosz_declared.set(parameter_list)

    def set_parameters_atomically(self, parameter_list: Sequence[Parameter]) -> SetParametersResult:
        """Set all parameters or none."""
        return self._rosz_declared.set_together(parameter_list)

    def add_on_set_parameters_callback(self, callback: Callable[[list[Parameter]], Any]) -> None:
        """Have a function asked before parameters are set."""
        self._rosz_declared.add_check(callback)

    def remove_on_set_parameters_callback(self, callback: Callable[[list[Parameter]], Any]) -> None:
        """Ask a function no more."""
        self._rosz_declared.remove_check(callback)
