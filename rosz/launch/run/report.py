"""The texts that roslaunch prints about a plan, such as for ``--nodes`` or ``--dump-params``.

Each function returns the text of roslaunch without the newline at its end.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from rosz import names
from rosz.errors import LaunchError
from rosz.launch.plan import ArgDoc, NodePlan, Plan


def dump_params(plan: Plan) -> str:
    """Return all parameters as YAML, sorted by full name (``--dump-params``)."""
    import yaml

    return str(yaml.safe_dump({param.name: param.value for param in plan.params}))


def list_nodes(plan: Plan) -> str:
    """Return the full names of the named nodes and tests, in order (``--nodes``)."""
    return "\n".join(node.full_name for node in plan.processes if node.named)


def list_files(plan: Plan) -> str:
    """Return the paths of the files read, in order (``--files``)."""
    return "\n".join(plan.files)


def node_file(plan: Plan, name: str, *, ns: str = "/") -> str:
    """Return the path of the file that declares a node (``--find-node``).

    Args:
        plan: The plan.
        name: Name of the node; a relative one is in ``ns``.
        ns: Value of ``ROS_NAMESPACE``.

    Raises:
        NotFoundError: If there is no such node.
        LaunchError: If a node and a test, or two tests, have the name.
    """
    return _find_node(plan, name, ns).place.file


def node_args(
    plan: Plan,
    name: str,
    find: Callable[[str, str], str],
    environ: Mapping[str, str],
    *,
    ns: str = "/",
) -> str:
    """Return the command that starts a node, with the variables that it sets (``--args``).

    Args:
        plan: The plan.
        name: Name of the node; a relative one is in ``ns``.
        find: Function from package and type to the path of the executable.
        environ: Environment in which the command would be typed.
        ns: Value of ``ROS_NAMESPACE``.

    Raises:
        NotFoundError: If there is no such node, or ``find`` does not find its executable.
        LaunchError: If a node and a test, or two tests, have the name.
    """
    node = _find_node(plan, name, ns)
    changed = {key: value for key, value in environment(node).items() if environ.get(key) != value}
    words = [f'{key}="{value}"' for key, value in changed.items()]
    return " ".join([*words, *command_line(node, find)])


def environment(node: NodePlan) -> dict[str, str]:
    """Return the variables that a launch sets for a node.

    A node at the root gets no ``ROS_NAMESPACE``.
    """
    namespace = {} if node.namespace == "/" or node.command else {"ROS_NAMESPACE": node.namespace}
    return {**namespace, **dict(node.env)}


def command_line(node: NodePlan, find: Callable[[str, str], str]) -> list[str]:
    """Return the command line of a node: prefix, executable, arguments, remappings, name.

    Args:
        node: The node.
        find: Function from package and type to the path of the executable.

    Raises:
        NotFoundError: If ``find`` does not find the executable.
    """
    if node.command and not node.type:
        return [*node.launch_prefix, *node.command, *node.args]
    remaps = [f"{old}:={new}" for old, new in node.remaps]
    words = [*node.launch_prefix, *(node.command or [find(node.package, node.type)]), *node.args]
    if not node.ros2:
        return [*words, *remaps, f"__name:={node.name}"]
    own = [f"__name:={node.name}"] * node.named
    own += [f"__ns:={node.namespace}"] * (node.namespace != "/")
    return [*words, "--ros-args", *(word for rule in own + remaps for word in ("-r", rule))]


def describe(docs: Iterable[ArgDoc]) -> str:
    """Return the list of required and optional args of a launch file (``--ros-args``)."""
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


def _find_node(plan: Plan, name: str, ns: str) -> NodePlan:
    if names.is_private(name):
        resolved = names.canonical(f"{ns}/roslaunch/{name[1:]}")
    else:
        resolved = names.canonical(name if names.is_global(name) else f"/{ns}/{name}")
    node = plan.node(resolved)
    places = [str(other.place) for other in plan.processes if other.full_name == resolved]
    if len(places) > 1:
        raise LaunchError(f"there are several nodes '{resolved}': {', '.join(places)}")
    return node
