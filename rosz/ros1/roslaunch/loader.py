"""roslaunch.loader and roslaunch.xmlloader: launch files into a config, by `rosz.launch.plan`."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rosz.environment import Environment
from rosz.errors import RoszError
from rosz.launch.plan import (
    LaunchText,
    MachinePlan,
    NodePlan,
    Plan,
    SystemContext,
    TestPlan,
    describe_args,
    parse_arguments,
    plan,
)
from rosz.launch.plan.substitution import guess_type
from rosz.ros1.importer import package_path
from rosz.ros1.rosgraph.names import anonymous_name
from rosz.ros1.roslaunch.core import (
    PHASE_SETUP,
    Machine,
    Node,
    Param,
    RLException,
    RosbinExecutable,
    Test,
)

__all__ = (
    "LoadException",
    "Loader",
    "XmlLoader",
    "XmlParseException",
    "convert_value",
    "plan_context",
)


class LoadException(RLException):
    """A launch file cannot be used."""


class XmlParseException(LoadException):
    """A launch file cannot be read."""


def plan_context() -> SystemContext:
    """Return the packages, variables and files of this process."""
    return SystemContext(package_path(), os.environ, Path.cwd(), anonymous_name)


def convert_value(value: str, type_: str | None) -> Any:
    """Return a text as a value of a type, as ``<param>`` does.

    Args:
        value: The text.
        type_: ``int``, ``double``, ``bool``, ``str`` or ``yaml``; guessed when ``auto`` or None.

    Raises:
        ValueError: The text does not have the type.
    """
    kind = (type_ or "auto").lower()
    if kind == "auto":
        return guess_type(value.strip())
    if kind not in _CONVERSIONS:
        raise ValueError(f"Unknown type '{type_}'")
    return _CONVERSIONS[kind](value)


def _to_bool(value: str) -> bool:
    text = value.strip().lower()
    if text not in {"true", "1", "false", "0"}:
        raise ValueError(f"{value} is not a 'bool' type")
    return text in {"true", "1"}


def _to_yaml(value: str) -> Any:
    import yaml

    try:
        return yaml.safe_load(value)
    except yaml.YAMLError as error:
        raise ValueError(f"'{value}' is not YAML: {error}") from error


_CONVERSIONS: dict[str, Callable[[str], Any]] = {
    "bool": _to_bool,
    "boolean": _to_bool,
    "double": float,
    "int": int,
    "str": str,
    "string": str,
    "yaml": _to_yaml,
}


class Loader:
    """Base class of what loads launch files."""


class XmlLoader(Loader):
    """Reads launch files into a config.

    Args:
        resolve_anon: Ignored: anonymous names are always made.
        args_only: Whether to read only the declared args, into `args`.

    Attributes:
        args: The args that the last file takes, if only those were read.
        ignore_unset_args: Ignored: an arg without a value is an error.
    """

    def __init__(self, resolve_anon: bool = True, args_only: bool = False) -> None:
        self.resolve_anon = resolve_anon
        self.args_only = args_only
        self.ignore_unset_args = False
        self.args: tuple[Any, ...] = ()

    def load(
        self,
        filename: str,
        ros_config: Any,
        core: bool = False,
        argv: Sequence[str] | None = None,
        verbose: bool = True,
    ) -> None:
        """Read a file.

        Args:
            filename: Its path.
            ros_config: What to add its contents to.
            core: Whether its nodes are those of a core.
            argv: Command line with values for its args; that of the process when not given.
            verbose: Passed to the config.

        Raises:
            XmlParseException: The file is refused or cannot be read.
        """
        words = sys.argv if argv is None else argv
        self._read(filename, ros_config, words, core=core, verbose=verbose)

    def load_string(
        self, xml_text: str, ros_config: Any, core: bool = False, verbose: bool = True
    ) -> None:
        """Read the text of a launch file; see `load`.

        Raises:
            XmlParseException: The text is refused.
        """
        self._read(LaunchText(xml_text), ros_config, sys.argv, core=core, verbose=verbose)

    def _read(
        self,
        source: str | LaunchText,
        config: Any,
        argv: Sequence[str],
        *,
        core: bool,
        verbose: bool,
    ) -> None:
        given = parse_arguments(argv).args
        namespace = Environment.read().namespace
        try:
            if self.args_only:
                self.args = describe_args([source], given, plan_context(), ns=namespace)
                return
            read = plan([source], given, plan_context(), ns=namespace, assign_machines=False)
        except RoszError as error:
            raise XmlParseException(str(error)) from error
        _fill(config, read, core=core, verbose=verbose)


def _fill(config: Any, read: Plan, *, core: bool, verbose: bool) -> None:
    """Add what launch files amount to to a config."""
    for file in read.files:
        config.add_roslaunch_file(file)
    for notice in (*read.warnings, *read.deprecations):
        config.add_config_error(str(notice))
    for step in read.setup:
        # ROS 1 names what it dumps as a namespace.
        words = (
            ("dump", step.file, f"{step.name.rstrip('/')}/")
            if step.action == "dump"
            else ("delete", step.name)
        )
        command = RosbinExecutable("rosparam", words, PHASE_SETUP)
        command.step = step
        config.add_executable(command)
    for name in read.clear:
        config.add_clear_param(f"{name.rstrip('/')}/")
    for machine in read.machines:
        config.add_machine(_machine(machine), verbose=verbose)
    for param in read.params:
        config.add_param(
            Param(param.target, param.value), filename=param.place.file, verbose=verbose
        )
    for node in read.nodes:
        config.add_node(_node(node), core=core, verbose=verbose)
    for test in read.tests:
        config.add_test(_test(test), verbose=verbose)


def _machine(found: MachinePlan) -> Machine:
    return Machine(
        found.name,
        found.address,
        env_loader=found.env_loader or None,
        ssh_port=found.ssh_port,
        user=found.user or None,
        password=found.password or None,
        assignable=found.assignable,
        timeout=found.timeout,
    )


def _shared(found: NodePlan) -> dict[str, Any]:
    """Return the attributes that nodes and tests have."""
    return {
        "name": found.name,
        "namespace": found.namespace,
        "machine_name": found.machine or None,
        "args": shlex.join(found.args),
        "remap_args": [list(pair) for pair in found.remaps],
        "env_args": found.env,
        "cwd": found.cwd or None,
        "launch_prefix": shlex.join(found.launch_prefix) or None,
        "filename": found.place.file,
    }


def _node(found: NodePlan) -> Node:
    made = Node(
        found.package or "-",
        found.type or shlex.join(found.command),
        respawn=found.respawn,
        respawn_delay=found.respawn_delay,
        output=found.output,
        required=found.required,
        **_shared(found),
    )
    made.plan = found
    return made


def _test(found: TestPlan) -> Test:
    node = found.node
    made = Test(
        found.test_name,
        node.package,
        node.type,
        time_limit=found.time_limit,
        retry=found.retry,
        **_shared(node),
    )
    made.plan = node
    return made
