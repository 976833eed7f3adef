"""The services that every node of ROS 2 has: its parameters, and how its types are defined.

A private parameter has a dotted name there: ``/talker/gains/p`` of the store is the parameter
``gains.p`` of the node ``/talker``. ROS 2 has values of ten types. Other values of the store, such
as lists of mixed items, appear as YAML text, and cannot be set from there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from rosz.errors import ClosedError, ParamError
from rosz.lifecycle import Lifecycle
from rosz.message import Service as ServiceType
from rosz.msgs.rcl_interfaces.msg import (
    ListParametersResult,
    Parameter,
    ParameterDescriptor,
    ParameterType,
    ParameterValue,
    SetParametersResult,
)
from rosz.msgs.rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rosz.node.core import NodeCore
from rosz.node.ros2.values import from_ros2, to_ros2, type_of
from rosz.node.service import Service
from rosz.node.standard import follow_clock
from rosz.params import DELETED, Change, Path, Value, condense, joined, leaves, split, type_name
from rosz.qos import PARAMETERS, SERVICES
from rosz.session import Query
from rosz.worker import Worker

_THREADS = 4
_OF_PACKAGE = "{domain}{node}/*/{package}::srv::dds_::$*/*"
_Handler = Callable[[Any], Any]

_DOT = "."
_SIM_TIME = "use_sim_time"
_DESCRIBES_TYPES = "start_type_description_service"
"""A parameter of every node of rclpy."""


class Ros2Parameters:
    """The private parameters of a node as ROS 2 sees them.

    Args:
        node: The node.
    """

    def __init__(self, node: NodeCore) -> None:
        self._node = node
        self._base = split(node.name)

    def values(self) -> dict[str, tuple[Path, Value]]:
        """Return the paths in the store and the values of all parameters, by name."""
        top = self._node.params.get(self._node.name, None)
        own = leaves(top, self._base) if type(top) is dict else ()
        return {_DOT.join(path[len(self._base) :]): (path, value) for path, value in own}

    def get(self, names: Iterable[str]) -> list[ParameterValue]:
        """Return the values of some parameters; "not set" for those that do not exist.

        Of a program that declares its parameters, none if one of them is not declared, as rclpy.
        """
        values = self._all()
        names = list(names)
        if self._node.parameter_owner is not None and not values.keys() >= set(names):
            return []
        return [to_ros2(values[name]) if name in values else ParameterValue() for name in names]

    def describe(self, names: Iterable[str]) -> list[ParameterDescriptor]:
        """Return descriptions of some parameters, which may be set to values of any type."""
        owner = self._node.parameter_owner
        if owner is not None:
            own = ParameterDescriptor(
                _DESCRIBES_TYPES, ParameterType.PARAMETER_BOOL, read_only=True
            )
            wanted = list(names)
            described = owner.describe([name for name in wanted if name != own.name])
            by_name = {each.name: each for each in (*described, own)}
            return [by_name[name] for name in wanted if name in by_name]
        values = self._all()
        return [
            _described(name, values[name]) if name in values else ParameterDescriptor(name)
            for name in names
        ]

    def names(self, prefixes: Iterable[str], depth: int) -> ListParametersResult:
        """Return the names of parameters, and their prefixes (what precedes the last dot).

        Args:
            prefixes: Prefixes of the names to return; all names if there are none.
            depth: Largest number of levels below a prefix; 0 for all.
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
            ParamError: One of them cannot be set to its value; none is changed then.
            ClosedError: The node is shut down.
        """
        present = self.values()
        changes = [self._change(parameter, present) for parameter in parameters]
        replica = self._node.context.params
        replica.write(condense(changes), origin=f"{self._node.name} for ROS 2 ({replica.label})")
        if any(path == (*self._base, _SIM_TIME) for path, _ in changes):
            follow_clock(self._node)

    def _all(self) -> dict[str, Value]:
        """Return the values by name, with ``use_sim_time``, which every node of ROS 2 has."""
        values = {name: value for name, (_, value) in self.values().items()}
        if self._node.parameter_owner is not None:
            values = {_DESCRIBES_TYPES: True, **values}
        return {_SIM_TIME: self._node.clock.simulated, **values}

    def _change(self, parameter: Parameter, present: Mapping[str, tuple[Path, Value]]) -> Change:
        name, value = parameter.name, from_ros2(parameter.value)
        if name == _SIM_TIME and type(value) is not bool and value is not DELETED:
            raise ParamError(f"'{name}' cannot be the {type_name(value)} {value!r}; expected bool")
        if name in present:
            path, before = present[name]
            if type_of(before) == ParameterType.PARAMETER_NOT_SET:
                raise ParamError(
                    f"'{name}' is a {type_name(before)} that ROS 2 has no type for: set"
                    f" '{joined(path)}' with 'rosz param set'"
                )
            return path, value
        path = split(joined((*self._base, *name.split(_DOT))))
        if path == self._base:
            raise ParamError(f"'{name}' is not the name of a parameter")
        if value is DELETED:
            raise ParamError(f"'{name}' is not set")
        if any(other.startswith(f"{name}{_DOT}") for other in present):
            raise ParamError(f"'{name}' is not a parameter: there are parameters below it")
        return path, value


def _lies_below(name: list[str], prefix: list[str], depth: int) -> bool:
    if name[: len(prefix)] != prefix:
        return False
    return not depth or len(name) - len(prefix) <= depth


def _described(name: str, value: Any) -> ParameterDescriptor:
    number = type_of(value)
    if number == ParameterType.PARAMETER_NOT_SET:
        return ParameterDescriptor(
            name,
            ParameterType.PARAMETER_STRING,
            additional_constraints=f"YAML of a {type_name(value)}, which ROS 2 has no type for",
            read_only=True,
        )
    return ParameterDescriptor(name, number, dynamic_typing=True)


class Ros2ParameterServices:
    """The services of one node; those of one package share a queryable and its threads.

    Args:
        node: The node.

    Attributes:
        services: The services by their keys.

    Raises:
        ClosedError: The node is closed.
    """

    def __init__(self, node: NodeCore) -> None:
        self.node = node
        self.services: dict[str, _SharedService] = {}
        self._parameters = Ros2Parameters(node)
        self._lifecycle = Lifecycle("the parameter services", log=node.log)
        try:
            self._declare()
        except ClosedError:
            self.close()
            raise

    def _declare(self) -> None:
        node, keep = self.node, self._lifecycle.keep
        kinds = self._kinds()
        queryables = []
        for package in sorted({kind._type_name.partition("/")[0] for kind, _ in kinds.values()}):
            key = _OF_PACKAGE.format(domain=node.context.domain, node=node.name, package=package)
            queryables.append(keep(node.context.session.pull_queryable(key, complete=True)))
        for name, (kind, handler) in kinds.items():
            keep(_SharedService(self, f"{node.name}/{name}", kind, handler))
        # A client that sees the first service may call any: requests wait until all are there.
        for each in queryables:
            Worker(f"rosz-ros2{node.name}", self._serve, receive=each.receive, threads=_THREADS)

    def _kinds(self) -> dict[str, tuple[type[ServiceType], _Handler]]:
        """Return the types and handlers of the services by their names."""
        own = self._parameters
        kinds: dict[str, tuple[type[ServiceType], _Handler]] = {
            "describe_parameters": (DescribeParameters, lambda ask: [own.describe(ask.names)]),
            "get_parameters": (GetParameters, lambda ask: [own.get(ask.names)]),
            "get_parameter_types": (
                GetParameterTypes,
                lambda ask: [bytes(value.type for value in own.get(ask.names))],
            ),
            "list_parameters": (ListParameters, lambda ask: [own.names(ask.prefixes, ask.depth)]),
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
            from rosz.node.ros2.types import describe_type

            types = self.node.context.types
            kinds["get_type_description"] = (
                GetTypeDescription,
                lambda ask: describe_type(types, ask),
            )
        return kinds

    def _set(self, parameters: Iterable[Parameter]) -> SetParametersResult:
        if self.node.parameter_owner is not None:
            changes = list(parameters)
            if any(each.name == _DESCRIBES_TYPES for each in changes):
                reason = f"Trying to set a read-only parameter: {_DESCRIBES_TYPES}."
                return SetParametersResult(successful=False, reason=reason)
            result: SetParametersResult = self.node.parameter_owner.change(changes)
            return result
        try:
            self._parameters.write(parameters)
        except (ParamError, ClosedError) as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _serve(self, query: Query) -> None:
        service = self.services.get(query.key)
        if service is None:
            query.close()
        else:
            service.serve(query)

    def close(self) -> None:
        """Undeclare the services; a second call has no effect."""
        self._lifecycle.close()


class _SharedService(Service):
    """A service whose requests arrive at the queryable of its package."""

    def __init__(
        self, owner: Ros2ParameterServices, name: str, kind: type[ServiceType], handler: _Handler
    ) -> None:
        self._owner = owner
        qos = PARAMETERS if kind._type_name.startswith("rcl_interfaces/") else SERVICES
        super().__init__(owner.node, name, kind, handler, qos, 0)

    def _open(self, _threads: int) -> None:
        self._owner.services[self.key] = self
