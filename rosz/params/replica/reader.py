"""Reading a copy of the store, by names or paths."""

from __future__ import annotations

from typing import Final

from rosz.errors import ParamNotFound
from rosz.params.paths import Path, climb, joined, to_path
from rosz.params.replica.runner import CoreRunner
from rosz.params.replica.watch import Callback, Watch
from rosz.params.tree import MISSING, Missing, Tree, leaves, lookup
from rosz.params.values import Value, copy

_MAX_SUGGESTIONS: Final = 200
"""Names beside a missing one that are compared with it."""


def not_found(root: Tree, path: Path) -> ParamNotFound:
    """Return the error for a path that is not set, with a similar name if there is one."""
    return ParamNotFound(joined(path), names_beside(root, path))


def names_beside(root: Tree, path: Path) -> list[str]:
    """Return the names in the namespace of a path, or some of them if there are many."""
    beside = lookup(root, path[:-1])
    names = list(beside)[:_MAX_SUGGESTIONS] if type(beside) is dict else []
    return [joined((*path[:-1], name)) for name in names]


class TreeReader:
    """Reading access to a copy of the store. Safe for threads.

    Names are global names or their paths.

    Args:
        runner: The copy.
    """

    def __init__(self, runner: CoreRunner) -> None:
        self._runner = runner

    @property
    def root(self) -> Tree:
        """The tree now; it must not be changed, and is replaced when a parameter changes."""
        return self._runner.root

    def lookup(self, path: Path) -> Value | Missing:
        """Return the value at a path, or `MISSING`; it must not be changed."""
        return lookup(self._runner.root, path)

    def peek(self, name: str | Path) -> Value:
        """Return the value of a name; it must not be changed.

        Raises:
            ParamNotFound: The parameter is not set.
            InvalidName: The name is not a global name.
        """
        root, path = self._runner.root, to_path(name)
        value = lookup(root, path)
        if value is MISSING:
            raise not_found(root, path)
        return value

    def get(self, name: str | Path) -> Value:
        """Return a copy of the value of a name; the errors are those of `peek`."""
        return copy(self.peek(name))

    def has(self, name: str | Path) -> bool:
        """Tell whether a name is set.

        Raises:
            InvalidName: The name is not a global name.
        """
        return lookup(self._runner.root, to_path(name)) is not MISSING

    def names(self) -> list[str]:
        """Return the sorted global names of all parameters that are not dicts."""
        return sorted(joined(path) for path, _ in leaves(self._runner.root) if path)

    def search(self, name: str, node: str) -> str | None:
        """Search for a name from a node's own name upwards; return the global name found.

        Raises:
            ParamError: The name is empty or private.
        """
        return climb(name, node, self.has)

    def origin(self, name: str | Path) -> str:
        """Return the writer of a value, as shown to users; empty if nobody wrote it."""
        with self._runner as history:
            write = history.source(to_path(name))
        return write.origin if write is not None else ""

    def watch(self, name: str | Path, callback: Callback) -> Watch:
        """Call a function on every change at a name, above it and below it.

        Args:
            name: Name to watch; it need not be set.
            callback: Function called with each change, in order, on a thread of the store, where it
                may do anything. If it is too slow, it gets only the newest change of each name.

        Raises:
            InvalidName: The name is not a global name.
        """
        return self._runner.watch(to_path(name), callback)
