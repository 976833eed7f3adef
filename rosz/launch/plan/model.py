"""What a launch comes to once files, arguments and substitutions are settled.

All of it is frozen, compares by value and can be written as JSON (`Plan.to_json`). Whoever carries
a plan out needs nothing else: do `Plan.setup`, clear `Plan.clear`, write `Plan.params` in order,
then start `Plan.nodes`. That is the order of roslaunch.
"""

from __future__ import annotations

from typing import Any, Literal

import msgspec

from rosz.errors import NotFoundError, near_miss

__all__ = (
    "ArgDoc",
    "Condition",
    "MachinePlan",
    "NodePlan",
    "Notice",
    "ParamPlan",
    "Place",
    "Plan",
    "SetupPlan",
    "TestPlan",
    "Wait",
)


class Place(msgspec.Struct, frozen=True):
    """Where in which file something was written.

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
    """Something to tell the user that does not stop the launch.

    Attributes:
        text: What it is, lower case, without its place.
        place: Where it was found.
    """

    text: str
    place: Place

    def __str__(self) -> str:
        return f"{self.place}: {self.text}"


class ParamPlan(msgspec.Struct, frozen=True):
    """One parameter to be set before any node starts.

    The dicts of ``<rosparam>`` are unrolled into their leaves, and empty ones vanish, as roslaunch
    has it; a dict of ``<param type="yaml">`` is set whole.

    Attributes:
        name: Global name. One that begins with ``~`` comes from ``<rosparam param="~x">``, which
            roslaunch keeps so; `target` says where it ends up.
        value: What a parameter can have, see `rosz.params.values`.
        place: Where the value was written.
    """

    name: str
    value: Any
    place: Place

    @property
    def target(self) -> str:
        """The global name that the value is stored at."""
        return f"/roslaunch/{self.name[1:].lstrip('/')}" if self.name.startswith("~") else self.name


class SetupPlan(msgspec.Struct, frozen=True):
    """A ``<rosparam command="dump|delete">``, done before parameters are cleared and set.

    Attributes:
        action: ``dump`` writes the subtree to a file, ``delete`` removes it.
        name: Global name of the subtree, ``/`` for all.
        file: Path to dump to; empty for ``delete``.
        place: Where it was written.
    """

    action: Literal["dump", "delete"]
    name: str
    file: str
    place: Place


class Condition(msgspec.Struct, frozen=True):
    """Something that a node waits for.

    Attributes:
        kind: ``topic`` (is published), ``service``, ``param`` (is set) or ``node`` (lives).
        name: Global name.
    """

    kind: Literal["topic", "service", "param", "node"]
    name: str

    def __str__(self) -> str:
        return f"{self.kind} {self.name}"


class Wait(msgspec.Struct, frozen=True):
    """A wait before a node starts; it ends when any one of its conditions holds.

    Attributes:
        any_of: The conditions, at least one.
        timeout: Seconds after which the start fails.
        place: Where it was written.
    """

    any_of: tuple[Condition, ...]
    timeout: float
    place: Place


class MachinePlan(msgspec.Struct, frozen=True):
    """A ``<machine>``.

    Attributes:
        name: What nodes call it.
        address: Host name or address.
        env_loader: Path of a script on that machine that sets up the environment, or empty.
        ssh_port: Port of its ssh server.
        user: Login name, or empty for the present one.
        password: As written; keys are better.
        timeout: Seconds that it may take to come up.
        assignable: False for ``default="never"``.
        place: Where it was written.
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
        command: Program and arguments of an ``<executable>``, which is no ROS node: it gets neither
            remappings nor ``__name``; empty for a node.
        name: Base name, anonymous ones already made unique.
        named: False where the file gave no name and one was made up.
        namespace: Global, without a trailing slash; ``/`` for the root.
        machine: Name of one of `Plan.machines`; empty for this machine.
        args: Arguments of the program, split as a shell does.
        launch_prefix: What stands before the executable, split as a shell does.
        respawn: Start it again whenever it ends.
        respawn_delay: Seconds to wait before that.
        respawn_max: How often at most; None for no limit.
        required: The launch ends when it ends.
        output: ``screen`` or ``log``.
        cwd: ``node`` (the executable's folder), ``ROS_HOME``, or for an ``<executable>`` a path.
        remaps: (from, to) in order, as written.
        env: (name, value) in order, later ones win; without ``ROS_NAMESPACE``.
        wait_for: All of these are awaited before it starts.
        spawn_delay: Seconds to wait before it starts, after `wait_for`.
        place: Where it was written.
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
    cwd: str = "ROS_HOME"
    remaps: tuple[tuple[str, str], ...] = ()
    env: tuple[tuple[str, str], ...] = ()
    wait_for: tuple[Wait, ...] = ()
    spawn_delay: float = 0.0

    @property
    def full_name(self) -> str:
        """The global name of the node."""
        return f"{self.namespace.rstrip('/')}/{self.name}"


class TestPlan(msgspec.Struct, frozen=True):
    """A ``<test>``, which rostest runs and a launch leaves alone.

    Attributes:
        node: The process.
        test_name: Name for the result file.
        time_limit: Seconds after which it has failed.
        retry: How often to try again.
    """

    __test__ = False

    node: NodePlan
    test_name: str
    time_limit: float
    retry: int


class ArgDoc(msgspec.Struct, frozen=True):
    """An ``<arg>`` that the command line may set.

    Attributes:
        name: Its name.
        doc: Its ``doc``, or None.
        default: Its default with substitutions made, or None.
    """

    name: str
    doc: str | None
    default: str | None


class Plan(msgspec.Struct, frozen=True, kw_only=True):
    """A launch, settled.

    Attributes:
        files: Absolute paths of the files read, in order, each once.
        clear: Parameter namespaces to delete before `params` are set; none lies below another.
        setup: ``<rosparam>`` dumps and deletes, in order; done before anything else.
        params: Parameters to set, in order; no name twice.
        machines: Machines that the files declare.
        nodes: Processes, in order; no full name twice.
        tests: Tests, in order.
        unused_args: Arguments given that no file declares.
        warnings: What roslaunch merely warns about, and what it should.
        deprecations: Texts of ``<launch deprecated="…">``.
    """

    files: tuple[str, ...] = ()
    clear: tuple[str, ...] = ()
    setup: tuple[SetupPlan, ...] = ()
    params: tuple[ParamPlan, ...] = ()
    machines: tuple[MachinePlan, ...] = ()
    nodes: tuple[NodePlan, ...] = ()
    tests: tuple[TestPlan, ...] = ()
    unused_args: tuple[str, ...] = ()
    warnings: tuple[Notice, ...] = ()
    deprecations: tuple[Notice, ...] = ()

    def node(self, name: str) -> NodePlan:
        """Return the node or test of that full name, the node where there are both.

        Raises:
            NotFoundError: There is none; the message lists what there is.
        """
        known = {node.full_name: node for node in reversed(self.processes)}
        if name in known:
            return known[name]
        listing = f"; the nodes are {', '.join(sorted(known))}" if known else "; there are no nodes"
        raise NotFoundError(f"no node '{name}' in this launch{near_miss(name, known) or listing}")

    @property
    def processes(self) -> tuple[NodePlan, ...]:
        """Nodes, then those of tests."""
        return (*self.nodes, *(test.node for test in self.tests))

    def machine(self, name: str) -> MachinePlan | None:
        """Return a declared machine; None for the empty name, which is this machine.

        Raises:
            NotFoundError: No machine of that name is declared.
        """
        if not name:
            return None
        for machine in self.machines:
            if machine.name == name:
                return machine
        known = [machine.name for machine in self.machines]
        raise NotFoundError(f"no machine '{name}' in this launch{near_miss(name, known)}")

    def to_json(self) -> bytes:
        """Write the plan as JSON: fields by name, tuples as lists, bytes as base64."""
        return msgspec.json.encode(self)
