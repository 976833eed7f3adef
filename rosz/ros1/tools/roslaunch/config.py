"""roslaunch.config: the contents of launch files, with additions of scripts, and their plan."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from typing import Any

import msgspec

from rosz.errors import RoszError
from rosz.launch.plan import MachinePlan, NodePlan, ParamPlan, Place, Plan
from rosz.ros1.exceptions import raised_as
from rosz.ros1.tools.rosgraph.names import anonymous_name
from rosz.ros1.tools.roslaunch.core import (
    Executable,
    Machine,
    Master,
    Node,
    Param,
    RLException,
    Test,
    local_machine,
    printlog,
)
from rosz.ros1.tools.roslaunch.loader import SubstitutionException, XmlLoader, resolve_args

_PLACE = Place("<script>")


class ROSLaunchConfig:
    """The nodes, parameters and machines of a launch.

    Attributes:
        nodes_core: The nodes of a core; there are none.
        nodes: The nodes.
        tests: The tests.
        params: The parameters by name.
        clear_params: Namespaces of parameters to clear.
        machines: The machines by name.
        executables: Commands to run.
        roslaunch_files: Paths of the launch files.
        config_errors: Warnings about the launch files.
        resolved_node_names: Full names of the nodes.
    """

    def __init__(self) -> None:
        self.master = Master()
        self.nodes_core: list[Node] = []
        self.nodes: list[Node] = []
        self.tests: list[Test] = []
        self.params: dict[str, Param] = {}
        self.clear_params: list[str] = []
        self.machines: dict[str, Machine] = {"": local_machine()}
        self.executables: list[Executable] = []
        self.roslaunch_files: list[str] = []
        self.config_errors: list[str] = []
        self.resolved_node_names: list[str] = []
        self.logger: None = None

    def add_roslaunch_file(self, f: str) -> None:
        """Add the path of a launch file."""
        if f not in self.roslaunch_files:
            self.roslaunch_files.append(f)

    def add_config_error(self, msg: str) -> None:
        """Add a warning about a launch file."""
        self.config_errors.append(msg)

    def set_master(self, m: Master) -> None:
        """Set the master, which nothing uses."""
        self.master = m

    def has_remote_nodes(self) -> bool:
        """Return whether a node runs on another machine."""
        own = local_machine()
        return any(node.machine is not None and node.machine != own for node in self.nodes)

    def assign_machines(self) -> None:
        """Find the machine of each node.

        Raises:
            RLException: A node names a machine that is not declared.
        """
        for node in (*self.nodes_core, *self.nodes, *self.tests):
            node.machine = self.machines.get(node.machine_name or "")
            if node.machine is None:
                raise RLException(f"ERROR: unknown machine [{node.machine_name}]")

    def summary(self, local: bool = False) -> str:
        """Return an overview of parameters, machines and nodes.

        Args:
            local: Whether to leave machines out.
        """
        from rosz.launch.run import describe_plan

        return describe_plan(self.to_plan(), machines=not local and self.has_remote_nodes())

    def add_executable(self, exe: Executable) -> None:
        """Add a command.

        Raises:
            ValueError: It is None.
        """
        if exe is None:
            raise ValueError("exe is None")
        self.executables.append(exe)

    def add_clear_param(self, param: str) -> None:
        """Add a namespace of parameters to clear."""
        self.clear_params.append(param)

    def add_param(self, p: Param, filename: str | None = None, verbose: bool = True) -> None:  # noqa: ARG002  # ROS 1's
        """Add a parameter; it replaces one of the same name."""
        self.params[p.key] = p

    def add_machine(self, m: Machine, verbose: bool = True) -> bool:
        """Add a machine.

        Returns:
            False if it is known already.

        Raises:
            RLException: Another one of the same name is known.
        """
        same_name = self.machines.get(m.name)
        if same_name is not None:
            if same_name != m:
                raise RLException(
                    f"Machine [{m.name}] already added and does not match duplicate entry"
                )
            return False
        self.machines[m.name] = m
        if verbose:
            printlog(f"Added machine [{m.name}]")
        return True

    def add_test(self, test: Test, verbose: bool = True) -> None:  # noqa: ARG002  # ROS 1's
        """Add a test."""
        self.tests.append(test)

    def add_node(self, node: Node, core: bool = False, verbose: bool = True) -> None:  # noqa: ARG002  # ROS 1's
        """Add a node.

        Args:
            node: The node.
            core: Whether it is a node of the core.
            verbose: Ignored.

        Raises:
            RLException: Another one has the same full name.
            ValueError: It is a node of the core, and has no package, type or name.
        """
        if node.name:
            full = f"{node.namespace}{node.name}"
            if full in self.resolved_node_names:
                raise RLException(
                    f"roslaunch file contains multiple nodes named [{full}].\nPlease check all"
                    " <node> 'name' attributes to make sure they are unique.\nAlso check that"
                    " $(anon id) use different ids."
                )
            self.resolved_node_names.append(full)
        elif core:
            raise ValueError("nodes of the core need a name")
        (self.nodes_core if core else self.nodes).append(node)

    def to_plan(self) -> Plan:
        """Return the plan of the launch.

        Raises:
            RLException: A node cannot be started as it is.
        """
        return Plan(
            files=tuple(self.roslaunch_files),
            clear=tuple(name.rstrip("/") or "/" for name in self.clear_params),
            setup=tuple(exe.step for exe in self.executables if exe.step is not None),
            params=tuple(
                ParamPlan(param.key, param.value, _PLACE) for param in self.params.values()
            ),
            machines=tuple(
                _machine_plan(machine) for name, machine in self.machines.items() if name
            ),
            nodes=tuple(node_plan(node) for node in (*self.nodes_core, *self.nodes)),
        )


def _machine_plan(machine: Machine) -> MachinePlan:
    return MachinePlan(
        machine.name,
        machine.address,
        machine.env_loader or "",
        machine.ssh_port,
        machine.user or "",
        machine.password or "",
        machine.timeout,
        machine.assignable,
        _PLACE,
    )


def node_plan(node: Node) -> NodePlan:
    """Return the plan of a node.

    Raises:
        RLException: Its arguments cannot be read.
    """
    try:
        args = shlex.split(resolve_args(node.args, resolve_anon=True))
        prefix = shlex.split(node.launch_prefix or "")
    except (SubstitutionException, ValueError) as error:
        raise RLException(f"node [{node.package}/{node.type}]: {error}") from error
    name = node.name or anonymous_name(node.type.partition(".")[0])
    changes: dict[str, Any] = {
        "name": name,
        "namespace": node.namespace.rstrip("/") or "/",
        "machine": node.machine_name or "",
        "args": tuple(args),
        "launch_prefix": tuple(prefix),
        "respawn": node.respawn,
        "respawn_delay": node.respawn_delay,
        "required": node.required,
        "output": "screen" if node.output == "screen" else "log",
        "remaps": tuple((old, new) for old, new in node.remap_args),
        "env": tuple((key, value) for key, value in node.env_args),
    }
    if node.cwd is not None or node.plan is None:
        changes["cwd"] = node.cwd or ""
    if node.plan is not None:
        return msgspec.structs.replace(node.plan, **changes)
    return NodePlan(package=node.package, type=node.type, place=_PLACE, **changes)


def load_config_default(  # noqa: PLR0917  # ROS 1's
    roslaunch_files: Sequence[str | tuple[str, Sequence[str]]],
    port: int | None,  # noqa: ARG001  # ROS 1's
    roslaunch_strs: Sequence[str] | None = None,
    loader: Any = None,
    verbose: bool = False,
    assign_machines: bool = True,
    ignore_unset_args: bool = False,
) -> ROSLaunchConfig:
    """Return the config of launch files.

    Args:
        roslaunch_files: Paths, or pairs of a path and a command line with values for its args.
        port: Ignored.
        roslaunch_strs: Texts of launch files.
        loader: What reads them; an `XmlLoader` when not given.
        verbose: Whether to print each addition.
        assign_machines: Whether to find the machine of each node.
        ignore_unset_args: Passed to the loader.

    Raises:
        RLException: A file is refused, or a machine is not declared.
    """
    config = ROSLaunchConfig()
    used = loader or XmlLoader()
    used.ignore_unset_args = ignore_unset_args
    with raised_as(RLException, RoszError):
        for given in roslaunch_files:
            file, argv = (given, None) if isinstance(given, str) else given
            used.load(file, config, argv=argv, verbose=verbose)
        for text in roslaunch_strs or ():
            used.load_string(text, config, verbose=verbose)
    if assign_machines:
        config.assign_machines()
    return config
