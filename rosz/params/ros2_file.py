"""ROS 2's parameter files: which node each of their values belongs to.

In such a file, names of nodes lead to ``ros__parameters`` and the values below it; ``*`` stands for
one part of a name and ``**`` for any number of them (design.ros2.org, "ROS Command Line
Arguments"). A parameter of a node is a parameter below the node's name here.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any, Final

from rosz.errors import ParamError

_KEY: Final = "ros__parameters"


def assign(value: Any, namespace: str) -> list[tuple[str, Any]]:
    """Return the values of a parameter file with the namespace that each belongs to.

    A file of ROS 1 belongs to the namespace whole. Of a file of ROS 2, the root takes the values
    of nodes that the file names; any other namespace is the name of a node, and takes the values
    of that node, wildcards first.

    Args:
        value: Content of a document.
        namespace: Global namespace.

    Raises:
        ParamError: A file of ROS 2 has a value outside of a node, a wildcard that the root would
            have to hold, or nothing for the node.
    """
    if not _has_key(value):
        return [(namespace, value)]
    parts = [(f"/{name.strip('/')}", values) for name, values in sections(value)]
    node = f"/{namespace.strip('/')}"
    if node != "/":
        matching = [(name, values) for name, values in parts if _pattern(name).fullmatch(node)]
        if not matching:
            names = ", ".join(f"'{name}'" for name, _ in parts)
            raise ParamError(
                f"this parameter file of ROS 2 has nothing for the node '{node}', only for {names}"
            )
        matching.sort(key=lambda section: "*" not in section[0])
        return [(node, nest(values)) for _, values in matching]
    for name, _ in parts:
        if "*" in name:
            raise ParamError(
                f"'{name}' in this parameter file of ROS 2 means any node that reads it; load it "
                "into a node: give the node's name as namespace, or write <rosparam> inside <node>"
            )
    return [(name, nest(values)) for name, values in parts]


def sections(tree: Any, name: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the names of a ROS 2 parameter file, as written, each with its values by name.

    Args:
        tree: Content of the file, or of a namespace in it.
        name: The namespace.

    Raises:
        ParamError: A value stands outside of ``ros__parameters``.
    """
    if not isinstance(tree, dict):
        raise ParamError(f"'{name}' has no '{_KEY}'; all values of a ROS 2 file stand below one")
    for key, inner in tree.items():
        if key != _KEY:
            yield from sections(inner, f"{name.rstrip('/')}/{key}" if name else str(key))
        elif isinstance(inner, dict | None) and name:
            yield name, dict(_flatten(inner or {}))
        else:
            what = f"of '{name}' is not a dictionary" if name else "stands below no node"
            raise ParamError(f"'{_KEY}' {what}")


def _has_key(tree: Any) -> bool:
    return isinstance(tree, dict) and (_KEY in tree or any(map(_has_key, tree.values())))


def _pattern(name: str) -> re.Pattern[str]:
    """Return the pattern of the nodes that a name with wildcards stands for."""
    escaped = re.escape(name).replace(r"/\*\*", "(?:/[^/]+)*")
    return re.compile(escaped.replace(r"/\*", "/[^/]+"))


def _flatten(tree: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in tree.items():
        if isinstance(value, dict):
            yield from _flatten(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def nest(values: dict[str, Any]) -> dict[str, Any]:
    """Return values by name (``gains.p``) as nested dictionaries."""
    tree: dict[str, Any] = {}
    for name, value in values.items():
        *above, last = name.split(".")
        inner = tree
        for part in above:
            below = inner.get(part)
            if not isinstance(below, dict):
                below = inner[part] = {}
            inner = below
        inner[last] = value
    return tree
