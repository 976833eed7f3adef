"""What happens later in a world."""

from __future__ import annotations

import msgspec

from rosz.params.replica.core import events as said
from rosz.params.writes import Write


class Item(msgspec.Struct, frozen=True):
    """Something that happens later; the base class of all items."""


class Deliver(Item, frozen=True):
    """An event reaches a process, over the link from a machine if there is a source."""

    zid: str
    event: said.Event
    source: str = ""


class Fire(Item, frozen=True):
    """A timer fires, unless another one took its place."""

    zid: str
    timer: said.Timer
    call: int
    ident: int


class Finish(Item, frozen=True):
    """The disk of a process is done with some saves."""

    zid: str


class Reconcile(Item, frozen=True):
    """A process sees whether another one is there."""

    zid: str
    other: str


class Report(Item, frozen=True):
    """A process that begins to follow all others is told who is there."""

    zid: str
    watch: int


class Expire(Item, frozen=True):
    """A query of a process has taken its time."""

    zid: str
    number: int


class Lapse(Item, frozen=True):
    """The lease of a process that stands still is over."""

    zid: str
    since: float


class Relink(Item, frozen=True):
    """A process that stood still finds the others again."""

    zid: str


class Boot(Item, frozen=True):
    """A program starts on a machine, perhaps with what another one left to it."""

    machine: str
    handover: tuple[list[Write], int] | None = None
