"""rospy.names: names as rospy resolves them; it tidies names and does not refuse any."""

from __future__ import annotations

import os

from rosz.ros1.exceptions import ROSException
from rosz.ros1.state import UNNAMED, arguments, state
from rosz.ros1.tools.rosgraph.names import (
    ANYTYPE,
    GLOBALNS,
    REMAP,
    SEP,
    canonicalize_name,
    is_global,
    is_private,
    load_mappings,
    make_global_ns,
    namespace,
    ns_join,
)

__all__ = (
    "ANYTYPE",
    "GLOBALNS",
    "REMAP",
    "SEP",
    "SERVICE_ANYTYPE",
    "TOPIC_ANYTYPE",
    "canonicalize_name",
    "get_caller_id",
    "get_mappings",
    "get_name",
    "get_namespace",
    "get_resolved_mappings",
    "get_ros_namespace",
    "initialize_mappings",
    "is_global",
    "is_private",
    "load_mappings",
    "make_global_ns",
    "namespace",
    "ns_join",
    "remap_name",
    "resolve_name",
    "resolve_name_without_node_name",
    "scoped_name",
)

TOPIC_ANYTYPE = SERVICE_ANYTYPE = ANYTYPE


def get_name() -> str:
    """Return the full name of the node; ``/unnamed`` before ``init_node``."""
    if state.node is not None:
        return state.node.name
    return canonicalize_name(f"{get_ros_namespace()}/{UNNAMED}")


get_caller_id = get_name


def get_namespace() -> str:
    """Return the namespace of the node, with a slash at the end."""
    return namespace(get_name())


def get_ros_namespace() -> str:
    """Return the namespace of ``__ns:=`` or ``ROS_NAMESPACE``, with slashes at both ends."""
    given = arguments().special.get("__ns") or os.environ.get("ROS_NAMESPACE", "")
    return make_global_ns(canonicalize_name(given))


def get_mappings() -> dict[str, str]:
    """Return the remappings of the command line, not resolved."""
    given = arguments()
    return {**given.remaps, **given.special}


def get_resolved_mappings() -> dict[str, str]:
    """Return the remappings as full names; none before ``init_node``."""
    return dict(state.node.remaps) if state.node is not None else {}


def initialize_mappings(node_name: str) -> None:
    """Do nothing: ``init_node`` resolves the remappings."""


def scoped_name(caller_id: str, name: str) -> str:
    """Return a name relative to the namespace of a node; empty if it lies elsewhere.

    Raises:
        ROSException: The name of the node is not global.
    """
    if not is_global(caller_id):
        raise ROSException(f"caller_id must be a global name, got '{caller_id}'")
    if not is_global(name) or not canonicalize_name(name).startswith(namespace(caller_id)):
        return ""
    return canonicalize_name(name).removeprefix(namespace(caller_id))


def resolve_name(name: str | None, caller_id: str | None = None) -> str:
    """Resolve and remap a name.

    Args:
        name: The name; an empty one is resolved to the namespace of the node.
        caller_id: Full name of the node that uses the name; this node when not given.
    """
    node = caller_id or get_name()
    if not name:
        return namespace(node)
    name = canonicalize_name(name)
    if is_private(name):
        name = canonicalize_name(ns_join(f"{node}/", name[1:])) if name != "~" else f"{node}/"
    elif not is_global(name):
        name = namespace(node) + name
    return get_resolved_mappings().get(name, name)


def remap_name(name: str, caller_id: str | None = None, resolved: bool = True) -> str:
    """Remap a name as it is written; without a remapping, return it unchanged.

    Args:
        name: The name.
        caller_id: Full name of the node that uses the name; this node when not given.
        resolved: Whether to apply the remappings of full names as well.
    """
    mappings = get_mappings()
    if name in mappings:
        return canonicalize_name(resolve_name(mappings[name], caller_id))
    return get_resolved_mappings().get(name, name) if resolved else name


def resolve_name_without_node_name(name: str) -> str:
    """Resolve and remap a name before ``init_node``.

    Raises:
        ValueError: The name is private, and there is no node.
    """
    if is_private(name):
        raise ValueError("~name topics cannot be created before init_node() has been called")
    base = get_ros_namespace()
    remaps = {
        canonicalize_name(ns_join(base, old)): canonicalize_name(ns_join(base, new))
        for old, new in arguments().remaps.items()
        if not is_private(old)
    }
    full_name = canonicalize_name(ns_join(base, name))
    return remaps.get(full_name, full_name)
