"""What a command or a file sets, as the writes of one batch.

ROS 1's command line does not replace a dict but sets its leaves one by one, so that what is beside
them stays. Here those leaves become one batch, checked whole before anything is written.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from rosz.errors import ParamError
from rosz.params.paths import Path, split
from rosz.params.values import Value, type_name
from rosz.params.writes import Deleted, check_write

__all__ = ("Change", "condense", "spread")

Change = tuple[Path, "Value | Deleted"]
"""What one write of a batch does: where and what."""


def spread(name: str, value: Value) -> Iterator[Change]:
    """Yield the leaves that setting a value from the command line sets.

    A key may lead several levels down (``a/b``), or start at the root (``/a``), which leaves the
    name it stands under; an empty dict sets nothing.

    Args:
        name: Global name.
        value: A value already normalised.

    Raises:
        ParamError: A key is private, or the root is to be no dict.
        InvalidName: A key holds a character that no name can.
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
    """Return a batch with the effect of changes made one after the other.

    What a later change at the same path or above it undoes is left out, so that of any two changes
    left the one that lies deeper is the later one: the order in which a batch is replayed.
    """
    top = _Place()
    for change in changes:
        place = top
        for part in change[0]:
            place = place.below.setdefault(part, _Place())
        place.change = change
        place.below = {}
    return list(top.collect())


class _Place:
    __slots__ = ("below", "change")

    def __init__(self) -> None:
        self.below: dict[str, _Place] = {}
        self.change: Change | None = None

    def collect(self) -> Iterator[Change]:
        if self.change is not None:
            yield self.change
        for place in self.below.values():
            yield from place.collect()
