"""The tree of parameters, by ROS 1's rules, as dicts that do not change once they are visible.

A root that readers see is never changed: a `Draft` copies each dict on the path before it changes
that for the first time. So readers need no lock, and all changes of a batch become visible at once.
"""

from __future__ import annotations

import enum
from collections.abc import Iterable, Iterator
from typing import Final, Literal

import msgspec

from rosz.params.paths import Path, joined
from rosz.params.values import Value
from rosz.params.writes import DELETED, Change, Deleted, check_write

Tree = dict[str, Value]


class Missing(enum.Enum):
    """The type of `MISSING`."""

    MISSING = "missing"


MISSING: Final[Literal[Missing.MISSING]] = Missing.MISSING
"""The value that `lookup` returns where nothing is set."""


def lookup(root: Value, path: Path) -> Value | Missing:
    """Return the value at a path, or `MISSING`.

    The value belongs to the tree and must not be changed.
    """
    node = root
    try:
        for part in path:
            node = node[part]
    except (KeyError, TypeError):  # a value on the path is not a dict
        return MISSING
    return node


def leaves(value: Value, path: Path = ()) -> Iterator[tuple[Path, Value]]:
    """Return the path and value of everything below a value that is not a dict."""
    return (end for end in ends(value, path) if type(end[1]) is not dict)


def ends(value: Value | Deleted, path: Path = ()) -> Iterator[tuple[Path, Value | Deleted]]:
    """Yield the path and value of everything below a value that is not a dict with items."""
    if type(value) is not dict or not value:
        yield path, value
        return
    for key, item in value.items():
        yield from ends(item, (*path, key))


class Draft:
    """A tree that is being changed many times; each dict is copied only once.

    Args:
        root: Tree to start from; it is not changed.

    Attributes:
        root: Tree with the changes made so far.
    """

    def __init__(self, root: Tree) -> None:
        self.root: Value = root
        self._copies: dict[int, Tree] = {}

    def change(self, path: Path, value: Value | Deleted) -> None:
        """Set a value or delete a path; everything above becomes a dict, which stays if empty."""
        if value is DELETED:
            self._parent(path).pop(path[-1], None)
        elif path:
            self._parent(path)[path[-1]] = value
        else:
            self.root = value

    def _parent(self, path: Path) -> Tree:
        node = self.root = self._writable(self.root)
        for part in path[:-1]:
            below = node.get(part)
            below = self._writable(below) if type(below) is dict else self._new({})
            node[part] = below
            node = below
        return node

    def _writable(self, node: Tree) -> Tree:
        return node if id(node) in self._copies else self._new(node.copy())

    def _new(self, node: Tree) -> Tree:
        self._copies[id(node)] = node
        return node


class Difference(msgspec.Struct, frozen=True):
    """One parameter that a batch would change.

    Attributes:
        name: Global name.
        old: Value now; ``None`` if it is not set.
        new: Value after the batch; ``None`` if it would be deleted.
    """

    name: str
    old: Value | None
    new: Value | None


def preview(root: Tree, changes: Iterable[Change]) -> list[Difference]:
    """Return what a batch would change, sorted by name.

    Args:
        root: Tree before the batch; it is not changed.
        changes: Batch, as `condense` returns it.

    Raises:
        ParamError: The tree cannot hold a change.
    """
    draft = Draft(root)
    for path, value in changes:
        check_write(path, value)
        draft.change(path, value)
    old = {joined(path): value for path, value in leaves(root) if path}
    new = {joined(path): value for path, value in leaves(draft.root) if path}
    return [
        Difference(name, old.get(name), new.get(name))
        for name in sorted(old.keys() | new.keys())
        if repr(old.get(name)) != repr(new.get(name))
    ]
