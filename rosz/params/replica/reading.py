"""Looking things up in a tree that others change."""

from __future__ import annotations

from typing import Final

from rosz.errors import ParamNotFound
from rosz.params.paths import Path, climb, joined, split
from rosz.params.replica.state import State
from rosz.params.replica.watch import Callback, Watch
from rosz.params.tree import MISSING, Missing, Tree, leaves, lookup
from rosz.params.values import Value, copy

__all__ = ("Reading", "names_beside", "not_found")

_SUGGESTED_FROM: Final = 200
"""Names beside a missing one in which its near miss is looked for."""


def not_found(root: Tree, path: Path) -> ParamNotFound:
    """Return the error for a path that is not set, with the near miss beside it."""
    return ParamNotFound(joined(path), names_beside(root, path))


def names_beside(root: Tree, path: Path) -> list[str]:
    """Return the names in the namespace of a path, or some of them where they are many."""
    beside = lookup(root, path[:-1])
    names = list(beside)[:_SUGGESTED_FROM] if type(beside) is dict else []
    return [joined((*path[:-1], name)) for name in names]


class Reading:
    """The reading half of a copy of the store. Safe for threads, and waits for none.

    Args:
        state: The copy.
    """

    def __init__(self, state: State) -> None:
        self._state = state

    @property
    def root(self) -> Tree:
        """The whole tree; never change it, and read it anew for every look."""
        return self._state.root

    def lookup(self, path: Path) -> Value | Missing:
        """Return what is at a path, which belongs to the tree, or `MISSING`."""
        return lookup(self._state.root, path)

    def peek(self, name: str) -> Value:
        """Return the value of a global name; it belongs to the tree, so do not change it.

        Raises:
            ParamNotFound: It is not set.
            InvalidName: It is no global name.
        """
        path = split(name)
        found = lookup(self._state.root, path)
        if found is MISSING:
            raise not_found(self._state.root, path)
        return found

    def get(self, name: str) -> Value:
        """Return a copy of the value of a global name.

        Raises:
            ParamNotFound: It is not set.
            InvalidName: It is no global name.
        """
        return copy(self.peek(name))

    def has(self, name: str) -> bool:
        """Tell whether a global name is set.

        Raises:
            InvalidName: It is no global name.
        """
        return lookup(self._state.root, split(name)) is not MISSING

    def names(self) -> list[str]:
        """Return the global names of all that is set and no dict, sorted."""
        return sorted(joined(path) for path, _ in leaves(self._state.root) if path)

    def search(self, name: str, node: str) -> str | None:
        """Search for a name from a node's own upwards; return the global name found.

        Raises:
            ParamError: The name is empty or private.
        """
        return climb(name, node, self.has)

    def origin(self, name: str) -> str:
        """Return who set the value of a global name; empty where nobody did."""
        write = self._state.source(split(name))
        return write.origin if write is not None else ""

    def watch(self, name: str, callback: Callback) -> Watch:
        """Have a function called on every change at a global name, above it and below it.

        Args:
            name: Global name; it need not be set.
            callback: Gets each change, in order, on a thread of the replica's own, where it may do
                anything. When it cannot keep up, it gets only the newest change of each name.

        Raises:
            InvalidName: It is no global name.
        """
        return self._state.watch(split(name), callback)
