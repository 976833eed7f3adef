"""roslaunch.config: what launch files and scripts ask for, and the plan that it amounts to."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from typing import Any

import msgspec

from rosz.errors import RoszError
from rosz.launch.plan import MachinePlan, NodePlan, ParamPlan, Place, Plan
from rosz.ros1.rosgraph.names import anonymous_name
from rosz.ros1.roslaunch.core import (
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
from rosz.ros1.roslaunch.loader import XmlLoader
from rosz.ros1.roslaunch.substitution_args import SubstitutionException, resolve_args

__all__ = ("ROSLaunchConfig", "load_config_default", "namespaces_of", "node_plan")

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
        config_errors: Texts of what is doubtful in them.
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
        """Add a text about something doubtful."""
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
            node.machine = self._machine_of(node)

    def _machine_of(self, node: Node) -> Machine:
        found = self.machines.get(node.machine_name or "")
        if found is None:
            raise RLException(f"ERROR: unknown machine [{node.machine_name}]")
        return found

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
        known = self.machines.get(m.name)
        if known is not None:
            if known != m:
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
        """Return what there is to do.

        Raises:
            RLException: A node cannot be started as it is.
        """
        steps = [exe.step for exe in self.executables if exe.step is not None]
        return Plan(
            files=tuple(self.roslaunch_files),
            clear=tuple(name.rstrip("/") or "/" for name in self.clear_params),
            setup=tuple(steps),
            params=tuple(
                ParamPlan(param.key, param.value, _PLACE) for param in self.params.values()
            ),
            machines=tuple(_machine_plan(one) for name, one in self.machines.items() if name),
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
    """Return what starts a node.

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
        verbose: Whether to print what is added.
        assign_machines: Whether to find the machine of each node.
        ignore_unset_args: Passed to the loader.

    Raises:
        RLException: A file is refused, or a machine is not declared.
    """
    config = ROSLaunchConfig()
    used = loader or XmlLoader()
    used.ignore_unset_args = ignore_unset_args
    try:
        for given in roslaunch_files:
            file, argv = (given, None) if isinstance(given, str) else given
            used.load(file, config, argv=argv, verbose=verbose)
        for text in roslaunch_strs or ():
            used.load_string(text, config, verbose=verbose)
    except RoszError as error:
        raise RLException(str(error)) from error
    if assign_machines:
        config.assign_machines()
    return config


def namespaces_of(name: str) -> list[str]:
    """Return the namespaces that a full name lies in, from the root on.

    Raises:
        ValueError: The name is None or private, or relative.
        TypeError: The name is not a string.
    """
    if name is None:
        raise ValueError("name")
    if not isinstance(name, str):
        raise TypeError("name")
    if not name:
        return ["/"]
    parts = [part for part in name.split("/") if part]
    return ["/", *("/" + "/".join(parts[:end]) for end in range(1, len(parts)))]
