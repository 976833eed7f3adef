"""roslaunch.node_args, param_dump and arg_dump: what roslaunch prints of launch files."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from rosz.errors import RoszError
from rosz.launch.plan import describe_args, report
from rosz.ros1.importer import package_path
from rosz.ros1.roslaunch.config import ROSLaunchConfig, load_config_default, node_plan
from rosz.ros1.roslaunch.core import Machine, Node, RLException
from rosz.ros1.roslaunch.loader import plan_context

__all__ = (
    "NodeParamsException",
    "create_local_process_args",
    "dump_args",
    "dump_params",
    "get_args",
    "get_node_args",
    "get_node_list",
    "print_node_args",
    "print_node_filename",
    "print_node_list",
)


class NodeParamsException(Exception):
    """The node does not exist, or it cannot be started."""


def get_node_list(config: ROSLaunchConfig) -> list[str]:
    """Return the full names of the nodes and tests of a config."""
    named = (node for node in (*config.nodes, *config.tests) if node.name)
    return sorted(f"{node.namespace}{node.name}" for node in named)


def print_node_list(roslaunch_files: Sequence[str]) -> None:
    """Print the full names of the nodes of launch files."""
    for name in get_node_list(_load(roslaunch_files)):
        sys.stdout.write(f"{name}\n")


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


def print_node_args(node_name: str, roslaunch_files: Sequence[str]) -> None:
    """Print the command line of a node."""
    sys.stdout.write(" ".join(get_node_args(node_name, roslaunch_files)) + "\n")


def print_node_filename(node_name: str, roslaunch_files: Sequence[str]) -> None:
    """Print the path of the launch file that has a node."""
    sys.stdout.write(f"{_find(node_name, roslaunch_files).filename}\n")


def _load(roslaunch_files: Sequence[str]) -> ROSLaunchConfig:
    try:
        return load_config_default(roslaunch_files, None)
    except RLException as error:
        raise NodeParamsException(str(error)) from error


def _find(node_name: str, roslaunch_files: Sequence[str]) -> Node:
    config = _load(roslaunch_files)
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

    try:
        words = report.command_line(node_plan(node), find)
    except RoszError as error:
        raise NodeParamsException(str(error)) from error
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
    try:
        docs = describe_args(list(roslaunch_files), {}, plan_context())
    except RoszError as error:
        raise RLException(str(error)) from error
    return {doc.name: (doc.doc, doc.default) for doc in docs}


def dump_args(roslaunch_files: Sequence[str]) -> None:
    """Print the args of launch files.

    Raises:
        RLException: A file is refused.
    """
    try:
        docs = describe_args(list(roslaunch_files), {}, plan_context())
    except RoszError as error:
        raise RLException(str(error)) from error
    sys.stdout.write(f"{report.describe(docs)}\n")
