"""Graph resource names by ROS 1's rules (ROS wiki, Names).

A name is *global* (``/a/b``), *relative* (``a/b``), *private* (``~a``) or *base* (``a``).
Relative names are resolved in the namespace of a node, private ones in the name of the node.

All limits of length are here. Zenoh 1.10 panics, with its locks held, when a message with a key of
more than 65 535 bytes is sent; the limit of a key leaves room for what stands beside it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from rosz.errors import InvalidName

__all__ = (
    "LONGEST_KEY",
    "LONGEST_NAME",
    "LONGEST_PATH",
    "anonymous",
    "basename",
    "canonical",
    "check",
    "check_base",
    "check_length",
    "check_resource",
    "is_global",
    "is_of_action",
    "is_private",
    "is_valid",
    "join",
    "namespace",
    "printable",
    "resolve",
    "ros1_type",
    "short_type",
)

LONGEST_NAME = 1024
"""Largest number of bytes of a name or a type."""
LONGEST_PATH = 4096
"""Largest number of bytes of the name of a parameter."""
LONGEST_KEY = 32768
"""Largest number of bytes of a key expression of Zenoh."""

_VALID = re.compile(r"[~/A-Za-z][A-Za-z0-9_/]*", re.ASCII)
_BASE = re.compile(r"[A-Za-z_][A-Za-z0-9_]*", re.ASCII)  # ROS 2 hides names that begin with "_"
_PART = re.compile(r"[A-Za-z0-9_/]", re.ASCII)
_LOGS = ("/rosout", "/rosout_agg")
_CONTROLS = {code: f"\\u{code:04x}" for code in (*range(9), *range(11, 32), *range(127, 160))}


def is_valid(name: str) -> bool:
    """Return whether a text is a legal graph resource name; the empty one is."""
    return not name or (
        len(name) <= LONGEST_NAME and _VALID.fullmatch(name) is not None and "//" not in name
    )


def printable(text: str) -> str:
    """Return a text with its control characters, except tabs and line feeds, escaped as in JSON."""
    return text.translate(_CONTROLS)


def check_length(name: str, limit: int = LONGEST_NAME) -> str:
    """Return the name if it is not too long.

    Raises:
        InvalidName: It has more bytes than the limit.
    """
    size = len(name.encode(errors="surrogatepass"))
    if size > limit:
        raise InvalidName(name, f"it has {size} bytes; the limit is {limit}")
    return name


def check(name: str) -> str:
    """Return the name if it is legal.

    Raises:
        InvalidName: It is not legal; the text names the first wrong character.
    """
    if is_valid(name):
        return name
    check_length(name)
    if "//" in name:
        raise InvalidName(name, "it has an empty part ('//')")
    if not re.match(r"[~/A-Za-z]", name):
        raise InvalidName(name, f"it starts with '{name[0]}'; expected a letter, '/' or '~'")
    place, bad = next((i, c) for i, c in enumerate(name[1:], 2) if not _PART.fullmatch(c))
    raise InvalidName(
        name, f"character '{bad}' at position {place}; expected letters, digits, '_' or '/'"
    )


def check_base(name: str) -> str:
    """Return the name if it is a legal base name: no slash, no tilde, not empty.

    Raises:
        InvalidName: It is not legal.
    """
    if _BASE.fullmatch(check_length(name)):
        return name
    if not name:
        raise InvalidName(name, "it is empty")
    if "/" in name:
        raise InvalidName(name, "it contains '/'; expected a base name without a namespace")
    check(name)
    raise InvalidName(name, "expected a letter first, then letters, digits or '_'")


def check_resource(name: str) -> str:
    """Return a resolved name unless it is the root, which no topic or service can have.

    Raises:
        InvalidName: The name is the root, or too long.
    """
    if name == "/":
        raise InvalidName(name, "it is the root namespace; expected the name of something in it")
    return check_length(name)


def is_global(name: str) -> bool:
    """Return whether a name starts at the root."""
    return name.startswith("/")


def is_private(name: str) -> bool:
    """Return whether a name is private to its node (``~name``)."""
    return name.startswith("~")


def canonical(name: str) -> str:
    """Return a name without repeated and trailing slashes; the root stays ``/``."""
    if not name or name == "/":
        return name
    parts = [part for part in name.split("/") if part]
    return ("/" if name.startswith("/") else "") + "/".join(parts)


def namespace(name: str) -> str:
    """Return the namespace that a global name lies in, with its trailing slash.

    ``/a/b`` gives ``/a/``, ``/a`` and ``/`` give ``/``.
    """
    if not name.startswith("/"):
        return namespace("/" + name) if name else "/"
    return name.rstrip("/").rpartition("/")[0] + "/"


def basename(name: str) -> str:
    """Return the last part of a name."""
    return name.rstrip("/").rpartition("/")[2]


def join(ns: str, name: str) -> str:
    """Return a name in a namespace; global and private names stay as they are."""
    if is_global(name) or is_private(name):
        return name
    if not ns:
        return name
    return canonical(f"{ns}/{name}")


def resolve(name: str, node: str, remaps: Mapping[str, str] | None = None) -> str:
    """Return the global name that a name has for a node, after the node's remappings.

    Args:
        name: Any legal name; the empty one stands for the node's namespace.
        node: Full name of the node.
        remaps: Remappings from resolved name to resolved name.

    Raises:
        InvalidName: ``name`` is not legal, or too long once it is resolved.
    """
    check(name)
    if not name:
        return namespace(node)
    if is_global(name):
        resolved = canonical(name)
    elif is_private(name):
        resolved = canonical(f"{node}/{name[1:]}")
    else:
        resolved = canonical(namespace(node) + name)
    check_length(resolved)
    return remaps.get(resolved, resolved) if remaps else resolved


def short_type(name: str) -> str:
    """Return a type name without its middle part, as ROS 1 spells it.

    ``std_msgs/msg/String`` gives ``std_msgs/String``, ``std_srvs/srv/SetBool_Request`` gives
    ``std_srvs/SetBoolRequest``. The types of ROS 2's actions, which ROS 1 does not have, keep their
    names.
    """
    package, _, rest = name.partition("/")
    kind, _, base = rest.rpartition("/")
    if kind == "action":
        return name
    if kind == "srv":
        base = re.sub(r"_(Request|Response)$", r"\1", base)
    return f"{package}/{base}"


def ros1_type(topic: str, type_name: str) -> str:
    """Return the name in ROS 1 of a topic's type; ``/rosout`` has another type there."""
    name = short_type(type_name)
    is_log = topic in _LOGS and name == "rcl_interfaces/Log"
    return "rosgraph_msgs/Log" if is_log else name


def is_of_action(name: str) -> bool:
    """Return whether a topic or service is a part of an action of ROS 2, as listings hide it."""
    return "/_action/" in name


def anonymous(base: str, host: str, pid: int, moment: int) -> str:
    """Return a base name that is unique to a process and a time, in ROS 1's form."""
    suffix = re.sub(r"[^A-Za-z0-9_]", "_", host)
    return f"{base}_{suffix}_{pid}_{moment}"
