"""The launch plan: the result of reading launch files, and the builder that collects it.

A `Plan` is frozen, compares by value and can be written as JSON (`Plan.to_json`). To run one, do
`Plan.setup`, clear `Plan.clear`, write `Plan.params` in order, then start `Plan.nodes`. That is the
order of roslaunch.
"""

from __future__ import annotations

from typing import Any, Literal

import msgspec
from msgspec.structs import replace

from rosz import names
from rosz.errors import LaunchFileError, NotFoundError, ParamError, near_miss
from rosz.launch.plan.context import LaunchContext
from rosz.launch.plan.document import TextError
from rosz.launch.plan.scope import join
from rosz.params import normalise

_RESERVED = "/rosout"


class Place(msgspec.Struct, frozen=True):
    """A position in a launch file.

    Attributes:
        file: Path as it was given or included.
        line: 1-based line.
        column: 1-based column, in characters.
        includes: Places of the ``<include>`` tags that led to the file, outermost first.
    """

    file: str
    line: int = 0
    column: int = 0
    includes: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}" if self.line else self.file


class Notice(msgspec.Struct, frozen=True):
    """A message for the user that does not stop the launch.

    Attributes:
        text: Text in lower case, without the place.
        place: Position that the message is about.
    """

    text: str
    place: Place

    def __str__(self) -> str:
        return f"{self.place}: {self.text}"


class ParamPlan(msgspec.Struct, frozen=True):
    """A parameter to set before any node starts.

    A dict of ``<rosparam>`` becomes one parameter for each leaf, and empty dicts vanish, as in
    roslaunch; a dict of ``<param type="yaml">`` is set whole.

    Attributes:
        name: Global name. A name that begins with ``~`` comes from ``<rosparam param="~x">``, which
            roslaunch leaves as it is; see `target`.
        value: A parameter value, see `rosz.params.values`.
        place: Position of the tag.
    """

    name: str
    value: Any
    place: Place

    @property
    def target(self) -> str:
        """The global name under which the value is stored."""
        return f"/roslaunch/{self.name[1:].lstrip('/')}" if self.name.startswith("~") else self.name


class SetupPlan(msgspec.Struct, frozen=True):
    """A ``<rosparam command="dump|delete">``, run before parameters are cleared and set.

    Attributes:
        action: ``dump`` writes the subtree to a file, ``delete`` removes it.
        name: Global name of the subtree, ``/`` for all parameters.
        file: Path to dump to; empty for ``delete``.
        place: Position of the tag.
    """

    action: Literal["dump", "delete"]
    name: str
    file: str
    place: Place


class Condition(msgspec.Struct, frozen=True):
    """A condition that a node waits for.

    Attributes:
        kind: ``topic`` (has a publisher), ``service`` (has a server), ``param`` (is set) or
            ``node`` (is alive).
        name: Global name.
    """

    kind: Literal["topic", "service", "param", "node"]
    name: str

    def __str__(self) -> str:
        return f"{self.kind} {self.name}"


class Wait(msgspec.Struct, frozen=True):
    """A wait before a node starts, which ends when any one of its conditions holds.

    Attributes:
        any_of: The conditions, at least one.
        timeout: Time limit in seconds, after which the start fails.
        place: Position of the tag.
    """

    any_of: tuple[Condition, ...]
    timeout: float
    place: Place


class Trigger(msgspec.Struct, frozen=True):
    """What a process or a step of a launch waits for.

    Attributes:
        event: ``start`` or ``exit`` of a process.
        node: Full name of the process, or "" for any.
    """

    event: Literal["start", "exit"]
    node: str


class MachinePlan(msgspec.Struct, frozen=True):
    """A ``<machine>``.

    Attributes:
        name: Name that nodes refer to.
        address: Host name or address.
        env_loader: Path of a script on that machine that sets up the environment, or "".
        ssh_port: Port of the ssh server.
        user: Login name, or "" for the current one.
        password: Password as written; it is not used.
        timeout: Time limit in seconds for the connection.
        assignable: False for ``default="never"``.
        place: Position of the tag.
    """

    name: str
    address: str
    env_loader: str
    ssh_port: int
    user: str
    password: str
    timeout: float
    assignable: bool
    place: Place


class NodePlan(msgspec.Struct, frozen=True, kw_only=True):
    """A process to start.

    Attributes:
        package: Package of the executable; empty for an ``<executable>``.
        type: File name of the executable in the package; empty for an ``<executable>``.
        command: Program and arguments of an ``<executable>``, which is not a ROS node and gets
            neither remappings nor ``__name``; empty for a node.
        name: Base name; anonymous names are already unique.
        named: False if the file gives no name and one was generated.
        namespace: Global namespace without a trailing slash; ``/`` for the root.
        machine: Name of one of `Plan.machines`; empty for this machine.
        args: Arguments of the program, split as a shell does.
        launch_prefix: Words before the executable, split as a shell does.
        respawn: Whether to start the process again whenever it ends.
        respawn_delay: Delay before a respawn in seconds.
        respawn_max: Maximum number of respawns, or None for no limit.
        required: Whether the launch ends when the process ends.
        output: ``screen`` or ``log``.
        cwd: ``node`` (the executable's folder), a path for an ``<executable>``; "" is ``ROS_HOME``.
        remaps: (from, to) in order, as written.
        env: (name, value) in order; of equal names the last counts. Without ``ROS_NAMESPACE``.
        wait_for: Waits before the start; all of them must end.
        spawn_delay: Delay before the start in seconds, after `wait_for`.
        container: Full name of the container that runs it, or "" for a process of its own.
        by_reference: Whether rospy nodes in a container pass on messages, not copies of them.
        members: Nodes that the process runs if it is a container; a container has no package.
        ros2: Whether a launch file of ROS 2 has it. Then a node takes ROS 2's arguments, its own
            name if none is given, and has ``command`` if it is in no package.
        after: Event that it waits for first, or None.
        ros_params: Values, and paths of files, that such a node gets as arguments, in order.
        place: Position of the tag.
    """

    package: str
    type: str
    name: str
    namespace: str
    place: Place
    command: tuple[str, ...] = ()
    named: bool = True
    machine: str = ""
    args: tuple[str, ...] = ()
    launch_prefix: tuple[str, ...] = ()
    respawn: bool = False
    respawn_delay: float = 0.0
    respawn_max: int | None = None
    required: bool = False
    output: Literal["log", "screen"] = "log"
    cwd: str = ""
    remaps: tuple[tuple[str, str], ...] = ()
    env: tuple[tuple[str, str], ...] = ()
    wait_for: tuple[Wait, ...] = ()
    spawn_delay: float = 0.0
    container: str = ""
    by_reference: bool = False
    members: tuple[NodePlan, ...] = ()
    ros2: bool = False
    after: Trigger | None = None
    ros_params: tuple[str | dict[str, Any], ...] = ()

    @property
    def full_name(self) -> str:
        """The global name of the node."""
        return f"{self.namespace.rstrip('/')}/{self.name}"


class TestPlan(msgspec.Struct, frozen=True):
    """A ``<test>``, which rostest runs and a launch ignores.

    Attributes:
        node: The process.
        test_name: Name of the result file.
        time_limit: Time limit in seconds, after which the test has failed.
        retry: Number of further attempts.
    """

    __test__ = False

    node: NodePlan
    test_name: str
    time_limit: float
    retry: int


class StepPlan(msgspec.Struct, frozen=True):
    """What a launch does besides starting processes: it prints a text, and may end.

    Attributes:
        text: Text to print.
        place: Position of the action.
        shutdown: Whether the launch ends.
        after: Event that it waits for, or None for the begin of the launch.
        delay: Time in seconds that passes then.
    """

    text: str
    place: Place
    shutdown: bool = False
    after: Trigger | None = None
    delay: float = 0.0


class ArgDoc(msgspec.Struct, frozen=True):
    """An ``<arg>`` that the command line may set.

    Attributes:
        name: Name.
        doc: Value of ``doc``, or None.
        default: Default with substitutions applied, or None.
    """

    name: str
    doc: str | None
    default: str | None


class Plan(msgspec.Struct, frozen=True, kw_only=True):
    """A launch plan.

    Attributes:
        files: Absolute paths of the files read, in order, each once.
        clear: Parameter namespaces to delete before `params` are set; none is below another.
        setup: ``<rosparam>`` dumps and deletes, in order; run before anything else.
        params: Parameters to set, in order; no name twice.
        machines: Machines that the files declare.
        nodes: Processes, in order; no full name twice.
        tests: Tests, in order.
        steps: What else the launch does, in order.
        unused_args: Names of the args given that no file declares.
        warnings: Warnings, including some that roslaunch does not give.
        deprecations: Texts of ``<launch deprecated="…">``.
    """

    files: tuple[str, ...] = ()
    clear: tuple[str, ...] = ()
    setup: tuple[SetupPlan, ...] = ()
    params: tuple[ParamPlan, ...] = ()
    machines: tuple[MachinePlan, ...] = ()
    nodes: tuple[NodePlan, ...] = ()
    tests: tuple[TestPlan, ...] = ()
    steps: tuple[StepPlan, ...] = ()
    unused_args: tuple[str, ...] = ()
    warnings: tuple[Notice, ...] = ()
    deprecations: tuple[Notice, ...] = ()

    def node(self, name: str) -> NodePlan:
        """Return the node or test of a full name; the node if there are both.

        Raises:
            NotFoundError: If there is none.
        """
        nodes = {node.full_name: node for node in reversed(self.processes)}
        if name in nodes:
            return nodes[name]
        listing = (
            f"; the nodes are {', '.join(sorted(nodes))}" if nodes else "; the launch has no nodes"
        )
        raise NotFoundError(f"no node '{name}' in this launch{near_miss(name, nodes) or listing}")

    @property
    def processes(self) -> tuple[NodePlan, ...]:
        """The nodes, followed by the nodes of tests."""
        return (*self.nodes, *(test.node for test in self.tests))

    def machine(self, name: str) -> MachinePlan | None:
        """Return a declared machine, or None for the empty name, which is this machine.

        Raises:
            NotFoundError: If no machine of that name is declared.
        """
        if not name:
            return None
        for machine in self.machines:
            if machine.name == name:
                return machine
        declared = [machine.name for machine in self.machines]
        raise NotFoundError(f"no machine '{name}' in this launch{near_miss(name, declared)}")

    def to_json(self) -> bytes:
        """Return the plan as JSON: fields by name, tuples as lists, bytes as base64."""
        return msgspec.json.encode(self)


class PlanBuilder:
    """Collects the parts of a plan while tags are read.

    Attributes:
        files: Absolute paths of the files read, as keys in order.
        tests: The tests, of which two may have the same name.
        steps: What the launch does besides starting processes.
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
        self._child_of: dict[str, str] = {}
        self._machines: dict[str, MachinePlan] = {}
        self._nodes: dict[str, NodePlan] = {}
        self.tests: list[TestPlan] = []
        self.steps: list[StepPlan] = []
        self._first_used: dict[MachinePlan, str] = {}

    def clear(self, ns: str) -> None:
        """Add a parameter namespace to clear."""
        self._clear.setdefault(names.canonical(ns))

    def add_param(self, name: str, value: Any, place: Place) -> None:
        """Add a parameter; it takes the place of an earlier one of the same name.

        Raises:
            TextError: If the name is the root, or the value is not a parameter value.
        """
        name = names.canonical(name)
        if name == "/":
            raise TextError("the root of all parameters takes no value; give a name")
        try:
            value = normalise(value)
        except ParamError as error:
            raise TextError(f"parameter '{name}': {error}") from error
        parent = name
        while len(parent) > 1:
            parent = parent.rpartition("/")[0] or "/"
            above = self._params.get(parent)
            if above is not None:
                text = f"parameter '{name}' turns '{parent}', set at {above.place}, into a dict"
                self.warnings.append(Notice(text, place))
            self._child_of[parent] = name
        if name in self._child_of and name not in self._params:
            text = f"parameter '{name}' and '{self._child_of[name]}' below it are both set"
            self.warnings.append(Notice(text, place))
        if name.startswith("~"):
            text = f"'{name}' is private to the launcher here, not to a node; write it without '~'"
            self.warnings.append(Notice(text, place))
        self._params[name] = ParamPlan(name, value, place)

    def add_params(self, name: str, value: Any, place: Place) -> None:
        """Add a parameter, or for a dict each of its leaves.

        Raises:
            TextError: If `add_param` refuses one of them.
        """
        if not isinstance(value, dict):
            self.add_param(name, value, place)
            return
        for key, inner in value.items():
            self.add_params(join(name, key), inner, place)

    def add_machine(self, machine: MachinePlan) -> None:
        """Add a machine.

        Raises:
            TextError: If the name is empty, or used by a machine that differs.
        """
        other = self._machines.setdefault(machine.name, machine)
        same = _config(other) == _config(machine) and other.assignable == machine.assignable
        if not machine.name or not same:
            where = f", at {other.place}" if machine.name else ""
            raise TextError(f"machine '{machine.name}' is declared already, and differs{where}")

    def add_node(self, node: NodePlan) -> None:
        """Add a node.

        Raises:
            TextError: If another node has the same full name.
        """
        name = node.full_name
        if name == _RESERVED:
            raise TextError(f"'{name}' is the name of ROS's own log collector; choose another")
        other = self._nodes.setdefault(name, node)
        if other is not node:
            raise TextError(
                f"two nodes are named '{name}', the other at {other.place}; "
                "give one another name or namespace"
            )

    def unused_name(self, ns: str, base: str) -> str:
        """Return a base name that no node in a namespace has yet."""
        name, number = base, 1
        while f"{ns.rstrip('/')}/{name}" in self._nodes:
            number += 1
            name = f"{base}_{number}"
        return name

    def build(self, unused_args: tuple[str, ...], *, assign_machines: bool = True) -> Plan:
        """Return the plan.

        Raises:
            LaunchFileError: If a node names a machine that is not declared, or a container has the
                name of a node.
        """
        nodes, tests = list(self._nodes.values()), self.tests
        for node in nodes:
            other = self._nodes.get(node.container)
            if other is not None:
                raise _error(
                    f"container '{node.container}' of node '{node.full_name}' has the name of the"
                    f" node at {other.place}; give one of them another name",
                    node.place,
                )
        if assign_machines:
            nodes = [self._assign_machine(node) for node in nodes]
            tests = [replace(test, node=self._assign_machine(test.node)) for test in tests]
        return Plan(
            files=tuple(self.files),
            clear=tuple(ns for ns in self._clear if not self._parent_cleared(ns)),
            setup=tuple(self.setup),
            params=tuple(self._params.values()),
            machines=tuple(self._machines.values()),
            nodes=tuple(nodes),
            tests=tuple(tests),
            steps=tuple(self.steps),
            unused_args=unused_args,
            warnings=tuple(self.warnings),
            deprecations=tuple(self.deprecations),
        )

    def _assign_machine(self, node: NodePlan) -> NodePlan:
        """Assign a node to the first used machine of those with equal settings."""
        if not node.machine:
            return node
        machine = self._machines.get(node.machine)
        if machine is None:
            hint = near_miss(node.machine, self._machines) or "; declare it with <machine>"
            raise _error(f"machine '{node.machine}' is not declared{hint}", node.place)
        return replace(node, machine=self._first_used.setdefault(_config(machine), machine.name))

    def _parent_cleared(self, ns: str) -> bool:
        above = (f"{other.rstrip('/')}/" for other in self._clear if other != ns)
        return any(ns.startswith(parent) for parent in above)


def _error(reason: str, place: Place) -> LaunchFileError:
    return LaunchFileError(reason, place.file, place.line, place.column, place.includes)


def _config(machine: MachinePlan) -> MachinePlan:
    """Return a machine without what may differ between equal ones."""
    return replace(machine, name="", assignable=True, place=Place(""))
