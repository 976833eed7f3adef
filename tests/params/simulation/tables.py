"""Tables of numbers, for a sweep."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


class Numbers:
    """Numbers for things, in the order in which they are met."""

    def __init__(self) -> None:
        self.things: list[Any] = []
        self._numbers: dict[Any, int] = {}

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

    def __getitem__(self, name: str) -> Array:
        return self._arrays[name]

    def add(self, **facts: Any) -> None:
        """Add the facts about the thing that comes next."""
        for name, value in facts.items():
            array = self._arrays[name]
            if self.size == len(array):
                array = self._arrays[name] = np.concatenate([array, np.zeros_like(array)])
            array[self.size] = value
        self.size += 1


class Hashes:
    """The hashes that were met, in sorted arrays of which each is longer than the next."""

    def __init__(self) -> None:
        self._runs: list[Array] = []

    def add(self, hashes: Array) -> Array:
        """Add sorted hashes; return which of them are new."""
        new = np.ones(len(hashes), bool)
        for run in self._runs:
            places = np.minimum(np.searchsorted(run, hashes), len(run) - 1)
            new &= run[places] != hashes
        if new.any():
            self._runs.append(hashes[new])
        while len(self._runs) > 1 and len(self._runs[-2]) < 2 * len(self._runs[-1]):
            last = self._runs.pop()
            merged = np.concatenate([self._runs.pop(), last])
            merged.sort()
            self._runs.append(merged)
        return new


def mixed(values: Array) -> Array:
    """Return well-mixed hashes of numbers (the last step of splitmix64)."""
    values = (values ^ (values >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    values = (values ^ (values >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    mixed: Array = values ^ (values >> np.uint64(31))
    return mixed


def hashes_of(rows: Array) -> Array:
    """Return a hash of each row."""
    total = np.zeros(len(rows), np.uint64)
    for column in rows.T:
        total = mixed(total + column.astype(np.uint64) + np.uint64(0x9E3779B97F4A7C15))
    return total


def stacked(rows: Array, more: Array | None, columns: int = 0) -> Array:
    """Return rows with more below them, or with more columns; what is not there is 0."""
    height = 0 if more is None else len(more)
    width = max(rows.shape[1], 0 if more is None else more.shape[1]) + columns
    made = np.zeros((len(rows) + height, width), np.int64)
    made[: len(rows), : rows.shape[1]] = rows
    if more is not None:
        made[len(rows) :, : more.shape[1]] = more
    return made
