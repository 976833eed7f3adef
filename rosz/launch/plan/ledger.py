"""The plan while it is being made: what the tags read so far come to."""

from __future__ import annotations

from typing import Any

from msgspec.structs import replace

from rosz import names
from rosz.errors import LaunchFileError, ParamError, near_miss
from rosz.launch.plan.context import LaunchContext
from rosz.launch.plan.fault import TextFault
from rosz.launch.plan.model import (
    MachinePlan,
    NodePlan,
    Notice,
    ParamPlan,
    Place,
    Plan,
    SetupPlan,
    TestPlan,
)
from rosz.launch.plan.scope import join
from rosz.params.values import normalise

__all__ = ("Ledger",)

_RESERVED = "/rosout"


class Ledger:
    """Everything collected.

    Args:
        context: The outside.

    Attributes:
        context: The outside.
        files: Absolute paths of the files read; keys in order.
        setup: ``<rosparam>`` dumps and deletes.
        warnings: Warnings.
        deprecations: Texts of ``deprecated``.
        default_machine: Name of the machine for nodes that name none.
    """

    def __init__(self, context: LaunchContext) -> None:
        self.context = context
        self.files: dict[str, None] = {}
        self.setup: list[SetupPlan] = []
        self.warnings: list[Notice] = []
        self.deprecations: list[Notice] = []
        self.default_machine = ""
        self._clear: dict[str, None] = {}
        self._params: dict[str, ParamPlan] = {}
        self._above: dict[str, str] = {}
        self._machines: dict[str, MachinePlan] = {}
        self._nodes: dict[str, NodePlan] = {}
        self._tests: list[TestPlan] = []
        self._used: dict[tuple[object, ...], str] = {}

    def clear(self, ns: str) -> None:
        """Note a parameter namespace to clear."""
        self._clear.setdefault(names.canonical(ns))

    def add_param(self, name: str, value: Any, place: Place) -> None:
        """Add a parameter; it replaces an earlier one of the name, at that one's turn.

        Raises:
            TextFault: It has no name, or the value is none that a parameter can have.
        """
        name = names.canonical(name)
        if name == "/":
            raise TextFault("the root of all parameters takes no value; give a name")
        try:
            value = normalise(value)
        except ParamError as error:
            raise TextFault(f"parameter '{name}': {error}") from error
        parent = name
        while len(parent) > 1:
            parent = parent.rpartition("/")[0] or "/"
            known = self._params.get(parent)
            if known is not None:
                text = f"parameter '{name}' turns '{parent}', set at {known.place}, into a dict"
                self.warnings.append(Notice(text, place))
            self._above[parent] = name
        if name in self._above and name not in self._params:
            text = f"parameter '{name}' and '{self._above[name]}' below it are both set"
            self.warnings.append(Notice(text, place))
        if name.startswith("~"):
            text = f"'{name}' is private to the launcher here, not to a node; write it without '~'"
            self.warnings.append(Notice(text, place))
        self._params[name] = ParamPlan(name, value, place)

    def add_params(self, name: str, value: Any, place: Place) -> None:
        """Add a parameter, or each leaf of a dict.

        Raises:
            TextFault: A value has no name.
        """
        if not isinstance(value, dict):
            self.add_param(name, value, place)
            return
        for key, inner in value.items():
            self.add_params(join(name, key), inner, place)

    def add_machine(self, machine: MachinePlan) -> None:
        """Add a machine.

        Raises:
            TextFault: One of the name is there and differs.
        """
        known = self._machines.setdefault(machine.name, machine)
        same = _config(known) == _config(machine) and known.assignable == machine.assignable
        if not machine.name or not same:
            where = f", at {known.place}" if machine.name else ""
            raise TextFault(f"machine '{machine.name}' is declared already, and differs{where}")

    def add_node(self, node: NodePlan) -> None:
        """Add a node.

        Raises:
            TextFault: One of that full name is there.
        """
        name = node.full_name
        if name == _RESERVED:
            raise TextFault(f"'{name}' is the name of ROS's own log collector; choose another")
        known = self._nodes.setdefault(name, node)
        if known is not node:
            raise TextFault(
                f"two nodes are named '{name}', the other at {known.place}; "
                "give one another name or namespace"
            )

    def add_test(self, test: TestPlan) -> None:
        """Add a test; nothing keeps two from the same name."""
        self._tests.append(test)

    def free_name(self, ns: str, base: str) -> str:
        """Return a base name that no node in a namespace has yet."""
        name, number = base, 1
        while f"{ns.rstrip('/')}/{name}" in self._nodes:
            number += 1
            name = f"{base}_{number}"
        return name

    def finish(self, unused: tuple[str, ...]) -> Plan:
        """Return the plan, with nodes assigned to machines.

        Raises:
            LaunchFileError: A node names a machine that is not declared.
        """
        nodes = [self._assigned(node) for node in self._nodes.values()]
        tests = [replace(test, node=self._assigned(test.node)) for test in self._tests]
        return Plan(
            files=tuple(self.files),
            clear=tuple(ns for ns in self._clear if not self._cleared_above(ns)),
            setup=tuple(self.setup),
            params=tuple(self._params.values()),
            machines=tuple(self._machines.values()),
            nodes=tuple(nodes),
            tests=tuple(tests),
            unused_args=unused,
            warnings=tuple(self.warnings),
            deprecations=tuple(self.deprecations),
        )

    def _assigned(self, node: NodePlan) -> NodePlan:
        """Put a node on the first used of all machines that are configured alike."""
        if not node.machine:
            return node
        machine = self._machines.get(node.machine)
        if machine is None:
            hint = near_miss(node.machine, self._machines) or "; declare it with <machine>"
            place = node.place
            raise LaunchFileError(
                f"machine '{node.machine}' is not declared{hint}",
                place.file,
                place.line,
                place.column,
                place.includes,
            )
        return replace(node, machine=self._used.setdefault(_config(machine), machine.name))

    def _cleared_above(self, ns: str) -> bool:
        parents = ns.split("/")[1:-1]
        above = {"/"} if ns != "/" else set()
        above |= {"/" + "/".join(parents[: count + 1]) for count in range(len(parents))}
        return any(parent in self._clear for parent in above)


def _config(machine: MachinePlan) -> tuple[object, ...]:
    """Return what makes two machines the same one."""
    return (
        machine.address,
        machine.env_loader,
        machine.ssh_port,
        machine.user,
        machine.password,
        machine.timeout,
    )
