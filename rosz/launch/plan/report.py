"""Answers that need nothing more than a plan: roslaunch's ``--nodes``, ``--args`` and the like.

Each returns the text that roslaunch would print, without the newline at its end where roslaunch
ends with just one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from rosz import names
from rosz.errors import LaunchError
from rosz.launch.plan.model import ArgDoc, NodePlan, Plan

__all__ = (
    "command_line",
    "describe",
    "dump_params",
    "environment",
    "list_files",
    "list_nodes",
    "node_args",
    "node_file",
)


def dump_params(plan: Plan) -> str:
    """Write all parameters as YAML (``--dump-params``), sorted, by full name."""
    import yaml

    return str(yaml.safe_dump({param.name: param.value for param in plan.params}))


def list_nodes(plan: Plan) -> str:
    """List the full names of nodes and tests, in order (``--nodes``); unnamed ones are left out."""
    return "\n".join(node.full_name for node in plan.processes if node.named)


def list_files(plan: Plan) -> str:
    """List the files read, in order (``--files``)."""
    return "\n".join(plan.files)


def node_file(plan: Plan, name: str, *, ns: str = "/") -> str:
    """Name the file that a node is written in (``--find-node``).

    Args:
        plan: The plan.
        name: Name of the node; a relative one is in ``ns``.
        ns: ``ROS_NAMESPACE``.

    Raises:
        NotFoundError: There is no such node.
        LaunchError: A node and a test share the name, or two tests.
    """
    return _one(plan, name, ns).place.file


def node_args(
    plan: Plan,
    name: str,
    find: Callable[[str, str], str],
    environ: Mapping[str, str],
    *,
    ns: str = "/",
) -> str:
    """Write the command that starts a node, with what it changes in the environment (``--args``).

    Args:
        plan: The plan.
        name: Name of the node; a relative one is in ``ns``.
        find: Package and type to the path of the executable.
        environ: The environment that the command would be typed in.
        ns: ``ROS_NAMESPACE``.

    Raises:
        NotFoundError: There is no such node, or ``find`` does not find its executable.
        LaunchError: A node and a test share the name, or two tests.
    """
    node = _one(plan, name, ns)
    changed = {key: value for key, value in environment(node).items() if environ.get(key) != value}
    words = [f'{key}="{value}"' for key, value in changed.items()]
    return " ".join([*words, *command_line(node, find)])


def environment(node: NodePlan) -> dict[str, str]:
    """Return the variables that a launch sets for a node.

    ``ROS_NAMESPACE`` is not among them for a node at the root, whose environment must not have it.
    """
    namespace = {} if node.namespace == "/" or node.command else {"ROS_NAMESPACE": node.namespace}
    return {**namespace, **dict(node.env)}


def command_line(node: NodePlan, find: Callable[[str, str], str]) -> list[str]:
    """Return the arguments that start a node: prefix, executable, its own, remappings, name.

    Args:
        node: The node.
        find: Package and type to the path of the executable.

    Raises:
        NotFoundError: ``find`` does not find it.
    """
    if node.command:
        return [*node.launch_prefix, *node.command, *node.args]
    remaps = [f"{old}:={new}" for old, new in node.remaps]
    program = find(node.package, node.type)
    return [*node.launch_prefix, program, *node.args, *remaps, f"__name:={node.name}"]


def describe(docs: Iterable[ArgDoc]) -> str:
    """Describe what a launch file takes (``--ros-args``): required args, then optional ones."""
    required = sorted((doc.name, doc.doc or "undocumented") for doc in docs if not doc.default)
    optional = sorted(
        (doc.name, doc.doc or "undocumented", doc.default) for doc in docs if doc.default
    )
    lines: list[str] = []
    if required:
        lines += ["Required Arguments:", *(f"  {name}: {doc}" for name, doc in required)]
    if optional:
        lines.append("Optional Arguments:")
        lines += [f'  {name} (default "{default}"): {doc}' for name, doc, default in optional]
    return "\n".join(lines) or "No arguments."


def _one(plan: Plan, name: str, ns: str) -> NodePlan:
    """Return the node or test of a name that a person typed."""
    if names.is_private(name):
        resolved = names.canonical(f"{ns}/roslaunch/{name[1:]}")
    else:
        resolved = names.canonical(name if names.is_global(name) else f"/{ns}/{name}")
    node = plan.node(resolved)
    places = [str(other.place) for other in plan.processes if other.full_name == resolved]
    if len(places) > 1:
        raise LaunchError(f"'{resolved}' is not one but several: {', '.join(places)}")
    return node
