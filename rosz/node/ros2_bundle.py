"""The services that every node of ROS 2 has: its parameters, and how its types are defined.

Those of one package share a queryable and its threads.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rosz.errors import ClosedError, ParamError
from rosz.msgs.rcl_interfaces.msg import SetParametersResult
from rosz.msgs.rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rosz.node.pool import Pool
from rosz.node.ros2_parameters import Ros2Parameters
from rosz.node.service import Service
from rosz.qos import PARAMETERS, SERVICES
from rosz.session import Query

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rosz.message import Service as ServiceType
    from rosz.msgs.rcl_interfaces.msg import Parameter
    from rosz.node.node import Node

__all__ = ("Bundle",)

_THREADS = 4
_ANY_HERE = "{domain}{node}/*/{package}::srv::dds_::$*/*"
Handler = Callable[[Any], Any]


class _Part(Service):
    """A service whose questions come by way of the bundle."""

    def __init__(
        self, bundle: Bundle, name: str, kind: type[ServiceType], handler: Handler
    ) -> None:
        self._bundle = bundle
        qos = PARAMETERS if kind._type_name.startswith("rcl_interfaces/") else SERVICES
        super().__init__(bundle.node, name, kind, handler, qos, 0)

    def _open(self, _threads: int) -> None:
        self._bundle.parts[self.key] = self


class Bundle:
    """The services of one node.

    Args:
        node: It.

    Attributes:
        parts: Each service by its key.

    Raises:
        ClosedError: The node is closed.
    """

    def __init__(self, node: Node) -> None:
        self.node = node
        self.parts: dict[str, _Part] = {}
        self._parameters = Ros2Parameters(node)
        self._open: list[Any] = []
        try:
            self._declare()
        except ClosedError:
            self.close()
            raise

    def _declare(self) -> None:
        node = self.node
        session, domain = node.context.session, node.context.domain
        services = self._services()
        for package in sorted({kind._type_name.partition("/")[0] for kind, _ in services.values()}):
            key = _ANY_HERE.format(domain=domain, node=node.name, package=package)
            questions = session.pull_queryable(key, complete=True)
            self._open.append(questions)
            Pool(_THREADS, f"rosz-ros2{node.name}", questions.receive, self._serve)
        for name, (kind, handler) in services.items():
            self._open.append(_Part(self, f"{node.name}/{name}", kind, handler))

    def _services(self) -> dict[str, tuple[type[ServiceType], Handler]]:
        it = self._parameters
        found: dict[str, tuple[type[ServiceType], Handler]] = {
            "describe_parameters": (DescribeParameters, lambda ask: [it.describe(ask.names)]),
            "get_parameters": (GetParameters, lambda ask: [it.get(ask.names)]),
            "get_parameter_types": (
                GetParameterTypes,
                lambda ask: [bytes(value.type for value in it.get(ask.names))],
            ),
            "list_parameters": (ListParameters, lambda ask: [it.names(ask.prefixes, ask.depth)]),
            "set_parameters": (
                SetParameters,
                lambda ask: [[self._set([parameter]) for parameter in ask.parameters]],
            ),
            "set_parameters_atomically": (
                SetParametersAtomically,
                lambda ask: [self._set(ask.parameters)],
            ),
        }
        if self.node.context.environment.distro != "humble":
            from rosz.msgs.type_description_interfaces.srv import GetTypeDescription
            from rosz.node.type_description import describe_type

            types = self.node.context.types
            found["get_type_description"] = (
                GetTypeDescription,
                lambda ask: describe_type(types, ask),
            )
        return found

    def _set(self, parameters: Iterable[Parameter]) -> SetParametersResult:
        try:
            self._parameters.write(parameters)
        except (ParamError, ClosedError) as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _serve(self, query: Query) -> None:
        part = self.parts.get(query.key)
        if part is None:
            query.close()
        else:
            part.serve(query)

    def close(self) -> None:
        """Undeclare them; again is no error."""
        while self._open:
            self._open.pop().close()
