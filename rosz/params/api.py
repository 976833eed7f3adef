"""Parameters as a node sees them: by global, relative and private names, remapped."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final, TypeVar, overload

from rosz.params.merge import Change, condense
from rosz.params.paths import Path, climb, joined, resolve, split
from rosz.params.replica import ACKNOWLEDGED_BY, Changed, Replica, Watch
from rosz.params.replica.reading import not_found
from rosz.params.tree import MISSING
from rosz.params.values import convert, copy, normalise

__all__ = ("Params",)

T = TypeVar("T")
D = TypeVar("D")

_IMMUTABLE: Final = frozenset({bool, int, float, str, bytes, dt.datetime, dt.date})
_REMEMBERED: Final = 10_000
"""Names whose resolution is kept; a program that makes up more gets them resolved anew."""


class Params:
    """The parameter store of a node; much like a dict of names to values, shared with all others.

    Reading is a look-up in the memory of the process. Writing returns when all other processes
    that hold the store have applied it. Safe for threads, and for any callback.

    Args:
        replica: The process's copy of the store.
        node: Full name of the node.
        remaps: Resolved name to resolved name.
    """

    def __init__(
        self, replica: Replica, node: str, remaps: Mapping[str, str] | None = None
    ) -> None:
        self._replica = replica
        self._node = node
        self._remaps = dict(remaps or {})
        self._origin = f"{node} ({replica.label})"
        self._paths: dict[str, Path] = {}

    def resolve(self, name: str) -> str:
        """Return the global name that a name means here.

        Raises:
            InvalidName: The name holds a character that no text can.
        """
        return resolve(name, self._node, self._remaps)

    @overload
    def get(self, name: str) -> Any: ...
    @overload
    def get(self, name: str, default: D) -> Any | D: ...
    @overload
    def get(self, name: str, *, type: Callable[..., T]) -> T: ...
    @overload
    def get(self, name: str, default: D, *, type: Callable[..., T]) -> T | D: ...
    def get(self, name: str, default: Any = MISSING, *, type: Any = None) -> Any:  # noqa: A002  # reads best
        """Return a parameter's value, a copy that is the caller's own.

        Args:
            name: Global, relative or private name; that of a namespace returns all below it.
            default: What to return when it is not set.
            type: The type that is expected, such as ``float``, which also takes an int.

        Raises:
            ParamNotFound: It is not set, and there is no default; also a ``KeyError``.
            ParamError: Its value has another type; the message says who set it.
        """
        path = self._path(name)
        value = self._replica.lookup(path)
        if value is MISSING:
            if default is not MISSING:
                return default
            raise not_found(self._replica.root, path)
        if type is not None and value.__class__ is not type:
            full = joined(path)
            value = convert(value, type, full, self._replica.origin(full))
        return copy(value)

    def __getitem__(self, name: str) -> Any:
        path = self._paths.get(name) or self._path(name)
        node: Any = self._replica.root
        try:
            for part in path:
                node = node[part]
        except (KeyError, TypeError):
            raise not_found(self._replica.root, path) from None
        return node if type(node) in _IMMUTABLE else copy(node)

    def set(self, name: str, value: object, *, timeout: float = ACKNOWLEDGED_BY) -> None:
        """Set a parameter; a dict replaces all that was below the name.

        Args:
            name: Global, relative or private name.
            value: bool, int, float, str, list, dict, bytes or a timestamp.
            timeout: Seconds to wait for the other processes; those that are late are logged.

        Raises:
            ParamError: The value is none that a parameter may have.
            ClosedError: The node is shut down.
        """
        full = joined(self._path(name))
        self._replica.set(full, value, origin=self._origin, timeout=timeout)

    def __setitem__(self, name: str, value: object) -> None:
        self.set(name, value)

    def update(self, values: Mapping[str, object], *, timeout: float = ACKNOWLEDGED_BY) -> None:
        """Set many parameters as one change: nobody ever sees some of them set and others not.

        Args:
            values: Name to value, each set as `set` does, one after the other.
            timeout: Seconds to wait for the other processes; those that are late are logged.

        Raises:
            ParamError: A value is none that a parameter may have; nothing is set then.
            ClosedError: The node is shut down.
        """
        changes: list[Change] = [
            (self._path(name), normalise(value, self.resolve(name)))
            for name, value in values.items()
        ]
        self._replica.write(condense(changes), origin=self._origin, timeout=timeout)

    def delete(self, name: str, *, timeout: float = ACKNOWLEDGED_BY) -> None:
        """Delete a parameter and all below it; what is above it stays, even empty.

        Raises:
            ParamNotFound: It is not set; also a ``KeyError``.
            ParamError: It is the root.
            ClosedError: The node is shut down.
        """
        full = joined(self._path(name))
        self._replica.delete(full, origin=self._origin, timeout=timeout)

    def __delitem__(self, name: str) -> None:
        self.delete(name)

    def has(self, name: str) -> bool:
        """Tell whether a parameter, or anything below the name, is set."""
        return self._replica.lookup(self._path(name)) is not MISSING

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and self.has(name)

    def search(self, name: str) -> str | None:
        """Look for a parameter in the node's own namespace, then in each one above it.

        Args:
            name: Relative name, whose first part decides; a global one is only looked up.

        Returns:
            The global name found, or ``None``.

        Raises:
            ParamError: The name is empty or private.
        """
        if name and not name.startswith("~"):
            plain = resolve(name, self._node)
            name = self._remaps.get(plain, name)
        return climb(name, self._node, self._replica.has)

    def names(self) -> list[str]:
        """Return the global names of all parameters of all nodes, sorted."""
        return self._replica.names()

    def __iter__(self) -> Iterator[str]:
        return iter(self.names())

    def __len__(self) -> int:
        return len(self.names())

    def watch(self, name: str, callback: Callable[[Changed], None]) -> Watch:
        """Have a function called whenever a parameter, or one below or above it, changes.

        Args:
            name: Global, relative or private name; it need not be set.
            callback: Gets the change, with its full name, the value before and the value now
                (``None`` for not set) and who made it. It runs on one thread for all watches of
                the process, where it may do anything, setting parameters included.

        Returns:
            What ends it when closed.
        """
        return self._replica.watch(joined(self._path(name)), callback)

    def origin(self, name: str) -> str:
        """Return who set a parameter; empty where nobody did."""
        return self._replica.origin(joined(self._path(name)))

    def __repr__(self) -> str:
        return f"<Params of {self._node}>"

    def _path(self, name: str) -> Path:
        path = self._paths.get(name)
        if path is None:
            path = split(self.resolve(name))
            if len(self._paths) >= _REMEMBERED:
                self._paths.clear()
            self._paths[name] = path
        return path
