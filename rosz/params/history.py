"""The set of the newest writes, the tree that replaying them gives, and its digest.

The tree is the replay of all writes, oldest first, from an empty root:

- a put at a path turns all above it into dicts (a leaf there is lost) and replaces what is there;
- a deletion turns all above it into dicts too, and removes what is at the path. Whoever deletes a
  parameter has seen it, so in ROS 1 all above it *are* dicts then. Repeating that changes nothing,
  and it keeps the empty parent that ROS 1 leaves when the puts before it have left the set.

Both only overwrite. So a write leaves no trace in any replay if a newer one at its own path or
above is in the set, whatever else may still arrive. Such a write is dropped, and which writes
remain does not depend on the order of arrival. That makes the store a join-semilattice: merging is
commutative, associative and idempotent.

Deletions (tombstones) are dropped too once they are old and removing them changes nothing
(`History.forget`), which bounds the memory. An older put that arrives after that takes effect
again.

A digest is `BUCKETS` numbers. Each write belongs to the bucket of its path and is folded into its
number by exclusive or, so adding and removing cost the same, and equal sets have equal digests.
Two replicas with different digests exchange the buckets that differ, and nothing else.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Iterator
from typing import Final

from rosz.errors import DecodeError
from rosz.params.paths import Path
from rosz.params.tree import MISSING, Draft, Missing, Tree, lookup
from rosz.params.values import Value
from rosz.params.writes import DELETED, Write, check_write

try:
    # The module behind hashlib; hashlib itself would load OpenSSL in every node.
    from _blake2 import blake2b
except ImportError:
    from hashlib import blake2b

__all__ = ("BUCKETS", "EMPTY_DIGEST", "History")

BUCKETS: Final = 64
_MAX_TOGGLED: Final = 1000
_DIGEST: Final = struct.Struct(f"<{BUCKETS}Q")
EMPTY_DIGEST: Final = bytes(_DIGEST.size)
"""The digest of the empty set."""


def _bucket_of(path: str) -> int:
    return zlib.crc32(path.encode()) % BUCKETS


class _Node:
    """A path that is written, or that leads to one that is."""

    __slots__ = ("below", "write")

    def __init__(self) -> None:
        self.below: dict[str, _Node] = {}
        self.write: Write | None = None


class History:
    """The set of the newest writes and its tree; not safe for threads, except for `root`.

    Attributes:
        root: Tree; `apply` replaces it and never changes it in place.
        latest: Newest time among all writes ever seen.
    """

    def __init__(self) -> None:
        self.root: Tree = {}
        self.latest: int = 0
        self._top = _Node()
        self._buckets = [0] * BUCKETS
        # Writes come and go far more often than the digest is read: they are only listed here, and
        # folded in when the digest is read, or when the list is long.
        self._toggled: list[Write] = []
        self._deletions: dict[Path, Write] = {}
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def apply(self, writes: Iterable[Write]) -> list[Write]:
        """Add writes, in any order and any number of times, as one change of the tree.

        Returns:
            The writes that are new: neither known nor hidden by a newer one.

        Raises:
            ParamError: The tree cannot hold a write; nothing is changed then.
        """
        incoming = list(writes)
        for write in incoming:
            check_write(write.path, write.value)
        new: list[Write] = []
        steps: list[Write] = []
        for write in incoming:
            replayed = self._add(write)
            if replayed:
                new.append(write)
                steps += replayed
        if steps:
            draft = Draft(self.root)
            for step in steps:
                draft.change(step.path, step.value)
            self.root = draft.root
        return new

    def writes(self) -> Iterator[Write]:
        """Yield all writes of the set; a write comes before those below its path."""
        stack = [self._top]
        while stack:
            node = stack.pop()
            if node.write is not None:
                yield node.write
            stack.extend(node.below.values())

    def bucket(self, index: int) -> Iterator[Write]:
        """Yield the writes in one bucket of the digest."""
        return (write for write in self.writes() if _bucket_of("/".join(write.path)) == index)

    def digest(self) -> bytes:
        """Return the digest of the set, in the form that replicas exchange."""
        return _DIGEST.pack(*self._numbers())

    def differing(self, digest: bytes) -> list[int]:
        """Return the buckets in which this set differs from the set of another digest.

        Raises:
            DecodeError: The bytes are not a digest.
        """
        if len(digest) != _DIGEST.size:
            raise DecodeError("digest", 0, f"{len(digest)} bytes, expected {_DIGEST.size}")
        theirs = _DIGEST.unpack(digest)
        return [index for index, ours in enumerate(self._numbers()) if ours != theirs[index]]

    def find(self, path: Path) -> Write | None:
        """Return the write at exactly this path."""
        found = self.source(path)
        return found if found is not None and found.path == path else None

    def hides(self, write: Write) -> bool:
        """Tell whether a write is known, or a newer one at its path or above is."""
        return any(above.order >= write.order for above in self._above(write.path))

    def source(self, path: Path) -> Write | None:
        """Return the write that gives a path its value: the deepest one at the path or above."""
        found = None
        for found in self._above(path):  # noqa: B007  # the last one is returned
            pass
        return found

    def forget(self, before: int, keep: int) -> int:
        """Drop old deletions that the tree does not depend on.

        Deletions that shape the tree stay: they remove a part of an older dict that was put as a
        whole, or keep an empty dict. There are never more of them than there are dicts and parts of
        dicts that were put.

        Args:
            before: Time in nanoseconds; older deletions may be dropped.
            keep: Number of deletions above which the oldest ones may be dropped.

        Returns:
            The number of deletions dropped.
        """
        oldest_first = sorted(self._deletions.values(), key=lambda write: write.order)
        surplus = len(oldest_first) - keep
        dropped = 0
        for index, write in enumerate(oldest_first):
            if write.time >= before and index >= surplus:
                break
            if not self._shapes_tree(write):
                self._drop(write.path)
                dropped += 1
        return dropped

    def _add(self, write: Write) -> list[Write]:
        """Add a write; return the writes to replay for it, which are none if it is not new."""
        self.latest = max(self.latest, write.time)
        node = self._top
        for part in write.path:
            if node.write is not None and not _comes_after(write, node.write):
                return []
            below = node.below.get(part)
            if below is None:
                below = node.below[part] = _Node()
            node = below
        if node.write is not None and not _comes_after(write, node.write):
            return []
        later = self._prune(node, write) if node.below else []
        self._put(node, write)
        return [write, *later]

    def _prune(self, top: _Node, write: Write) -> list[Write]:
        """Drop all older writes below a node; return the newer ones in the order of replay."""
        newer: list[Write] = []
        stack = [top]
        visited: list[_Node] = []
        while stack:
            node = stack.pop()
            visited.append(node)
            stack.extend(node.below.values())
            if node is top or node.write is None:
                continue
            if _comes_after(node.write, write):
                newer.append(node.write)
            else:
                self._remove(node)
        for node in reversed(visited):
            node.below = {
                part: below
                for part, below in node.below.items()
                if below.write is not None or below.below
            }
        return sorted(newer, key=lambda write: write.order)

    def _put(self, node: _Node, write: Write) -> None:
        if node.write is not None:
            self._remove(node)
        node.write = write
        self._toggle(write)
        self._count += 1
        if write.value is DELETED:
            self._deletions[write.path] = write

    def _remove(self, node: _Node) -> None:
        write = node.write
        if write is None:
            return
        node.write = None
        self._toggle(write)
        self._count -= 1
        if write.value is DELETED:
            del self._deletions[write.path]

    def _toggle(self, write: Write) -> None:
        """Add a write to the digest, or remove it if it is in it."""
        self._toggled.append(write)
        if len(self._toggled) >= _MAX_TOGGLED:
            self._numbers()

    def _numbers(self) -> list[int]:
        """Return the number of each bucket of the digest."""
        toggled, self._toggled = self._toggled, []
        for write in toggled:
            text = "/".join(write.path)
            mark = blake2b(f"{write.time} {write.clock} {text}".encode(), digest_size=8).digest()
            self._buckets[_bucket_of(text)] ^= int.from_bytes(mark, "little")
        return self._buckets

    def _above(self, path: Path) -> Iterator[Write]:
        """Yield the writes at a path and above, from the root down; each is newer than the last."""
        node: _Node | None = self._top
        for part in (*path, None):
            if node is None:
                return
            if node.write is not None:
                yield node.write
            node = node.below.get(part) if part is not None else None

    def _shapes_tree(self, deletion: Write) -> bool:
        """Tell whether the tree would differ without a deletion."""
        path = deletion.path
        cover = self.source(path[:-1])
        beneath: Value | Missing = MISSING
        if cover is not None and cover.value is not DELETED:
            depth = len(cover.path)
            if lookup(cover.value, path[depth:]) is not MISSING:
                return True
            beneath = lookup(cover.value, path[depth:-1])
        if len(path) == 1 or type(beneath) is dict:
            return False
        node = self._top
        for part in path[:-1]:
            node = node.below[part]
        return len(node.below) == 1 and not node.below[path[-1]].below

    def _drop(self, path: Path) -> None:
        way = [self._top]
        for part in path:
            way.append(way[-1].below[part])
        self._remove(way[-1])
        for depth in range(len(path), 0, -1):
            if way[depth].write is not None or way[depth].below:
                break
            del way[depth - 1].below[path[depth - 1]]


def _comes_after(write: Write, other: Write) -> bool:
    """Tell whether a write is replayed after another; faster than comparing `Write.order`."""
    if write.time != other.time:
        return write.time > other.time
    return write.order > other.order
