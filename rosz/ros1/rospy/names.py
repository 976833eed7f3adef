"""Names as rospy sees them: nothing is refused, everything is tidied (ROS wiki, Names)."""

from __future__ import annotations

import os
from collections.abc import Sequence

from rosz import names, remap
from rosz.ros1.rospy.absent import attribute
from rosz.ros1.rospy.state import UNNAMED, arguments, state

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

ANYTYPE = TOPIC_ANYTYPE = SERVICE_ANYTYPE = "*"
SEP = GLOBALNS = "/"
REMAP = ":="

is_global = names.is_global
is_private = names.is_private


def get_name() -> str:
    """Return the full name of the node; ``/unnamed`` before there is one."""
    if state.node is not None:
        return state.node.name
    return canonicalize_name(f"{get_ros_namespace()}/{UNNAMED}")


get_caller_id = get_name


def get_namespace() -> str:
    """Return the namespace of the node, with a slash at its end."""
    return names.namespace(get_name())


def get_ros_namespace() -> str:
    """Return the namespace that the command line or ``ROS_NAMESPACE`` gives, with a slash."""
    given = arguments().special.get("__ns") or os.environ.get("ROS_NAMESPACE", "")
    return make_global_ns(given or "/")


def get_mappings() -> dict[str, str]:
    """Return the remappings of the command line, as they were written."""
    given = arguments()
    return {**given.remaps, **given.special}


def get_resolved_mappings() -> dict[str, str]:
    """Return the remappings as global names; none before there is a node."""
    return dict(state.node.remaps) if state.node is not None else {}


def initialize_mappings(node_name: str) -> None:
    """Do nothing: remappings are resolved whenever there is a node."""


def load_mappings(argv: Sequence[str]) -> dict[str, str]:
    """Return the remappings, ``__name`` and its like in a command line."""
    given = remap.parse(argv)
    return {**given.remaps, **given.special}


def canonicalize_name(name: str) -> str:
    """Drop slashes that say nothing."""
    return names.canonical(name)


def make_global_ns(name: str) -> str:
    """Return a name as a global namespace, with a slash at its end."""
    if is_private(name):
        raise ValueError(f"cannot turn '{name}' into a global name")
    return canonicalize_name(f"/{name}").rstrip("/") + "/"


def namespace(name: str) -> str:
    """Return the namespace that a name lies in, with a slash at its end."""
    if not name.startswith("/") and "/" in name.rstrip("/"):
        return name.rstrip("/").rpartition("/")[0] + "/"
    return names.namespace(name)


def ns_join(ns: str, name: str) -> str:
    """Put a name into a namespace; a global or private one stays as it is."""
    if is_private(name) or is_global(name) or not ns:
        return name
    return f"{ns}{name}" if ns.endswith("/") else f"{ns}/{name}"


def scoped_name(caller_id: str, name: str) -> str:
    """Return a name relative to the namespace of a node.

    Raises:
        ValueError: The node's name is not global.
    """
    if not is_global(caller_id):
        raise ValueError(f"caller_id must be a global name, got '{caller_id}'")
    if not is_global(name) or not canonicalize_name(name).startswith(namespace(caller_id)):
        return ""
    return canonicalize_name(name).removeprefix(namespace(caller_id))


def resolve_name(name: str | None, caller_id: str | None = None) -> str:
    """Return the global name that a name means, remappings applied.

    Args:
        name: Any name; an empty one means the namespace.
        caller_id: Full name of the node that says it; this one when not given.
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
    """Return what a name, as it is written, is remapped to; itself where it is not.

    Args:
        name: The name.
        caller_id: Full name of the node that says it; this one when not given.
        resolved: Whether the remappings of resolved names count, too.
    """
    node = caller_id or get_name()
    mappings = get_mappings()
    if name in mappings:
        return names.canonical(resolve_name(mappings[name], node))
    return get_resolved_mappings().get(name, name) if resolved else name


def resolve_name_without_node_name(name: str) -> str:
    """Return the global name that a name means before there is a node.

    Raises:
        ValueError: It is private, which means nothing without a node.
    """
    if is_private(name):
        raise ValueError("~name topics cannot be created before init_node() has been called")
    base = get_ros_namespace()
    written = {
        canonicalize_name(ns_join(base, old)): canonicalize_name(ns_join(base, new))
        for old, new in arguments().remaps.items()
        if not is_private(old)
    }
    full = canonicalize_name(ns_join(base, name))
    return written.get(full, full)


__getattr__ = attribute(__name__)
