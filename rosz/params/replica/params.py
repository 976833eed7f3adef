"""Parameters as a node sees them: by global, relative and private names, with its remappings."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final, Protocol, TypeVar, overload

from rosz.params.paths import Path, climb, joined, resolve, split
from rosz.params.replica.reader import not_found
from rosz.params.replica.replica import ACK_TIMEOUT, Replica
from rosz.params.replica.watch import Changed, Watch
from rosz.params.tree import MISSING, Missing
from rosz.params.values import Value, convert, copy, normalise
from rosz.params.writes import DELETED, Change, condense

T = TypeVar("T")
D = TypeVar("D")

_IMMUTABLE: Final = frozenset({bool, int, float, str, bytes, dt.datetime, dt.date})
_MAX_CACHED: Final = 10_000
"""Names whose paths are cached; when there are more, the cache is cleared."""


class RemoteNode(Protocol):
    """A node that keeps its parameters itself."""

    def get(self, path: Path) -> Value | Missing:
        """Return the value at a path; `MISSING` if there is none."""

    def write(self, changes: list[Change]) -> None:
        """Make changes; a dict keeps what is beside it."""


class RemoteNodes(Protocol):
    """The nodes that keep their parameters themselves, as those of ROS 2 do."""

    def listen(self, changed: Callable[[], None]) -> None:
        """Call a function whenever such a node appears or disappears."""

    def owner(self, path: Path) -> RemoteNode | None:
        """Return the node that a path belongs to."""


class Params:
    """The parameter store as seen by a node, much like a dict that is shared with all other nodes.

    Reading is a look-up in the memory of the process. Writing returns when all other processes that
    hold the store have applied the write. Safe for threads, and for use in any callback.

    A name below that of a node of ROS 2 is read and written by calling that node. Such calls raise
    `WaitTimeout` after 5 s; `names`, `search`, `watch` and namespaces above do not reach it.

    Args:
        replica: The process's copy of the store.
        node: Full name of the node.
        remaps: New name of each remapped name, both resolved.
    """

    def __init__(
        self, replica: Replica, node: str, remaps: Mapping[str, str] | None = None
    ) -> None:
        self._replica = replica
        self._node = node
        self._remaps = dict(remaps or {})
        self._origin = f"{node} ({replica.label})"
        self._paths: dict[str, Path] = {}
        self._remote: RemoteNodes | None = None

    def reach(self, remote: RemoteNodes) -> None:
        """Read and write the parameters of such nodes by calls to them from now on."""
        self._remote = remote
        remote.listen(self._paths.clear)

    def resolve(self, name: str) -> str:
        """Return the global name that a name means for this node.

        Raises:
            InvalidName: The name holds half of a surrogate pair.
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
        """Return a copy of the value of a parameter.

        Args:
            name: Global, relative or private name; the name of a namespace returns all below it.
            default: Value to return if the parameter is not set.
            type: Type that is expected, such as ``float``, which also accepts an int.

        Raises:
            ParamNotFound: The parameter is not set, and there is no default; also a ``KeyError``.
            ParamError: The value has another type; the message names its writer.
        """
        path, owner = self._place(name)
        value = MISSING if owner is None else owner.get(path)
        if value is MISSING:
            value = self._replica.lookup(path)
        if value is MISSING:
            if default is not MISSING:
                return default
            raise not_found(self._replica.root, path)
        if type is not None and value.__class__ is not type:
            value = convert(value, type, joined(path), self._replica.origin(path))
        return copy(value)

    def __getitem__(self, name: str) -> Any:
        path = self._paths.get(name)
        if path is None:
            path, owner = self._place(name)
            if owner is not None:
                return self.get(name)
        node: Any = self._replica.root
        try:
            for part in path:
                node = node[part]
        except (KeyError, TypeError):
            raise not_found(self._replica.root, path) from None
        return node if type(node) in _IMMUTABLE else copy(node)

    def set(self, name: str, value: object, *, timeout: float = ACK_TIMEOUT) -> None:
        """Set a parameter; a dict replaces everything below the name.

        Args:
            name: Global, relative or private name.
            value: bool, int, float, str, list, dict, bytes or a timestamp.
            timeout: Time limit in seconds of the wait for the other processes; those that are late
                are logged.

        Raises:
            ParamError: A parameter cannot hold the value; nothing is set then.
            PartlyWritten: It is set, but a replica refuses it or cannot store it.
            ClosedError: The node is shut down.
        """
        path, owner = self._place(name)
        if owner is None:
            self._replica.set(path, value, origin=self._origin, timeout=timeout)
        else:
            owner.write([(path, normalise(value, joined(path)))])

    def __setitem__(self, name: str, value: object) -> None:
        self.set(name, value)

    def update(self, values: Mapping[str, object], *, timeout: float = ACK_TIMEOUT) -> None:
        """Set many parameters as one change: no reader sees only some of them set.

        Args:
            values: Values by name; they are set as `set` does, one after the other.
            timeout: Time limit in seconds of the wait for the other processes; those that are late
                are logged.

        Raises:
            ParamError: A parameter cannot hold one of the values; nothing is set then.
            PartlyWritten: They are set, but a replica refuses them or cannot store them.
            ClosedError: The node is shut down.
        """
        changes: dict[RemoteNode | None, list[Change]] = {None: []}
        for name, value in values.items():
            path, owner = self._place(name)
            changes.setdefault(owner, []).append((path, normalise(value, joined(path))))
        stored = condense(changes.pop(None))
        for owner, own in changes.items():
            if owner is not None:
                owner.write(own)
        self._replica.write(stored, origin=self._origin, timeout=timeout)

    def delete(self, name: str, *, timeout: float = ACK_TIMEOUT) -> None:
        """Delete a parameter and everything below it; its parent stays, even if empty.

        Raises:
            ParamNotFound: The parameter is not set; also a ``KeyError``.
            ParamError: The parameter is the root.
            PartlyWritten: It is deleted, but a replica refuses that or cannot store it.
            ClosedError: The node is shut down.
        """
        path, owner = self._place(name)
        if owner is None:
            self._replica.delete(path, origin=self._origin, timeout=timeout)
        else:
            owner.write([(path, DELETED)])

    def __delitem__(self, name: str) -> None:
        self.delete(name)

    def has(self, name: str) -> bool:
        """Tell whether a parameter, or anything below the name, is set."""
        path, owner = self._place(name)
        return self._replica.has(path) or (owner is not None and owner.get(path) is not MISSING)

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and self.has(name)

    def search(self, name: str) -> str | None:
        """Search for a parameter from the node's own name upwards.

        Args:
            name: Relative name, whose first part decides; a global name is only looked up.

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
        """Return the sorted global names of all parameters of all nodes."""
        return self._replica.names()

    def __iter__(self) -> Iterator[str]:
        return iter(self.names())

    def __len__(self) -> int:
        return len(self.names())

    def watch(self, name: str, callback: Callable[[Changed], None]) -> Watch:
        """Call a function whenever a parameter, or one below or above it, changes.

        Args:
            name: Global, relative or private name; it need not be set.
            callback: Function called with the change: its full name, the value before and the value
                now (``None`` if not set) and its writer. It is called on one thread for all watches
                of the process, where it may do anything, including setting parameters.

        Returns:
            The watch, which its ``close`` ends.
        """
        return self._replica.watch(self._path(name), callback)

    def origin(self, name: str) -> str:
        """Return the writer of a parameter, as shown to users; empty if nobody set it."""
        return self._replica.origin(self._path(name))

    def __repr__(self) -> str:
        return f"<Params of {self._node}>"

    def _path(self, name: str) -> Path:
        return self._paths.get(name) or split(self.resolve(name))

    def _place(self, name: str) -> tuple[Path, RemoteNode | None]:
        """Return the path of a name, and the remote node that it belongs to."""
        path = self._paths.get(name)
        if path is not None:
            return path, None
        path = split(self.resolve(name))
        if len(self._paths) >= _MAX_CACHED:
            self._paths.clear()
        self._paths[name] = path  # before the look at nodes: one that appears now clears the cache
        owner = None if self._remote is None else self._remote.owner(path)
        if owner is not None:
            self._paths.pop(name, None)
        return path, owner
