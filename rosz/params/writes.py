"""Writes, which the store is a set of, and batches of writes.

Writes are ordered by stamp, then by path, so that one stamp may cover a batch: within a batch, what
lies deeper comes later. Nothing else decides the order, so every replica orders all writes alike.

A batch is what one call writes. ROS 1's command line does not replace a dict but sets its leaves
one by one, so that parameters beside them stay. Here those leaves become one batch (`spread`),
which is checked as a whole before anything is written.
"""

from __future__ import annotations

import enum
from collections.abc import Iterable, Iterator
from typing import Final, Literal

import msgspec

from rosz.errors import DecodeError, ParamError
from rosz.params.paths import ROOT, Path, joined, split
from rosz.params.values import MAX_DEPTH, Value, type_name

_PAST: Final = 1_767_225_600 * 10**9
"""The start of 2026: a clock without a battery starts years behind, and shows an earlier time."""

_YEAR: Final = 365 * 86_400 * 10**9
_MAX_YEARS_AHEAD: Final = 10
"""Years that a stamp may be ahead. If a later stamp were accepted, all writes after it would need
still later stamps, on every machine and for ever."""


class Deleted(enum.Enum):
    """The value of a write that deletes."""

    DELETED = "deleted"


DELETED: Final[Literal[Deleted.DELETED]] = Deleted.DELETED

Change = tuple[Path, "Value | Deleted"]
"""One part of a batch: a path, and its new value or `DELETED`."""


Order = tuple[int, str, Path]
"""The time, clock and path of a write; no two writes share all three."""


class Write(msgspec.Struct, frozen=True):
    """One put or deletion.

    Attributes:
        path: Path that is written.
        time: Time of the hybrid logical clock, in nanoseconds since the epoch.
        clock: Clock that gave the time; no two clocks have the same name.
        value: New value, or `DELETED`. It belongs to the store and must not be changed.
        origin: Writer, as shown to users.
    """

    path: Path
    time: int
    clock: str
    value: Value | Deleted
    origin: str = ""

    @property
    def order(self) -> Order:
        """The sort key that puts writes into the order of their replay."""
        return self.time, self.clock, self.path

    @property
    def deleted(self) -> bool:
        """Whether the write deletes."""
        return self.value is DELETED


def put(path: Path, stamp: tuple[int, str], value: Value | Deleted, origin: str = "") -> Write:
    """Return the write of a normalised value, or of a deletion; at the root, that sets ``{}``.

    Raises:
        ParamError: The root would not be a dict, or the path is too deep.
    """
    if value is DELETED and not path:
        value = {}
    check_write(path, value)
    return Write(path, stamp[0], stamp[1], value, origin)


def latest_time(now: int) -> int:
    """Return the latest time of a stamp that is not refused.

    Args:
        now: Time of the local clock, in nanoseconds since the epoch.
    """
    return max(now, _PAST) + _MAX_YEARS_AHEAD * _YEAR


def check_time(write: Write, now: int) -> None:
    """Refuse a write whose stamp lies years ahead.

    Args:
        write: Write to check.
        now: Time of the local clock, in nanoseconds since the epoch.

    Raises:
        DecodeError: The stamp lies years ahead.
    """
    if write.time > latest_time(now):
        ahead = write.time - max(now, _PAST)
        raise DecodeError(
            "parameter stamp",
            -1,
            f"'{joined(write.path)}' of {write.origin!r} is stamped {ahead / _YEAR:.1f} years"
            f" ahead, expected at most {_MAX_YEARS_AHEAD}: set the clock of the machine that wrote"
            " it",
        )


def check_write(path: Path, value: Value | Deleted) -> None:
    """Refuse a write that the tree cannot hold.

    Raises:
        ParamError: The root would not be a dict, or the path is too deep.
    """
    if path == ROOT and type(value) is not dict:
        raise ParamError(
            f"'/' cannot be the {type_name(value)} {value!r}: the root of all parameters is a dict"
        )
    if len(path) > MAX_DEPTH:
        raise ParamError(
            f"'{joined(path[:3])}/…' has {len(path)} parts; expected at most {MAX_DEPTH}"
        )


def spread(name: str, value: Value) -> Iterator[Change]:
    """Yield the leaves that the command line sets for a value.

    A key may lead several levels down (``a/b``), or start at the root (``/a``) whatever name it
    stands under. An empty dict sets nothing.

    Args:
        name: Global name.
        value: Normalised value.

    Raises:
        ParamError: A key is private, or the root would not be a dict.
        InvalidName: A key holds half of a surrogate pair.
    """
    if type(value) is not dict:
        path = split(name)
        if not path:
            raise ParamError(
                f"'/' can only be set to a dict, not to the {type_name(value)} {value!r}"
            )
        check_write(path, value)
        yield path, value
        return
    for key, item in value.items():
        if key.startswith("~"):
            raise ParamError(
                f"the key '{key}' in '{name}' is private, but a command has no node of its own; "
                "write the node's name instead of '~'"
            )
        yield from spread(key if key.startswith("/") else f"{name.rstrip('/')}/{key}", item)


def condense(changes: Iterable[Change]) -> list[Change]:
    """Return a batch with the same effect as changes made one after the other.

    A change that a later one at the same path or above undoes is left out. So of any two changes
    left, the deeper one is the later one, which is the order in which a batch is replayed.
    """
    kept: list[Change] = []
    later: set[Path] = set()
    for change in reversed(list(changes)):
        path = change[0]
        if not any(path[:depth] in later for depth in range(len(path) + 1)):
            later.add(path)
            kept.append(change)
    return kept[::-1]
