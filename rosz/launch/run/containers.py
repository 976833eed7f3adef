"""Which nodes of a launch share a process.

``<group container="name">`` says so, and so do ROS 1's lines for nodelets, where they load
a Python script: ``args="manager"``, ``args="load PKG/SCRIPT MANAGER"``, and ``args="standalone
PKG/SCRIPT"`` for a process of its own. Other lines for nodelets run ROS 1's own program.

A node that cannot share a process with the others has one of its own, and a warning says why.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from msgspec.structs import replace

from rosz import names
from rosz.errors import NotFoundError
from rosz.launch.plan import NodePlan
from rosz.launch.run.command import Workplace
from rosz.packages import is_python

_NODELET = "nodelet"
_NO_BOND = "--no-bond"


def group_nodes(
    nodes: Sequence[NodePlan], workplace: Workplace, warn: Callable[[str], None]
) -> tuple[NodePlan, ...]:
    """Return the processes of a launch: its nodes, with those of a container in one."""
    nodes = _read_nodelets(nodes, workplace)
    groups: dict[tuple[str, str], list[NodePlan]] = {}
    processes: list[NodePlan | tuple[str, str]] = []
    for node in nodes:
        key = node.container, node.machine
        members = groups.get(key, [])
        objection = _objection(node, members, workplace) if node.container else "it has none"
        if not objection:
            if not members:
                groups[key] = members
                processes.append(key)
            members.append(node)
            continue
        if node.container:
            warn(
                f"{node.place}: node '{node.full_name}' runs in a process of its own and not in"
                f" container '{node.container}': {objection}"
            )
        processes.append(node)
    return tuple(
        _merge(groups[process]) if isinstance(process, tuple) else replace(process, container="")
        for process in processes
    )


def _read_nodelets(nodes: Sequence[NodePlan], workplace: Workplace) -> list[NodePlan]:
    """Return nodes with Python scripts in place of the nodelets that are such."""
    expanded = [_read_nodelet(node, workplace) for node in nodes]
    compiled = {_manager(node) for node in expanded if _nodelet_words(node)[:1] == ("load",)}
    # A manager of C++ stays one; its Python nodes share another process.
    expanded = [
        replace(node, container=f"{node.container}_python") if node.container in compiled else node
        for node in expanded
    ]
    used = {(node.container, node.machine) for node in expanded}
    return [
        replace(node, container=node.full_name)
        if _nodelet_words(node)[:1] == ("manager",) and (node.full_name, node.machine) in used
        else node
        for node in expanded
    ]


def _nodelet_words(node: NodePlan) -> tuple[str, ...]:
    """Return the arguments of a line for nodelets; none for another node."""
    if (node.package, node.type) != (_NODELET, _NODELET):
        return ()
    return tuple(word for word in node.args if word != _NO_BOND)


def _manager(node: NodePlan) -> str:
    """Return the full name of the manager that loads a nodelet."""
    words = (*_nodelet_words(node), "", "", "")
    return names.resolve(words[2] or "manager", node.full_name)


def _read_nodelet(node: NodePlan, workplace: Workplace) -> NodePlan:
    """Return the node of a line for nodelets, or the line if it is another one."""
    action, what, *rest = (*_nodelet_words(node), "", "")
    package, _, script = what.partition("/")
    if action not in {"load", "standalone"} or not script:
        return node
    words = tuple(word for word in rest if word)
    plain = replace(node, package=package, type=script, args=words)
    if not node.machine and _problem(plain, workplace):
        return node  # a nodelet of C++
    if action == "standalone":
        return plain
    return replace(plain, args=words[1:], container=_manager(node))


def _objection(node: NodePlan, members: Sequence[NodePlan], workplace: Workplace) -> str:
    """Return why a node cannot run in a container with others; "" if it can."""
    if node.command:
        return "an <executable> is no node"
    if node.launch_prefix:
        return "it has a launch-prefix"
    if node.cwd == "node":
        return 'cwd="node" is of a whole process'
    env = {name: value for other in members for name, value in other.env}
    for name, value in node.env:
        if env.get(name, value) != value:
            return f"the environment is of a whole process, where {name} is '{env[name]}' already"
    others = {other.full_name for other in members}
    if any(condition.name in others for wait in node.wait_for for condition in wait.any_of):
        return "it waits for a node of the container"
    is_manager = node.full_name == node.container
    return "" if node.machine or is_manager else _problem(node, workplace)


def _problem(node: NodePlan, workplace: Workplace) -> str:
    """Return why a node is not a Python script; "" if it is one."""
    try:
        program = workplace.find(node.package, node.type)
    except NotFoundError as error:
        return str(error)
    return "" if is_python(Path(program)) else f"'{program}' is not a Python script"


def _merge(members: Sequence[NodePlan]) -> NodePlan:
    first = members[0]
    respawning = [node for node in members if node.respawn]
    limits = [node.respawn_max for node in respawning if node.respawn_max is not None]
    name = first.container
    return NodePlan(
        package="",
        type="",
        name=names.basename(name),
        namespace=names.canonical(names.namespace(name)),
        place=first.place,
        machine=first.machine,
        respawn=bool(respawning),
        respawn_delay=max((node.respawn_delay for node in respawning), default=0.0),
        respawn_max=max(limits) if limits and len(limits) == len(respawning) else None,
        required=any(node.required for node in members),
        output="screen" if any(node.output == "screen" for node in members) else "log",
        env=tuple(dict(pair for node in members for pair in node.env).items()),
        wait_for=tuple(dict.fromkeys(wait for node in members for wait in node.wait_for)),
        spawn_delay=max(node.spawn_delay for node in members),
        by_reference=any(node.by_reference for node in members),
        members=tuple(members),
    )
