"""The store itself: the set of the newest writes, and the tree that replaying them gives.

The tree is the replay of all writes, oldest first, from an empty root:

- a put at a path makes all above it dicts (a leaf there goes) and replaces what is at the path;
- a deletion makes all above it dicts too, and removes what is at the path. Whoever deletes has seen
  the parameter, so in ROS 1 all above it *is* dicts then; saying so again changes nothing, and it
  keeps the empty parent that ROS 1 leaves when the puts before it are gone from the set.

Both only ever overwrite. So a write with a newer one at its own path or above leaves no trace in
any replay, with whatever else may still arrive, and is dropped; what is kept does not depend on
the order of arrival. That makes the store a join-semilattice: merging is commutative, associative
and idempotent.

Deletions are dropped too once they are old and removing them changes nothing (`History.forget`);
an older put that arrives after that comes back to life, which bounds the memory.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from rosz.params.digest import Digest, bucket_of
from rosz.params.paths import Path
from rosz.params.tree import MISSING, Draft, Missing, Tree, lookup, with_delete, with_put
from rosz.params.values import Value
from rosz.params.writes import DELETED, Write, check_write

__all__ = ("History",)


class _Node:
    """A path that is written, or that leads to one."""

    __slots__ = ("below", "write")

    def __init__(self) -> None:
        self.below: dict[str, _Node] = {}
        self.write: Write | None = None


class History:
    """A set of newest writes and its tree; not safe for threads, but its `root` is.

    Attributes:
        root: The tree: never changed in place, replaced by each `apply`.
        latest: The newest time among all writes ever seen.
    """

    def __init__(self) -> None:
        self.root: Tree = {}
        self.latest = 0
        self._top = _Node()
        self._digest = Digest()
        self._deletions: dict[Path, Write] = {}
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def apply(self, writes: Iterable[Write]) -> list[Write]:
        """Take in writes, in any order and any number of times, as one change of the tree.

        Returns:
            Those that were news: not known and not hidden by a newer one.

        Raises:
            ParamError: A write has no meaning in the tree; nothing has changed then.
        """
        incoming = list(writes)
        for write in incoming:
            check_write(write.path, write.value)
        news: list[Write] = []
        steps: list[Write] = []
        for write in incoming:
            shown = self._take(write)
            if shown is not None:
                news.append(write)
                steps += shown
        if steps:
            self.root = _replayed(self.root, steps)
        return news

    def writes(self) -> Iterator[Write]:
        """Yield all writes of the set, those above before those below."""
        stack = [self._top]
        while stack:
            node = stack.pop()
            if node.write is not None:
                yield node.write
            stack.extend(node.below.values())

    def bucket(self, index: int) -> Iterator[Write]:
        """Yield the writes of one bucket of the digest."""
        return (write for write in self.writes() if bucket_of(write.path) == index)

    def digest(self) -> bytes:
        """Return the fingerprint of the set."""
        return self._digest.to_bytes()

    def differing(self, digest: bytes) -> list[int]:
        """Return the buckets in which a replica with that digest holds another set.

        Raises:
            DecodeError: The bytes are no digest.
        """
        return self._digest.differing(digest)

    def find(self, path: Path) -> Write | None:
        """Return the write at a path itself."""
        node: _Node | None = self._top
        for part in path:
            node = node.below.get(part) if node is not None else None
        return node.write if node is not None else None

    def hides(self, write: Write) -> bool:
        """Tell whether a write is known, or has a newer one at its path or above."""
        return any(above.order >= write.order for above in self._above(write.path))

    def source(self, path: Path) -> Write | None:
        """Return the write that a parameter has its value from: the deepest at it or above."""
        found = None
        for found in self._above(path):  # noqa: B007  # the last one is wanted
            pass
        return found

    def forget(self, before: int, keep: int) -> int:
        """Drop old deletions that nothing depends on.

        Args:
            before: Deletions with an older time than this may go, in nanoseconds.
            keep: So many of the newest may stay; of those above the number the oldest may go.

        Returns:
            How many went. Those that still shape the tree stay: they remove a part of an older
            dict that was put whole, or keep an empty dict. There are never more of them than
            there are dicts and parts of dicts that were put.
        """
        by_age: Callable[[Write], tuple[int, str, Path]] = lambda write: write.order  # noqa: E731
        oldest_first = sorted(self._deletions.values(), key=by_age)
        surplus = len(oldest_first) - keep
        gone = 0
        for index, write in enumerate(oldest_first):
            if write.time >= before and index >= surplus:
                break
            if not self._shapes(write):
                self._drop(write.path)
                gone += 1
        return gone

    def _take(self, write: Write) -> list[Write] | None:
        """Put a write into the set; return what is to be replayed for it, or `None` if no news."""
        self.latest = max(self.latest, write.time)
        node = self._top
        for part in write.path:
            if node.write is not None and not _comes_after(write, node.write):
                return None
            below = node.below.get(part)
            if below is None:
                below = node.below[part] = _Node()
            node = below
        if node.write is not None and not _comes_after(write, node.write):
            return None
        later = self._prune(node, write) if node.below else []
        self._hold(node, write)
        return [write, *later]

    def _prune(self, top: _Node, write: Write) -> list[Write]:
        """Drop all older writes below a node; return the newer ones in the order of replay."""
        newer: list[Write] = []
        stack = [top]
        met: list[_Node] = []
        while stack:
            node = stack.pop()
            met.append(node)
            stack.extend(node.below.values())
            if node is top or node.write is None:
                continue
            if _comes_after(node.write, write):
                newer.append(node.write)
            else:
                self._release(node)
        for node in reversed(met):
            node.below = {
                part: below
                for part, below in node.below.items()
                if below.write is not None or below.below
            }
        return sorted(newer, key=_order)

    def _hold(self, node: _Node, write: Write) -> None:
        if node.write is not None:
            self._release(node)
        node.write = write
        self._digest.toggle(write)
        self._count += 1
        if write.value is DELETED:
            self._deletions[write.path] = write

    def _release(self, node: _Node) -> None:
        write = node.write
        if write is None:
            return
        node.write = None
        self._digest.toggle(write)
        self._count -= 1
        if write.value is DELETED:
            del self._deletions[write.path]

    def _above(self, path: Path) -> Iterator[Write]:
        """Yield the writes at a path and above, from the root down: each newer than the last."""
        node: _Node | None = self._top
        for part in (*path, None):
            if node is None:
                return
            if node.write is not None:
                yield node.write
            node = node.below.get(part) if part is not None else None

    def _shapes(self, deletion: Write) -> bool:
        """Tell whether the tree would be another without a deletion."""
        path = deletion.path
        cover = None
        for cover in self._above(path[:-1]):  # noqa: B007  # the last one is wanted
            pass
        beneath: Value | Missing = MISSING
        if cover is not None and cover.value is not DELETED:
            depth = len(cover.path)
            if lookup(cover.value, path[depth:]) is not MISSING:
                return True
            beneath = lookup(cover.value, path[depth:-1])
        if len(path) == 1 or type(beneath) is dict:
            return False
        node = self._node(path[:-1])
        return len(node.below) == 1 and not node.below[path[-1]].below

    def _node(self, path: Path) -> _Node:
        node = self._top
        for part in path:
            node = node.below[part]
        return node

    def _drop(self, path: Path) -> None:
        way = [self._top]
        for part in path:
            way.append(way[-1].below[part])
        self._release(way[-1])
        for depth in range(len(path), 0, -1):
            if way[depth].write is not None or way[depth].below:
                break
            del way[depth - 1].below[path[depth - 1]]


def _comes_after(write: Write, other: Write) -> bool:
    """Tell whether a write is replayed after another: what `Write.order` says, but faster."""
    if write.time != other.time:
        return write.time > other.time
    return write.order > other.order


def _replayed(root: Tree, steps: list[Write]) -> Tree:
    """Return the tree that replaying writes on another gives."""
    if len(steps) == 1:
        step = steps[0]
        if step.value is DELETED:
            return with_delete(root, step.path)
        return with_put(root, step.path, step.value)
    draft = Draft(root)
    for step in steps:
        if step.value is DELETED:
            draft.delete(step.path)
        else:
            draft.put(step.path, step.value)
    return draft.root


def _order(write: Write) -> tuple[int, str, Path]:
    return write.order
