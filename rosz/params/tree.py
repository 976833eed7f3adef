"""The tree of parameters, by ROS 1's rules, as dicts that never change once seen.

A root handed out is never written to: a `Draft` copies each dict on its way down the first time it
changes it. So readers need no lock, and a batch becomes visible as one change when its root does.
"""

from __future__ import annotations

import enum
from collections.abc import Iterator
from typing import Final, Literal

from rosz.params.paths import Path
from rosz.params.values import Value

__all__ = (
    "MISSING",
    "Draft",
    "Missing",
    "Tree",
    "leaves",
    "lookup",
    "with_delete",
    "with_put",
)

Tree = dict[str, Value]


class Missing(enum.Enum):
    """What `lookup` returns where nothing is set."""

    MISSING = "missing"

    def __repr__(self) -> str:
        return "MISSING"


MISSING: Final[Literal[Missing.MISSING]] = Missing.MISSING


def lookup(root: Value, path: Path) -> Value | Missing:
    """Return the value at a path, or `MISSING`; it belongs to the tree, so do not change it."""
    node = root
    try:
        for part in path:
            node = node[part]
    except (KeyError, TypeError):  # a leaf on the way cannot be indexed by text
        return MISSING
    return node


def leaves(value: Value, path: Path = ()) -> Iterator[tuple[Path, Value]]:
    """Yield what is set below a value: all that is no dict; an empty dict has nothing."""
    if type(value) is not dict:
        yield path, value
        return
    for key, item in value.items():
        yield from leaves(item, (*path, key))


def with_put(root: Tree, path: Path, value: Value) -> Tree:
    """Return a tree with a value set: what is there goes, and all above becomes dicts."""
    if not path:
        return dict(value)
    changed, parent = _opened(root, path)
    parent[path[-1]] = value
    return changed


def with_delete(root: Tree, path: Path) -> Tree:
    """Return a tree without what is at a path; all above becomes dicts, and stays when empty."""
    changed, parent = _opened(root, path)
    parent.pop(path[-1], None)
    return changed


def _opened(root: Tree, path: Path) -> tuple[Tree, Tree]:
    """Return a copy of a tree that may be changed at a path, and the dict to change there."""
    changed = node = root.copy()
    for part in path[:-1]:
        below = node.get(part)
        node[part] = below = below.copy() if type(below) is dict else {}
        node = below
    return changed, node


class Draft:
    """Many changes of a tree in the making, which copy each dict but once.

    Args:
        root: The tree to start from; it stays as it is.

    Attributes:
        root: The tree as changed so far.
    """

    def __init__(self, root: Tree) -> None:
        self.root = root
        self._own: dict[int, Tree] = {}

    def put(self, path: Path, value: Value) -> None:
        """Set a value: what is there goes, and all above becomes dicts."""
        if path:
            self._parent(path)[path[-1]] = value
        else:
            self.root = value

    def delete(self, path: Path) -> None:
        """Delete what is at a path; all above becomes dicts, and stays when empty."""
        self._parent(path).pop(path[-1], None)

    def _parent(self, path: Path) -> Tree:
        node = self.root = self._writable(self.root)
        for part in path[:-1]:
            below = node.get(part)
            below = self._writable(below) if type(below) is dict else self._new({})
            node[part] = below
            node = below
        return node

    def _writable(self, node: Tree) -> Tree:
        return node if id(node) in self._own else self._new(node.copy())

    def _new(self, node: Tree) -> Tree:
        self._own[id(node)] = node
        return node
