"""rclpy.parameter_service: the declared parameters of a node, as its services show them."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from rosz.errors import ParamError, RoszError
from rosz.msgs.rcl_interfaces.msg import Parameter as ParameterMessage
from rosz.msgs.rcl_interfaces.msg import ParameterDescriptor, ParameterValue
from rosz.node.ros2 import Ros2Parameters
from rosz.ros2.rclpy.parameter import NodeParameters, Parameter

__all__ = ("DeclaredParameters",)

_SPIN_SECONDS = 10.0
"""Time that a request waits for the node to be spun."""


class DeclaredParameters(Ros2Parameters):
    """Serve what a node has declared, and set it as the node's own ``set_parameters`` does.

    Requests run on the executor of the node, as in rclpy: its callbacks may refuse values.

    Args:
        node: The node.
        call_soon: Function that lets the executor call another one.
    """

    def __init__(
        self, node: NodeParameters, call_soon: Callable[[Callable[[], object]], None]
    ) -> None:
        super().__init__(node.rosz_node)
        self._declared = node
        self._call_soon = call_soon

    def _all(self) -> Mapping[str, Any]:
        return self._declared.get_parameters_by_prefix("")

    def get(self, names: Iterable[str]) -> list[ParameterValue]:
        """Return the values of some parameters; "not set" for those that are not declared."""
        declared = self._all()
        return [
            declared[name].get_parameter_value() if name in declared else ParameterValue()
            for name in names
        ]

    def describe(self, names: Iterable[str]) -> list[ParameterDescriptor]:
        """Return the descriptors of some parameters, with their types."""
        declared, descriptors = self._all(), []
        for name in names:
            descriptor = ParameterDescriptor(name)
            if name in declared:
                descriptor = self._declared.describe_parameter(name)
                descriptor.name, descriptor.type = name, int(declared[name].type_)
            descriptors.append(descriptor)
        return descriptors

    def write(self, parameters: Iterable[ParameterMessage]) -> None:
        """Set parameters as one change, on the executor.

        Raises:
            ParamError: The node refuses them, or it is not spun within 10 s.
        """
        changes = [Parameter.from_parameter_msg(message) for message in parameters]
        finished = threading.Event()
        reasons: list[str] = []

        def apply() -> None:
            try:
                result = self._declared.set_parameters_atomically(changes)
                if not result.successful:
                    reasons.append(result.reason or "the node refuses it")
            except RoszError as error:
                reasons.append(str(error))
            finally:
                finished.set()

        self._call_soon(apply)
        if not finished.wait(_SPIN_SECONDS):
            reasons.append(f"'{self._declared.rosz_node.name}' was not spun within 10 s")
        if reasons:
            raise ParamError(reasons[0])
