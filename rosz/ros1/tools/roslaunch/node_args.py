"""roslaunch.node_args, param_dump, arg_dump and rlutil: launch files, described and checked."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rosz.errors import RoszError
from rosz.launch.plan import ArgDoc, describe_args
from rosz.launch.run import report
from rosz.ros1.exceptions import raised_as
from rosz.ros1.importer import package_path
from rosz.ros1.tools.roslaunch.config import ROSLaunchConfig, load_config_default, node_plan
from rosz.ros1.tools.roslaunch.core import Machine, Node, RLException
from rosz.ros1.tools.roslaunch.loader import plan_context


class NodeParamsException(Exception):
    """The node does not exist, or it cannot be started."""


def get_node_list(config: ROSLaunchConfig) -> list[str]:
    """Return the full names of the nodes and tests of a config."""
    named = (node for node in (*config.nodes, *config.tests) if node.name)
    return sorted(f"{node.namespace}{node.name}" for node in named)


def get_node_args(node_name: str, roslaunch_files: Sequence[str]) -> list[str]:
    """Return the command line of a node, with its variables in front.

    Raises:
        NodeParamsException: The node does not exist, or its program is not there.
    """
    node = _find(node_name, roslaunch_files)
    changed = {
        name: value
        for name, value in report.environment(node_plan(node)).items()
        if os.environ.get(name) != value
    }
    return [
        *(f"{name}={value}" for name, value in changed.items()),
        *create_local_process_args(node, None),
    ]


def _find(node_name: str, roslaunch_files: Sequence[str]) -> Node:
    with raised_as(NodeParamsException, RLException):
        config = load_config_default(roslaunch_files, None)
    wanted = f"/{node_name.strip('/')}"
    for node in (*config.nodes, *config.tests):
        if node.name and f"{node.namespace}{node.name}" == wanted:
            return node
    names = "\n".join(f" * {name}" for name in get_node_list(config))
    raise NodeParamsException(
        f"ERROR: Cannot find node named [{node_name}] in [{', '.join(roslaunch_files)}].\nNode"
        f" names are:\n{names}"
    )


def create_local_process_args(
    node: Node,
    machine: Machine | None,  # noqa: ARG001  # ROS 1's
    env: Mapping[str, str] | None = None,  # noqa: ARG001  # ROS 1's
) -> list[str]:
    """Return the command line of a node on this machine.

    Raises:
        NodeParamsException: Its package or program is not there.
    """

    def find(package: str, program: str) -> str:
        return str(package_path().find(package).executable(program))

    with raised_as(NodeParamsException, RoszError):
        words = report.command_line(node_plan(node), find)
    return words if node.name else words[:-1]


def dump_params(files: Sequence[str]) -> bool:
    """Print the parameters of launch files as YAML; return whether they could be read."""
    import yaml

    try:
        config = load_config_default(files, None)
    except RLException as error:
        sys.stderr.write(f"{error}\n")
        return False
    values: dict[str, Any] = {name: param.value for name, param in config.params.items()}
    sys.stdout.write(f"{yaml.safe_dump(values)}\n")
    return True


def get_args(roslaunch_files: Sequence[str]) -> dict[str, tuple[str | None, str | None]]:
    """Return the documentation and default of each arg of launch files.

    Raises:
        RLException: A file is refused.
    """
    return {doc.name: (doc.doc, doc.default) for doc in _describe(roslaunch_files)}


def dump_args(roslaunch_files: Sequence[str]) -> None:
    """Print the args of launch files; see `get_args`."""
    sys.stdout.write(f"{report.describe(_describe(roslaunch_files))}\n")


def _describe(roslaunch_files: Sequence[str]) -> tuple[ArgDoc, ...]:
    with raised_as(RLException, RoszError):
        return describe_args(list(roslaunch_files), {}, plan_context())


def resolve_launch_arguments(args: Sequence[str]) -> list[str]:
    """Return a command line with the path of its launch file in place of a package and a name.

    Args:
        args: ``PACKAGE FILE …`` or ``PATH …``.

    Raises:
        RLException: The package or file does not exist.
    """
    if not args:
        return []
    if len(args) > 1 and "/" not in args[0] and args[0] != "-":
        try:
            return [str(package_path().find(args[0]).file(args[1])), *args[2:]]
        except RoszError as error:
            if not Path(args[0]).is_file():
                raise RLException(f"[{args[1]}]: {error}") from error
    if args[0] != "-" and not Path(args[0]).is_file():
        raise RLException(
            f"[{args[0]}] is neither a launch file in package [{args[0]}] nor is [{args[0]}] a"
            " launch file name"
        )
    return [args[0] if args[0] == "-" else str(Path(args[0]).absolute()), *args[1:]]


def check_roslaunch(
    f: str,
    use_test_depends: bool = False,  # noqa: ARG001  # ROS 1's
    ignore_unset_args: bool = False,
) -> str | None:
    """Return the faults of a launch file, or None.

    Args:
        f: Its path.
        use_test_depends: Ignored.
        ignore_unset_args: Whether args without a value are allowed.
    """
    try:
        config = load_config_default([(f, [])], None, ignore_unset_args=ignore_unset_args)
    except RLException as error:
        unset = "it has no default, so give it" in str(error)
        return None if ignore_unset_args and unset else str(error)
    wrong = []
    for node in (*config.nodes, *config.tests):
        try:
            package_path().find(node.package).executable(node.type)
        except RoszError as error:
            wrong.append(str(error))
    return "\n".join(wrong) or None


def check_log_disk_usage() -> None:
    """Do nothing: the size of log files is bounded."""
