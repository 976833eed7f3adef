"""A write: what the store is a set of.

Writes are ordered by stamp, then by path, so that one stamp may cover a batch: in a batch what lies
deeper comes later. Nothing else decides anything, so every replica orders all writes alike.
"""

from __future__ import annotations

import enum
from typing import Final, Literal

import msgspec

from rosz.errors import DecodeError, ParamError
from rosz.params.paths import ROOT, Path, joined
from rosz.params.values import MAX_DEPTH, Value, type_name

__all__ = ("DELETED", "Deleted", "Write", "check_time", "check_write", "delete", "put")

_KNOWN: Final = 1_767_225_600 * 10**9
"""A moment that is over, the year 2026: clocks without a battery begin anew, years behind."""

_YEAR: Final = 365 * 86_400 * 10**9
_AHEAD: Final = 10
"""Years that a clock may be ahead. Were later stamps believed, all that is written after one of
them would have to be stamped still later, on every machine and for ever."""


class Deleted(enum.Enum):
    """The value of a write that deletes."""

    DELETED = "deleted"

    def __repr__(self) -> str:
        return "DELETED"


DELETED: Final[Literal[Deleted.DELETED]] = Deleted.DELETED


class Write(msgspec.Struct, frozen=True):
    """One put or deletion.

    Attributes:
        path: Where.
        time: Nanoseconds of the hybrid logical clock.
        clock: The clock that gave the time, which no other clock shares.
        value: What, or `DELETED`. Belongs to the store: never change it.
        origin: Who wrote it, for people.
    """

    path: Path
    time: int
    clock: str
    value: Value | Deleted
    origin: str = ""

    @property
    def order(self) -> tuple[int, str, Path]:
        """What sorts writes into the order of their replay."""
        return self.time, self.clock, self.path

    @property
    def deleted(self) -> bool:
        """Whether it deletes."""
        return self.value is DELETED


def put(path: Path, stamp: tuple[int, str], value: Value, origin: str = "") -> Write:
    """Return the write that sets a value already normalised.

    Raises:
        ParamError: The root is to be no dict, or the path is too deep.
    """
    check_write(path, value)
    return Write(path, stamp[0], stamp[1], value, origin)


def delete(path: Path, stamp: tuple[int, str], origin: str = "") -> Write:
    """Return the write that deletes; at the root, one that leaves it empty.

    Raises:
        ParamError: The path is too deep.
    """
    return put(path, stamp, DELETED if path else {}, origin)


def check_time(write: Write, now: int) -> None:
    """Refuse a write that is stamped so late that no clock can have been meant.

    Args:
        write: It.
        now: What the clock here says, in nanoseconds since the epoch.

    Raises:
        DecodeError: It is.
    """
    ahead = write.time - max(now, _KNOWN)
    if ahead > _AHEAD * _YEAR:
        raise DecodeError(
            "parameter stamp",
            -1,
            f"'{joined(write.path)}' of {write.origin!r} is stamped {ahead // _YEAR} years ahead,"
            f" expected at most {_AHEAD}: set the clock of the machine that wrote it",
        )


def check_write(path: Path, value: Value | Deleted) -> None:
    """Refuse a write that has no meaning in the tree.

    Raises:
        ParamError: The root is to be no dict, or the path is too deep.
    """
    if path == ROOT and type(value) is not dict:
        raise ParamError(
            f"'/' cannot be the {type_name(value)} {value!r}: the root of all parameters is a dict"
        )
    if len(path) > MAX_DEPTH:
        raise ParamError(
            f"'{joined(path[:3])}/…' has {len(path)} parts; expected at most {MAX_DEPTH}"
        )
