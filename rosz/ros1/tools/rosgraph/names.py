"""rosgraph.names: graph resource names (ROS wiki, Names).

It also has the environment variables of ROS 1, which programs import from `rosgraph.rosenv`.
"""

from __future__ import annotations

import os
import re
import socket
import sys
from collections.abc import Mapping, Sequence

from rosz import names

__all__ = (
    "ANYTYPE",
    "GLOBALNS",
    "MSG_EXT",
    "PRIV_NAME",
    "REMAP",
    "ROS_NAMESPACE",
    "SEP",
    "SRV_EXT",
    "anonymous_name",
    "canonicalize_name",
    "get_ros_namespace",
    "is_global",
    "is_legal_base_name",
    "is_legal_name",
    "is_legal_remap",
    "is_private",
    "load_mappings",
    "make_caller_id",
    "make_global_ns",
    "myargv",
    "namespace",
    "ns_join",
    "resolve_name",
    "script_resolve_name",
)

ROS_MASTER_URI = "ROS_MASTER_URI"
ROS_IP = "ROS_IP"
ROS_IPV6 = "ROS_IPV6"
ROS_HOSTNAME = "ROS_HOSTNAME"
ROS_NAMESPACE = "ROS_NAMESPACE"
DEFAULT_MASTER_PORT = 11311
DEFAULT_MASTER_URI = f"http://localhost:{DEFAULT_MASTER_PORT}/"

MSG_EXT = ".msg"
SRV_EXT = ".srv"
SEP = "/"
GLOBALNS = "/"
PRIV_NAME = "~"
REMAP = ":="
ANYTYPE = "*"

_REMAPPING = re.compile(r"[~/A-Za-z_][\w/]*:=.*")
_BASE = re.compile(r"[A-Za-z]\w*")
_NAME = re.compile(r"[~/A-Za-z][\w/]*")


def find_option(options: str | tuple[str, ...], argv: Sequence[str] | None = None) -> str | None:
    """Return the value of the first of some options, such as ``__ns:=``, or None."""
    words = (word for word in (sys.argv if argv is None else argv) if word.startswith(options))
    first = next(words, None)
    return None if first is None else first.partition(REMAP)[2]


def get_master_uri(
    env: Mapping[str, str] | None = None, argv: Sequence[str] | None = None
) -> str | None:
    """Return the URI of the master: ``__master:=``, ``ROS_MASTER_URI`` or ROS 1's default.

    Programs print it; nothing in rosz uses it.

    Args:
        env: Environment variables; those of the process when not given.
        argv: Command line; that of the process when not given.

    Raises:
        ValueError: ``__master:=`` has no value, or more than one.
    """
    given = find_option("__master:=", argv)
    if given is not None:
        if not given or ":=" in given:
            raise ValueError(f"expected one URI behind '__master:=', got '{given}'")
        return given
    variables = os.environ if env is None else env
    return variables.get(ROS_MASTER_URI, DEFAULT_MASTER_URI)


def get_ros_namespace(
    env: Mapping[str, str] | None = None, argv: Sequence[str] | None = None
) -> str:
    """Return the namespace of ``__ns:=`` or ``ROS_NAMESPACE``, with slashes at both ends.

    The arguments are those of `get_master_uri`.
    """
    given = find_option("__ns:=", argv)
    variables = os.environ if env is None else env
    return make_global_ns(variables.get(ROS_NAMESPACE, GLOBALNS) if given is None else given)


def make_caller_id(name: str) -> str:
    """Return a name in the namespace of the process, with slashes at both ends."""
    return make_global_ns(ns_join(get_ros_namespace(), name))


def make_global_ns(name: str) -> str:
    """Return a name with slashes at both ends.

    Raises:
        ValueError: The name is private.
    """
    if is_private(name):
        raise ValueError(f"cannot turn [{name}] into a global name")
    name = name if is_global(name) else SEP + name
    return name if name.endswith(SEP) else name + SEP


def is_global(name: str) -> bool:
    """Return whether a name starts with a slash."""
    return bool(name) and names.is_global(name)


def is_private(name: str) -> bool:
    """Return whether a name starts with a tilde."""
    return bool(name) and names.is_private(name)


def namespace(name: str) -> str:
    """Return the namespace of a name, with a slash at the end.

    Raises:
        ValueError: The name is None.
        TypeError: The name is not a string.
    """
    if name is None:
        raise ValueError("name")
    if not isinstance(name, str):
        raise TypeError("name")
    return name.removesuffix(SEP).rpartition(SEP)[0] + SEP if SEP in name else SEP


def ns_join(ns: str, name: str) -> str:
    """Join a namespace and a name; a global or private name is returned unchanged."""
    if is_private(name) or is_global(name) or not ns:
        return name
    return ns + name if ns == PRIV_NAME or ns.endswith(SEP) else f"{ns}{SEP}{name}"


def myargv(argv: Sequence[str] | None = None) -> list[str]:
    """Return a command line without remappings, for the option parser of the program.

    Args:
        argv: Command line with the program name; that of the process when not given.
    """
    return [word for word in (sys.argv if argv is None else argv) if REMAP not in word]


def load_mappings(argv: Sequence[str]) -> dict[str, str]:
    """Return the remappings of a command line, including ``__name`` and other special ones."""
    mappings: dict[str, str] = {}
    for word in filter(is_legal_remap, argv):
        left, _, right = (part.strip() for part in word.partition(REMAP))
        if left and right and REMAP not in right and not re.match(r"_[^_]", left):
            mappings[left] = right
    return mappings


def is_legal_name(name: str | None) -> bool:
    """Return whether a text is a legal name: empty, relative, global or private."""
    if name is None:
        return False
    return not name or (_NAME.fullmatch(name) is not None and "//" not in name)


def is_legal_base_name(name: str | None) -> bool:
    """Return whether a text is a legal name without a namespace."""
    return name is not None and _BASE.fullmatch(name) is not None


def is_legal_remap(arg: str | None) -> bool:
    """Return whether an argument is a remapping or sets a private parameter."""
    return arg is not None and _REMAPPING.fullmatch(arg) is not None


def canonicalize_name(name: str) -> str:
    """Remove redundant slashes."""
    return names.canonical(name)


def resolve_name(name: str, namespace_: str, remappings: Mapping[str, str] | None = None) -> str:
    """Resolve a name of a node.

    Args:
        name: The name; an empty one is resolved to the namespace of the node.
        namespace_: Full name of the node.
        remappings: Resolved names to resolved names.
    """
    if not name:
        return namespace(namespace_)
    name = canonicalize_name(name)
    if is_private(name):
        name = canonicalize_name(namespace_ + SEP + name[1:])
    elif not is_global(name):
        name = namespace(namespace_) + name
    return remappings.get(name, name) if remappings else name


def script_resolve_name(script_name: str, name: str) -> str:
    """Resolve a name of a program that is not a node.

    Args:
        script_name: Name of the program, for private names.
        name: The name.
    """
    if not name:
        return get_ros_namespace()
    if is_global(name):
        return name
    if is_private(name):
        return ns_join(make_caller_id(script_name), name[1:])
    return get_ros_namespace() + name


def anonymous_name(id: str) -> str:  # noqa: A002  # ROS 1's name
    """Return a name with the host, process id and a random number appended; no two are equal."""
    return names.anonymous(id, socket.gethostname(), os.getpid(), int.from_bytes(os.urandom(7)))
