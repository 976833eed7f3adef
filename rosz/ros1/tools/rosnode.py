"""rosnode: lists, describes, pings and ends nodes (ROS wiki, rosnode)."""

from __future__ import annotations

import sys
import threading
from collections.abc import Sequence

from rosz import introspect
from rosz.errors import NotFoundError, RoszError
from rosz.ros1.exceptions import raised_as
from rosz.ros1.state import ready_context, survey, token_uri
from rosz.ros1.tool import Tool
from rosz.ros1.tools.rosgraph.masterapi import Master, MasterException
from rosz.ros1.tools.rosgraph.names import script_resolve_name
from rosz.wire import Token

NAME = "rosnode"
ID = "/rosnode"
_KILLED = "rosnode kill"


class ROSNodeException(Exception):
    """A node does not exist."""


class ROSNodeIOException(ROSNodeException):
    """The network did not answer."""


def get_node_names(namespace: str | None = None) -> list[str]:
    """Return the full names of nodes, sorted.

    Args:
        namespace: Namespace of the nodes to list.
    """
    names = dict.fromkeys(survey().view.nodes())
    return [name for name in names if introspect.in_namespace(name, namespace or "/")]


def get_api_uri(master: Master, caller_id: str, skip_cache: bool = False) -> str | None:  # noqa: ARG001
    """Return the URI of a node, or None if there is no such node.

    Args:
        master: The master.
        caller_id: Full name of the node.
        skip_cache: Ignored; there is no cache.
    """
    try:
        return master.lookupNode(caller_id)
    except MasterException:
        return None


def get_machines_by_nodes() -> list[str]:
    """Return the machines on which nodes run."""
    return introspect.machines(introspect.list_nodes(survey()))


def get_nodes_by_machine(machine: str) -> list[str]:
    """Return the names of the nodes on a machine, sorted.

    Raises:
        ROSNodeException: No node runs there.
    """
    with raised_as(ROSNodeException, NotFoundError):
        return introspect.nodes_on_machine(introspect.list_nodes(survey()), machine)


def kill_nodes(node_names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Shut nodes down, and wait until they are gone.

    Args:
        node_names: Full names of the nodes.

    Returns:
        The names of the nodes that are gone, and of those that are not.
    """
    alive = survey()
    present = [name for name in node_names if alive.nodes_named(name)]
    stayed = {
        name for name, _ in introspect.kill_nodes(ready_context().session, alive, present, _KILLED)
    }
    gone = [name for name in present if name not in stayed]
    return gone, [name for name in node_names if name not in gone]


def _member(alive: introspect.Survey, name: str) -> Token | None:
    members = alive.nodes_named(name)
    return members[-1] if members else None


def rosnode_ping(
    node_name: str,
    max_count: int | None = None,
    verbose: bool = False,
    skip_cache: bool = False,  # noqa: ARG001  # ROS 1's
) -> bool:
    """Ping a node once per second.

    Args:
        node_name: Name of the node.
        max_count: Number of pings; no limit when not given.
        verbose: Whether to write the results to stdout.
        skip_cache: Ignored; there is no cache.

    Returns:
        Whether the node replied to every ping.
    """
    name = script_resolve_name(NAME, node_name)
    pause = threading.Event()
    sent = 0
    while max_count is None or sent < max_count:
        if sent:
            pause.wait(1.0)
        alive = survey()
        member = _member(alive, name)
        if member is None:
            if verbose:
                sys.stderr.write(f"cannot ping [{name}]: unknown node\n")
            return False
        try:
            passed = introspect.ping(ready_context().session, member) * 1e3
        except RoszError as error:
            if verbose:
                sys.stderr.write(f"connection to [{name}] failed: {error}\n")
            return False
        sent += 1
        if verbose:
            address = token_uri(alive, member)
            sys.stdout.write(f"reply from {address}\ttime={passed:f}ms\n")
    return True


def rosnode_ping_all(
    verbose: bool = False,
    skip_cache: bool = False,  # noqa: ARG001  # ROS 1's
) -> tuple[list[str], list[str]]:
    """Ping all nodes once; see `rosnode_ping`.

    Returns:
        The names of the nodes that replied, and of those that did not.
    """
    replied: list[str] = []
    silent: list[str] = []
    for name in get_node_names():
        (replied if rosnode_ping(name, 1, verbose) else silent).append(name)
    return replied, silent


def rosnode_cleanup() -> None:
    """Do nothing: dead nodes are never listed."""


def rosnode_listnodes(
    namespace: str | None = None, list_uri: bool = False, list_all: bool = False
) -> None:
    """Write the names of nodes to stdout.

    Args:
        namespace: Namespace of the nodes to list.
        list_uri: Whether to write the URIs instead.
        list_all: Whether to write both.
    """
    master = Master(ID)
    for name in get_node_names(namespace):
        address = get_api_uri(master, name) if list_uri or list_all else ""
        text = f"{address} \t{name}" if list_all else address or name
        sys.stdout.write(f"{text}\n")


def get_node_info_description(node_name: str) -> str:
    """Return the text of ``rosnode info`` without the connections of the node."""
    alive = survey()
    member = _member(alive, node_name)
    if member is None:
        return f"Node [{node_name}]\nPublications: None\n\nSubscriptions: None\n\nServices: None\n"
    return introspect.format_node(alive, member).partition("\n")[2]


def get_node_connection_info_description(node_api: str, master: Master) -> str:  # noqa: ARG001
    """Return the process id of a node and its connections to other nodes.

    Args:
        node_api: URI of the node, from `get_api_uri`.
        master: Ignored.

    Raises:
        ROSNodeIOException: No node has that URI.
    """
    alive = survey()
    for token in alive.view.tokens:
        if token_uri(alive, token) == node_api:
            process = alive.process(token)
            pid = f"Pid: {process.pid}\n" if process is not None else ""
            return pid + introspect.format_connections(alive, token)
    raise ROSNodeIOException(f"Communication with node[{node_api}] failed!")


def rosnode_info(node_name: str, quiet: bool = False) -> None:
    """Write the text of ``rosnode info`` to stdout.

    Args:
        node_name: Name of the node.
        quiet: Whether to omit the connections.
    """
    name = script_resolve_name(NAME, node_name)
    sys.stdout.write(f"{'-' * 80}\n{get_node_info_description(name)}\n")
    master = Master(ID)
    address = get_api_uri(master, name)
    if address is None:
        sys.stderr.write(f"cannot contact [{name}]: unknown node\n")
    elif not quiet:
        sys.stdout.write(f"\ncontacting node {address} ...\n")
        sys.stdout.write(get_node_connection_info_description(address, master) + "\n")


_tool = Tool(NAME)
rosnodemain = _tool.main
_fullusage = _tool.print_usage
globals().update(_tool.parts("cleanup info kill list machine ping"))
