"""The states of an explored world, and the moves that lead from one to the next."""

from __future__ import annotations

from typing import Any, NamedTuple

from .violation import line_of


class Item(NamedTuple):
    """Something on its way.

    Attributes:
        kind: ``deliver``, ``look``, ``report`` or ``finish``.
        zid: Session of the process that it reaches.
        source: Session that sent it, or of the process to look at; empty if it is its own.
        event: What is delivered.
        number: Number of a watch.
        query: Session and number of the query that it belongs to.
    """

    kind: str
    zid: str
    source: str = ""
    event: Any = None
    number: int = 0
    query: tuple[str, int] | None = None

    @property
    def can_be_lost(self) -> bool:
        """Whether it is a message over a link."""
        return self.kind == "deliver" and bool(self.source)

    @property
    def is_own(self) -> bool:
        """Whether it is what a machine finds out about itself."""
        return self.kind == "deliver" and not self.source


class State(NamedTuple):
    """A state of the world.

    Attributes:
        now: Time in seconds.
        processes: Number of the state of the process of each machine; 0 if none runs.
        lives: Number of processes that each machine has had.
        disks: Number of the disk of each machine without a process.
        ended: Numbers of the last states of processes that ended.
        pending: Numbers of what is on its way, sorted.
        cuts: Links that are cut.
        left: Numbers of the calls that are still to come.
        budget: How many cuts, crashes, losses and early timers are left.
        lossless: Whether no message was lost.
    """

    now: float
    processes: tuple[int, ...]
    lives: tuple[int, ...]
    disks: tuple[int, ...]
    ended: tuple[int, ...]
    pending: tuple[int, ...]
    cuts: frozenset[tuple[str, str]]
    left: tuple[int, ...]
    budget: tuple[int, int, int, int]
    lossless: bool


Told = list[tuple[str, Any]]


class Move(NamedTuple):
    """Something that may be next.

    Attributes:
        kind: ``happen`` or ``lose``: something on its way does, or gets lost; ``call``, ``crash``
            or ``start``: a machine does; ``turn``: a link is cut or mended; ``advance``: the next
            timer fires.
        what: Number of what is on its way, or index of the machine.
        other: Index of the machine at the other end of a link.
    """

    kind: str
    what: int = 0
    other: int = 0


class Draft:
    """A state that is being made.

    Args:
        state: The state before.

    Attributes:
        told: What happened, for a trace.
        added: Numbers of all that was sent on its way.
        judges: Whether to check what answers promise.
        answers: Whether there are answers to check.
    """

    def __init__(self, state: State) -> None:
        self.now = state.now
        self.processes = list(state.processes)
        self.lives = list(state.lives)
        self.disks = list(state.disks)
        self.ended = state.ended
        self.pending = list(state.pending)
        self.cuts = state.cuts
        self.left = state.left
        self.budget = list(state.budget)
        self.lossless = state.lossless
        self.told: Told = []
        self.added: list[int] = []
        self.judges = True
        self.answers = False


def story_of(told: Told) -> str:
    return "\n".join(f"{zid:3} {line_of(what)}" for zid, what in told)
