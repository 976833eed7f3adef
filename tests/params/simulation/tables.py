"""Tables of numbers, for a sweep."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


class Numbers:
    """Numbers for things, in the order in which they are met."""

    def __init__(self, *first: Any) -> None:
        self.things: list[Any] = []
        self._numbers: dict[Any, int] = {}
        for thing in first:
            self.of(thing)

    def of(self, thing: Any) -> int:
        """Return the number of a thing."""
        number = self._numbers.setdefault(thing, len(self.things))
        if number == len(self.things):
            self.things.append(thing)
        return number


class Facts:
    """Facts about things that have numbers, as arrays that grow.

    Args:
        kinds: Type and number of values of each fact.
    """

    def __init__(self, **kinds: tuple[type, int]) -> None:
        self.size = 0
        self._arrays: dict[str, Array] = {
            name: np.zeros((1024, width) if width else 1024, kind)
            for name, (kind, width) in kinds.items()
        }
        self._added: list[dict[str, Any]] = []

    def __getitem__(self, name: str) -> Array:
        if self._added:
            self._store()
        return self._arrays[name]

    def add(self, **facts: Any) -> None:
        """Add the facts about the thing that comes next; those that are not given are 0."""
        self._added.append(facts)
        self.size += 1

    def _store(self) -> None:
        added, self._added = self._added, []
        first = self.size - len(added)
        for name, known in self._arrays.items():
            none = np.zeros(known.shape[1:], known.dtype)
            if self.size > len(known):
                more = np.zeros((self.size, *known.shape[1:]), known.dtype)
                self._arrays[name] = np.concatenate([known, more])
            values = [facts.get(name, none) for facts in added]
            self._arrays[name][first : self.size] = values


class Hashes:
    """A set of numbers of 64 bits, in an array with open addressing; 0 counts as 1."""

    def __init__(self) -> None:
        self.size = 0
        self._slots = np.zeros(1 << 12, np.uint64)

    def add(self, hashes: Array) -> Array:
        """Add numbers; return the places of those that are new, once for each number."""
        hashes = np.maximum(hashes, np.uint64(1))
        new = np.nonzero(self._find(hashes) < 0)[0]
        if not len(new):
            return new
        unique, first = np.unique(hashes[new], return_index=True)
        if (self.size + len(unique)) * 5 > len(self._slots) * 3:
            self._grow(self.size + len(unique))
        self._insert(unique)
        self.size += len(unique)
        places: Array = new[first]
        return places

    def _find(self, keys: Array) -> Array:
        """Return the slot of each number; -1 if it is not there."""
        mask = np.uint64(len(self._slots) - 1)
        slots = mixed(keys) & mask
        there = self._slots[slots]
        found = np.where(there == keys, slots.astype(np.int64), -1)
        more = np.nonzero((there != keys) & (there != 0))[0]
        while len(more):
            slots[more] = (slots[more] + np.uint64(1)) & mask
            there = self._slots[slots[more]]
            is_it = there == keys[more]
            found[more[is_it]] = slots[more[is_it]]
            more = more[~is_it & (there != 0)]
        return found

    def _insert(self, keys: Array) -> Array:
        """Insert numbers that differ and are not there; return their slots."""
        mask = np.uint64(len(self._slots) - 1)
        slots = mixed(keys) & mask
        more = np.arange(len(keys))
        while len(more):
            free = more[self._slots[slots[more]] == 0]
            self._slots[slots[free]] = keys[free]  # of those that take one slot, one is there now
            more = more[self._slots[slots[more]] != keys[more]]
            slots[more] = (slots[more] + np.uint64(1)) & mask
        return slots.astype(np.int64)

    def _grow(self, size: int) -> None:
        old = self._slots
        self._slots = np.zeros(max(2 * len(old), 1 << (2 * size).bit_length()), np.uint64)
        for start in range(0, len(old), 1 << 22):
            part = old[start : start + (1 << 22)]
            self._insert(part[part != 0])


class Index(Hashes):
    """A map from numbers of 64 bits to others."""

    def __init__(self) -> None:
        super().__init__()
        self._values = np.zeros(len(self._slots), np.int64)

    def of(self, keys: Array) -> Array:
        """Return the value of each number; -1 if it has none."""
        found = self._find(np.maximum(keys, np.uint64(1)))
        values: Array = np.where(found < 0, -1, self._values[found])
        return values

    def put(self, keys: Array, values: Array) -> None:
        """Give values to numbers that differ and have none."""
        keys = np.maximum(keys, np.uint64(1))
        if (self.size + len(keys)) * 2 > len(self._slots):
            held = self._slots != 0
            old, there = self._slots[held], self._values[held]
            self._slots = np.zeros(1 << (4 * (self.size + len(keys))).bit_length(), np.uint64)
            self._values = np.zeros(len(self._slots), np.int64)
            self._values[self._insert(old)] = there
        self._values[self._insert(keys)] = values
        self.size += len(keys)


def mixed(values: Array) -> Array:
    """Return well-mixed hashes of numbers (the last step of splitmix64)."""
    values = (values ^ (values >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    values ^= values >> np.uint64(27)
    values *= np.uint64(0x94D049BB133111EB)
    values ^= values >> np.uint64(31)
    return values


def hashes_of(*columns: Array) -> Array:
    """Return a hash of each row of some columns."""
    total = np.full(len(columns[0]), 0x9E3779B97F4A7C15, np.uint64)
    for column in columns:
        total += column.astype(np.uint64)
        total = mixed(total)
        total += np.uint64(0x9E3779B97F4A7C15)
    return total


def looked_up(index: Index, keys: Array, make: Callable[[int], int]) -> Array:
    """Return the values of keys; make those that are not there."""
    values = index.of(keys.view(np.uint64))
    missing = np.nonzero(values < 0)[0]
    if len(missing):
        unique, place = np.unique(keys[missing], return_inverse=True)
        made = np.array([make(key) for key in unique.tolist()], np.int64)
        index.put(unique.view(np.uint64), made)
        values[missing] = made[place]
    return values
