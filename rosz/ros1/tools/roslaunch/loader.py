"""roslaunch.loader, xmlloader, substitution_args: launch files into a config, by rosz's plans."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rosz.environment import Environment
from rosz.errors import LaunchError, RoszError
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
from rosz.launch.plan.substitution import guess_type, parse_bool, substitute
from rosz.ros1.exceptions import raised_as
from rosz.ros1.importer import package_path
from rosz.ros1.tools.rosgraph.names import anonymous_name
from rosz.ros1.tools.roslaunch.core import (
    PHASE_SETUP,
    Machine,
    Node,
    Param,
    RLException,
    RosbinExecutable,
    Test,
)


class SubstitutionException(Exception):
    """A substitution is malformed or has no value."""


class ArgException(SubstitutionException):
    """An arg is not set."""


class LoadException(RLException):
    """A launch file cannot be used."""


class XmlParseException(LoadException):
    """A launch file cannot be read."""


def plan_context() -> SystemContext:
    """Return the packages, variables and files of this process."""
    return SystemContext(package_path(), os.environ, Path.cwd(), anonymous_name)


def resolve_args(
    arg_str: str,
    context: dict[str, Any] | None = None,
    resolve_anon: bool = True,
    filename: str | None = None,
) -> str:
    """Return a text with its substitutions applied.

    Args:
        arg_str: The text.
        context: Values of args under ``arg``, and made names under ``anon``, which grow here.
        resolve_anon: Whether to apply ``$(anon x)``.
        filename: Path of the launch file, for ``$(dirname)``.

    Raises:
        ArgException: An arg is not set.
        SubstitutionException: A substitution is malformed or has no value.
    """
    if not arg_str or (not resolve_anon and "$(anon" in arg_str):
        return arg_str
    values = {} if context is None else context
    file = filename or values.get("filename") or ""
    if "$(dirname)" in arg_str and not file:
        raise SubstitutionException("$(dirname) needs the path of a launch file, and there is none")
    args, anonymous = values.setdefault("arg", {}), values.setdefault("anon", {})
    try:
        return substitute(arg_str, plan_context(), args, anonymous, file)
    except LaunchError as error:
        unset = str(error).startswith("arg '")
        raise (ArgException if unset else SubstitutionException)(str(error)) from error


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


def _to_yaml(value: str) -> Any:
    import yaml

    try:
        return yaml.safe_load(value)
    except yaml.YAMLError as error:
        raise ValueError(f"'{value}' is not YAML: {error}") from error


_CONVERSIONS: dict[str, Callable[[str], Any]] = {
    "bool": parse_bool,
    "boolean": parse_bool,
    "double": float,
    "int": int,
    "str": str,
    "string": str,
    "yaml": _to_yaml,
}


class Loader:
    """Base class of loaders of launch files."""


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
            ros_config: Config that its contents are added to.
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
        with raised_as(XmlParseException, RoszError):
            if self.args_only:
                self.args = describe_args([source], given, plan_context(), ns=namespace)
                return
            read = plan([source], given, plan_context(), ns=namespace, assign_machines=False)
        _fill(config, read, core=core, verbose=verbose)


def _fill(config: Any, read: Plan, *, core: bool, verbose: bool) -> None:
    for file in read.files:
        config.add_roslaunch_file(file)
    for notice in (*read.warnings, *read.deprecations):
        config.add_config_error(str(notice))
    for step in read.setup:
        # ROS 1 writes the name of a dumped parameter as a namespace.
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


def _machine(machine: MachinePlan) -> Machine:
    return Machine(
        machine.name,
        machine.address,
        env_loader=machine.env_loader or None,
        ssh_port=machine.ssh_port,
        user=machine.user or None,
        password=machine.password or None,
        assignable=machine.assignable,
        timeout=machine.timeout,
    )


def _shared(node: NodePlan) -> dict[str, Any]:
    """Return the attributes that nodes and tests have."""
    return {
        "name": node.name,
        "namespace": node.namespace,
        "machine_name": node.machine or None,
        "args": shlex.join(node.args),
        "remap_args": [list(pair) for pair in node.remaps],
        "env_args": node.env,
        "cwd": node.cwd or None,
        "launch_prefix": shlex.join(node.launch_prefix) or None,
        "filename": node.place.file,
    }


def _node(node: NodePlan) -> Node:
    made = Node(
        node.package or "-",
        node.type or shlex.join(node.command),
        respawn=node.respawn,
        respawn_delay=node.respawn_delay,
        output=node.output,
        required=node.required,
        **_shared(node),
    )
    made.plan = node
    return made


def _test(test: TestPlan) -> Test:
    node = test.node
    made = Test(
        test.test_name,
        node.package,
        node.type,
        time_limit=test.time_limit,
        retry=test.retry,
        **_shared(node),
    )
    made.plan = node
    return made
