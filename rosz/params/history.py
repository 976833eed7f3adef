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

Deletions (tombstones) are remembered however old they are, so that an older put that arrives late
stays dead. Only their number is bounded: `History.forget` drops the oldest ones and moves the
**horizon** to the newest one dropped. A write up to the horizon that is not in the set may be one
that was deleted, so it is only added if it is proven not to be: if the set holds an older write at
its path or below, because a forgotten deletion that is newer than the write would have removed that
one too. Two sets with different horizons become one by `History.merge`: of the writes up to the
other's horizon, those that the other neither holds nor proves are dropped. So a bounded memory
never brings back what was deleted. It only loses parameters that are new to the other set and older
than its horizon. The proofs depend on earlier merges, so sets with horizons that are merged in
another order may differ; those that merge each other become the same.

A digest is `BUCKETS` numbers. Each write belongs to the bucket of its path and is folded into its
number by exclusive or, so adding and removing cost the same, and equal sets have equal digests.
Two replicas with different digests exchange the buckets that differ, and nothing else.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator, Mapping
from typing import Final, NamedTuple

from rosz.params.paths import ROOT, Path
from rosz.params.tree import MISSING, Draft, Missing, Tree, ends, lookup
from rosz.params.values import Value
from rosz.params.wire import BUCKETS, pack_digest, read_digest
from rosz.params.writes import DELETED, Order, Write, check_write, put

try:
    # The module behind hashlib; hashlib itself would load OpenSSL in every node.
    from _blake2 import blake2b
except ImportError:
    from hashlib import blake2b

_MAX_TOGGLED: Final = 1000
EMPTY_DIGEST: Final = b""
"""The digest of the empty set."""


def _bucket_of(path: str) -> int:
    return zlib.crc32(path.encode()) % BUCKETS


class Differences(NamedTuple):
    """The differences between two sets.

    Attributes:
        lacking: Writes that the other set lacks.
        wanted: Paths of the writes that this set lacks.
        ahead: Whether the other set has to merge this one, to drop writes up to its horizon.
        behind: Whether this set has to merge the other one.
    """

    lacking: list[Write]
    wanted: list[Path]
    ahead: bool
    behind: bool


class Merge(NamedTuple):
    """The result of `History.merge`.

    Attributes:
        new: Writes that were added.
        dropped: Writes that were dropped, and that nothing newer in the set hides.
    """

    new: list[Write]
    dropped: list[Write]


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
        horizon: Time up to which deletions may be forgotten.
    """

    def __init__(self) -> None:
        self.root: Tree = {}
        self.latest: int = 0
        self.horizon: int = 0
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
            The writes that are new, as they are held: neither known nor hidden by a newer one.

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
                new.append(replayed[0])
                steps += replayed
        if steps:
            draft = Draft(self.root)
            for step in steps:
                draft.change(step.path, step.value)
            self.root = draft.root
        return new

    def writes(self) -> Iterator[Write]:
        """Yield all writes of the set; a write comes before those below its path."""
        return self.below(ROOT)

    def below(self, path: Path) -> Iterator[Write]:
        """Yield the writes at a path and below, in the order of `writes`."""
        stack = [self._top]
        for part in path:
            stack = [node.below[part] for node in stack if part in node.below]
        while stack:
            node = stack.pop()
            if node.write is not None:
                yield node.write
            stack.extend(node.below.values())

    def in_buckets(self, indices: Iterable[int]) -> Iterator[Write]:
        """Yield the writes in some buckets of the digest."""
        wanted = frozenset(indices)
        return (write for write in self.writes() if _bucket_of("/".join(write.path)) in wanted)

    def digest(self) -> bytes:
        """Return the digest of the set, in the form that replicas exchange."""
        return pack_digest(self._numbers())

    def differing(self, digest: bytes) -> list[int]:
        """Return the buckets in which this set differs from the set of another digest.

        Raises:
            DecodeError: The bytes are not a digest.
        """
        theirs = read_digest(digest)
        return [index for index, ours in enumerate(self._numbers()) if ours != theirs[index]]

    def compare(
        self, buckets: Iterable[int], index: Mapping[Path, tuple[int, str]], horizon: int
    ) -> Differences:
        """Compare some buckets with those of another set.

        Args:
            buckets: Buckets to compare.
            index: Path, and time and clock, of the writes in these buckets of the other set.
            horizon: Horizon of the other set.
        """
        lacking: list[Write] = []
        wanted: list[Path] = []
        ahead = behind = False
        for write in self.in_buckets(buckets):
            theirs = index.get(write.path)
            if theirs is not None and theirs >= (write.time, write.clock):
                continue
            lacking.append(write)
            behind = behind or write.time <= horizon
        for path, (time, clock) in index.items():
            if not self.hides(Write(path, time, clock, DELETED)):
                wanted.append(path)
                ahead = ahead or time <= self.horizon
        return Differences(lacking, wanted, ahead, behind)

    def find(self, path: Path) -> Write | None:
        """Return the write at exactly this path."""
        source = self.source(path)
        return source if source is not None and source.path == path else None

    def hides(self, write: Write) -> bool:
        """Tell whether a write is known, or a newer one at its path or above is."""
        return any(above.order >= write.order for above in self._above(write.path))

    def source(self, path: Path) -> Write | None:
        """Return the write that gives a path its value: the deepest one at the path or above."""
        deepest = None
        for deepest in self._above(path):  # noqa: B007  # the last one is returned
            pass
        return deepest

    def forget(self, keep: int) -> int:
        """Drop the oldest deletions once there are more than twice as many as to keep.

        Deletions that shape the tree stay: they remove a part of an older dict that was put as a
        whole, or keep an empty dict. There are never more of them than there are dicts and parts of
        dicts that were put.

        Args:
            keep: Number of the newest deletions that stay.

        Returns:
            The number of deletions dropped.
        """
        # Dropping many at once moves the horizon seldom, and other replicas have to follow it.
        surplus = len(self._deletions) - keep
        if surplus <= keep:
            return 0
        oldest_first = sorted(self._deletions.values(), key=lambda write: write.order)
        dropped = 0
        for write in oldest_first[:surplus]:
            if not self._shapes_tree(write):
                self._drop(write.path)
                self.horizon = max(self.horizon, write.time)
                dropped += 1
        return dropped

    def restore(self, horizon: int) -> None:
        """Set the horizon of a set that was stored, after its writes have been added."""
        self.horizon = max(self.horizon, horizon)
        self.latest = max(self.latest, horizon)

    def merge(self, writes: Iterable[Write], horizon: int) -> Merge:
        """Become one with another set, of which all writes and the horizon are given.

        Raises:
            ParamError: The tree cannot hold a write; nothing is changed then.
        """
        ours = {write.order: write for write in self.writes()}
        other = History()
        other.apply(writes)
        theirs = {write.order: write for write in other.writes()}
        kept = _standing(ours, theirs, horizon, other)
        added = _standing(theirs, ours, self.horizon, self)
        merged = History()
        merged.apply([*kept, *added])
        merged.restore(max(self.horizon, horizon))
        merged.latest = max(self.latest, merged.latest)
        self.__dict__.update(merged.__dict__)
        new = {write.order for write in self.writes()} - ours.keys()
        return Merge(
            [write for write in self.writes() if write.order in new],
            [write for write in ours.values() if not self.hides(write)],
        )

    def provable(self, write: Write) -> Write | None:
        """Return the part of a write up to the horizon that is proven to stand.

        If a forgotten deletion were newer than the write and at its path or above, it would have
        removed every older write there, so an older one proves that there is none. Parts of a dict
        may have been deleted by themselves. If some are not proven, only the replacement of
        older writes is proven: that is a deletion, right after the dict.
        """
        if all(self._holds_older(path, write.order) for path, _ in ends(write.value, write.path)):
            return write
        if not self._holds_older(write.path, write.order):
            return None
        return put(write.path, (write.time, f"{write.clock}0"), DELETED, write.origin)

    def _holds_older(self, path: Path, order: Order) -> bool:
        """Tell whether an older write is held at a path or below, or one above holds a part."""
        if any(write.order < order for write in self.below(path)):
            return True
        cover = self.source(path)
        if cover is None or cover.order >= order or cover.value is DELETED:
            return False
        return lookup(cover.value, path[len(cover.path) :]) is not MISSING

    def _add(self, write: Write) -> list[Write]:
        """Add a write; return the writes to replay for it, which are none if it is not new."""
        if write.time <= self.horizon:
            provable = self.provable(write)
            if provable is None:
                return []
            write = provable
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


def _standing(
    writes: Mapping[Order, Write], others: Mapping[Order, Write], horizon: int, other: History
) -> Iterator[Write]:
    """Yield the writes of a set that stand when another set, with its horizon, is merged."""
    for order, write in writes.items():
        standing = write if write.time > horizon or order in others else other.provable(write)
        if standing is not None:
            yield standing


def _comes_after(write: Write, other: Write) -> bool:
    """Tell whether a write is replayed after another; faster than comparing `Write.order`."""
    if write.time != other.time:
        return write.time > other.time
    return write.order > other.order
