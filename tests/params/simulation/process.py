"""A process with the core of a replica, as the simulation and its checks see it."""

from __future__ import annotations

import enum
from collections.abc import Iterable
from typing import Any, NamedTuple

import msgspec

from rosz.params.paths import Path
from rosz.params.replica.core import Config, ReplicaCore
from rosz.params.replica.core.effects import TreeChanged
from rosz.params.replica.core.events import Event
from rosz.params.replica.watch import _changes_seen
from rosz.params.tree import Tree, lookup
from rosz.params.wire import ReplicaMember
from rosz.params.writes import Order, Write

from .disk import Disk

WALL = 1_795_000_000 * 10**9
WATCHED: tuple[Path, ...] = (("a",), ("a", "b"), ("a", "b", "c"), ("d",))


class State(enum.Enum):
    """What a process does."""

    RUNS = "runs"
    STOPPED = "stopped"
    ENDED = "ended"


class Call(msgspec.Struct):
    """A call that waits for its answer.

    Attributes:
        number: Its number.
        event: What began it.
        deadline: When it must have been answered.
        writes: The writes of the batch, if it writes.
        batch: Number of the batch; 0 if none was sent.
        resent: Sessions that it was sent to once more.
        slept: Whether the process stood still meanwhile.
        awaited: Labels of absent replicas that it has to wait for, and until when.
        known: What each other replica that was reachable had when it began.
    """

    number: int
    event: Event
    deadline: float
    writes: list[Write] = []
    batch: int = 0
    resent: set[str] = set()
    slept: bool = False
    awaited: dict[str, float] = {}
    known: dict[str, dict[Order, Write]] = {}


class Alarm(NamedTuple):
    """A timer that an exploration may let fire."""

    due: float
    kind: str
    number: int


class Process:
    """One life of a program on a machine.

    Args:
        machine: Name of the machine; it names the process as well.
        life: Number of this life of the program.
        config: What its core is.
        disk: Disk with its file, if it has one.
        skew: Error of the clock of the machine in nanoseconds.
    """

    def __init__(
        self, machine: str, life: int, config: Config, disk: Disk | None, skew: int = 0
    ) -> None:
        self.machine = machine
        self.life = life
        self.member: ReplicaMember = config.member
        self.zid: str = config.member.zid
        self.label: str = config.member.label
        self.core = ReplicaCore(config)
        self.disk = disk
        self.skew = skew
        self.drift = 0.0
        self.state = State.RUNS
        self.stopped_at = 0.0
        self.woke_at = float("-inf")
        self.joined = False
        self.token = False
        self.seed = False
        self.watch = 0
        self.watching = False
        self.members: set[str] = set()
        self.seeds: set[str] = set()
        self.lost: dict[str, float] = {}
        self.left: set[str] = set()
        self.met: set[str] = set()
        self.calls: dict[int, Call] = {}
        self.timers: dict[int, int] = {}
        self.mailbox: list[Any] = []
        # What only an exploration needs: timers, the number and time limit of each query, and
        # batches whose acknowledgement waits for the disk.
        self.alarms: dict[Any, Alarm] = {}
        self.queries: dict[int, tuple[int, float]] = {}
        self.received: dict[tuple[str, int], list[Write]] = {}
        # What it holds, held and has lost to newer writes.
        self.held: dict[Order, Write] = {}
        self.ever: dict[Order, Write] = {}
        self.gone: set[Order] = set()
        self.mark: tuple[Tree, int, int] = ({}, 0, 0)
        self.shown: Tree = {}
        self.seen: dict[Path, Any] = {}

    def wall(self, now: float) -> int:
        """Return the time of its clock."""
        return WALL + int(now * (1.0 + self.drift) * 1e9) + self.skew

    @property
    def visible(self) -> set[str]:
        """Sessions that were reported to it, as far as it has to know them."""
        return self.members if self.watching else self.members | self.seeds

    def has(self, writes: Iterable[Write]) -> bool:
        """Tell whether it holds writes, or newer ones in their place, on its disk as well."""
        return all(
            (self.core.history.hides(write) or write.time <= self.core.history.horizon)
            and (self.disk is None or self.disk.holds(write))
            for write in writes
        )

    def applied(self, writes: Iterable[Write]) -> bool:
        """Tell whether it holds writes, or newer ones in their place, in memory."""
        history = self.core.history
        return all(history.hides(write) or write.time <= history.horizon for write in writes)

    def end(self) -> None:
        """Let nothing be left of it but its disk."""
        self.state = State.ENDED
        if self.disk is not None and self.disk.pending:
            self.disk.finish(len(self.disk.pending))
        self.token = self.seed = False

    def show(self, effect: TreeChanged) -> None:
        """Tell the watchers of some paths a change, as `rosz.params.replica.watch` does."""
        for path in WATCHED:
            if any(_changes_seen(path, effect)):
                self.seen[path] = lookup(effect.new, path)
        self.shown = effect.new
