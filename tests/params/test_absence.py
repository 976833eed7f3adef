"""Replicas that are absent, return, and are restored: nothing deleted comes back, nothing is lost.

Hypothesis draws histories of a few replicas of the pure half: they write and delete, tell some
others at once or none, forget deletions, exchange differences in pairs, and are copied to and
restored from disks. At the end all of them exchange until they hold the same, and what they hold is
compared with all that was ever written.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from rosz.params.history import EMPTY_DIGEST, History
from rosz.params.paths import Path
from rosz.params.tree import lookup
from rosz.params.writes import DELETED, Write, put

from .oracle import replay

PATHS = [(one,) for one in "abcd"] + [(one, other) for one in "ab" for other in "abc"]
MOST = 6
CHANCES = st.integers(0, 1 << 60).map(random.Random)


def numbers(value: Any, path: Path = ()) -> Iterator[tuple[Path, int]]:
    if isinstance(value, dict):
        for key, item in value.items():
            yield from numbers(item, (*path, key))
    else:
        yield path, value


def is_above(path: Path, other: Path) -> bool:
    return other[: len(path)] == path


class Copy:
    """One replica; its clock is its own, and follows what it sees."""

    def __init__(self, clock: str, skew: int) -> None:
        self.clock = clock
        self.skew = skew
        self.history = History()

    def stamp(self, now: int) -> tuple[int, str]:
        return max(now + self.skew, self.history.latest + 1), self.clock

    def restore(self, writes: list[Write], horizon: int) -> None:
        self.history.apply(writes)
        self.history.restore(horizon)

    def merge(self, other: Copy) -> None:
        self.history.merge(list(other.history.writes()), other.history.horizon)

    def exchange(self, other: Copy, *, follow: bool = True) -> None:
        """Do what `rosz.params.replica.sync` does to one replica at the wish of another."""
        ours, theirs = self.history, other.history
        behind = ours.horizon > theirs.horizon
        if ours.horizon < theirs.horizon:
            self.merge(other)
        elif ours.digest() == EMPTY_DIGEST:
            ours.apply(theirs.writes())
        buckets = ours.differing(theirs.digest())
        index = {write.path: (write.time, write.clock) for write in ours.in_buckets(buckets)}
        found = theirs.compare(buckets, index, ours.horizon)
        if found.ahead:
            self.merge(other)
        else:
            ours.apply(found.lacking)
        sent = [ours.find(path) for path in found.wanted]
        theirs.apply([write for write in sent if write is not None])
        if follow and (behind or found.behind):
            other.exchange(self, follow=False)


class Histories:
    """Histories of absence, drawn step by step.

    Args:
        chance: What decides.
        keeps: Number of deletions that replicas remember.
    """

    def __init__(self, chance: random.Random, keeps: int) -> None:
        self.chance = chance
        self.keeps = keeps
        self.now = 0
        self.count = 0
        self.made: list[Write] = []
        self.copies = [Copy(f"{index:02x}", chance.randrange(30)) for index in range(3)]
        self.disks: list[tuple[list[Write], int]] = []

    def run(self, steps: int) -> None:
        weights = {
            self.set_number: 6,
            self.set_dict: 1,
            self.delete: 6,
            self.forget: 2,
            self.exchange: 2,
            self.save: 1,
            self.start: 1,
        }
        for step in self.chance.choices(list(weights), list(weights.values()), k=steps):
            step()
            for copy in self.copies:
                assert copy.history.root == replay(copy.history.writes())
        self.converge()

    def one(self) -> Copy:
        return self.chance.choice(self.copies)

    def write(self, copy: Copy, path: Path, value: Any) -> None:
        self.now += 10
        write = put(path, copy.stamp(self.now), value)
        self.made.append(write)
        near = self.chance.sample(self.copies, self.chance.randrange(len(self.copies)))
        for one in (copy, *near):
            one.history.apply([write])

    def number(self) -> int:
        self.count += 1
        return self.count

    def set_number(self) -> None:
        self.write(self.one(), self.chance.choice(PATHS), self.number())

    def set_dict(self) -> None:
        names = self.chance.sample("abc", self.chance.randrange(4))
        value: dict[str, Any] = {name: self.number() for name in names}
        if names and self.chance.random() < 0.3:  # now and then
            value[names[0]] = {"a": self.number()}
        self.write(self.one(), self.chance.choice(PATHS), value)

    def delete(self) -> None:
        copy = self.one()
        found = [path for path, _ in numbers(copy.history.root)]
        every = sorted({path[:depth] for path in found for depth in range(1, len(path) + 1)})
        if every:
            self.write(copy, self.chance.choice(every), DELETED)

    def forget(self) -> None:
        self.one().history.forget(self.keeps)

    def exchange(self) -> None:
        self.one().exchange(self.one())

    def save(self) -> None:
        history = self.one().history
        self.disks.append((list(history.writes()), history.horizon))

    def start(self) -> None:
        """Start a replica with nothing, or with the disk of some replica as it was some day."""
        if len(self.copies) < MOST:
            copy = Copy(f"{len(self.copies):02x}", self.chance.randrange(30))
            if self.disks and self.chance.random() < 0.8:  # mostly
                copy.restore(*self.chance.choice(self.disks))
            self.copies.append(copy)

    def converge(self) -> None:
        for _ in range(4):
            for copy in self.copies:
                for other in self.copies:
                    if copy is not other:
                        copy.exchange(other)
        states = {
            (copy.history.digest(), copy.history.horizon, repr(sorted(numbers(copy.history.root))))
            for copy in self.copies
        }
        assert len(states) <= 1, "not all hold the same"

    def check(self) -> None:
        """Compare what all hold in the end with what was ever written."""
        history = self.copies[0].history
        origins = {
            number: write for write in self.made for _, number in numbers(write.value, write.path)
        }
        for path, number in numbers(history.root):
            order = origins[number].order
            for write in self.made:
                deletes = write.deleted and write.order > order
                assert not (deletes and is_above(write.path, path)), f"{path} came back"
        for write in self.made:
            if write.deleted or write.time <= history.horizon:
                continue
            newer = [other for other in self.made if other.order > write.order]
            for path, number in numbers(write.value, write.path):
                if not any(is_above(w.path, path) or is_above(path, w.path) for w in newer):
                    assert lookup(history.root, path) == number, f"{path} is lost"


@settings(max_examples=300)
@given(CHANCES, st.integers(0, 3), st.integers(10, 80))
def test_nothing_comes_back_when_deletions_are_forgotten(
    chance: random.Random, keeps: int, steps: int
) -> None:
    histories = Histories(chance, keeps)
    histories.run(steps)
    histories.check()


@settings(max_examples=50)
@given(CHANCES, st.integers(10, 80))
def test_nothing_at_all_is_lost_before_that(chance: random.Random, steps: int) -> None:
    histories = Histories(chance, 1000)
    histories.run(steps)
    histories.check()
    assert histories.copies[0].history.root == replay(histories.made)
