"""The writes of a replica: which are applied, and which are refused."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from typing import Final

from msgspec import structs

from rosz.errors import DecodeError
from rosz.params.history import History
from rosz.params.paths import ROOT, Path, joined
from rosz.params.replica.core.disk import Disk
from rosz.params.replica.core.effects import TreeChanged
from rosz.params.replica.core.events import Loaded, WriteCalled
from rosz.params.replica.core.work import Work, damage
from rosz.params.tree import Tree
from rosz.params.wire import Batch, check_reach
from rosz.params.writes import Write, check_time, put

NOT_A_PARAMETER: Final = "a replica wrote something that is not a parameter"
_REFUSED: Final = "a write of a replica is refused"
_STORED_AHEAD: Final = "a stored write counts as written just now"


class Store:
    """The history of a replica; it saves each new write, and reports the tree that results.

    Args:
        work: Gives the time of the step, and collects its effects.

    Attributes:
        history: The history.
        disk: The disk.
    """

    def __init__(self, work: Work) -> None:
        self.history: History = History()
        self.disk: Disk = Disk(work)
        self._work = work

    def write(self, call: WriteCalled) -> list[Write]:
        """Apply a batch of this process; return its writes.

        Raises:
            ParamError: The tree cannot hold a change; nothing is changed then.
            DecodeError: The given stamp lies years ahead, or before deletions that are forgotten;
                nothing is changed then.
        """
        stamp = call.stamp if call.given else self._later(call.stamp)
        writes = [put(path, stamp, value, call.origin) for path, value in call.changes]
        if call.given:
            for write in writes:
                check_time(write, self._work.now.wall)
                self._check_horizon(write)
        self._apply(writes, own=True)
        return writes

    def receive(self, batch: Batch, reach: Path) -> str:
        """Apply a batch of another replica; return why it is refused, empty if it is not."""
        try:
            writes = batch.writes()
            check_reach((write.path for write in writes), reach)
        except DecodeError as error:
            self.report(NOT_A_PARAMETER, error)
            return str(error)
        try:
            if writes:  # all of them have the same time
                check_time(writes[0], self._work.now.wall)
            if writes and writes[0].time <= self.history.horizon:
                for write in writes:
                    self._check_horizon(write)
        except DecodeError as error:
            self.report(_REFUSED, error)
            return error.reason
        self._apply(writes)
        return ""

    def add(self, writes: Iterable[Write]) -> None:
        """Add writes of other replicas, except for those stamped years ahead."""
        self._apply(self._sort_out(writes, _REFUSED)[0])

    def merge(self, writes: Iterable[Write], horizon: int) -> None:
        """Merge all writes of another replica, and the horizon below which it forgot deletions.

        Raises:
            DecodeError: The horizon lies years ahead; nothing is changed then.
        """
        check_time(Write(ROOT, horizon, "", {}, "another replica"), self._work.now.wall)
        old = self.history.root
        merge = self.history.merge(self._sort_out(writes, _REFUSED)[0], horizon)
        self._show(old, [*merge.new, *merge.dropped], own=False)
        self.disk.compact(self.history)
        lost = [write for write in merge.dropped if not write.deleted]
        if lost:
            self._work.log(
                logging.WARNING,
                f"'{joined(lost[0].path)}' and {len(lost) - 1} more parameters are dropped: while"
                " this replica was away, others deleted them, or made more deletions than they"
                " remember",
            )

    def load(self, event: Loaded) -> None:
        """Add stored writes; those stamped years ahead get a new stamp."""
        sound, ahead = self._sort_out(event.writes, _STORED_AHEAD)
        old = self.history.root
        self.history.apply(sound)
        self.history.restore(event.horizon)
        for write in sorted(ahead, key=lambda write: write.order):
            time, clock = self._later((self._work.now.wall, self._work.zid))
            self.history.apply([structs.replace(write, time=time, clock=clock)])
        self._show(old, list(self.history.writes()), own=False)
        if ahead or event.changed:
            self.disk.compact(self.history)

    def on_retry(self, _: int = 0) -> None:
        """Try again to save what could not be saved; called by a timer, or at the end."""
        self.disk.on_retry(self.history)

    def forget(self) -> None:
        """Drop the oldest deletions if there are far too many."""
        if self.history.forget(self._work.config.keep):
            self.disk.compact(self.history)

    def report(self, what: str, error: DecodeError) -> None:
        """Log a kind of damage once: senders may repeat it."""
        self._work.do(damage(what, error))

    def _apply(self, writes: list[Write], *, own: bool = False) -> None:
        old = self.history.root
        new = self.history.apply(writes)
        self._show(old, new, own=own)
        self.disk.save(new)

    def _show(self, old: Tree, writes: list[Write], *, own: bool) -> None:
        if writes:
            self._work.do(TreeChanged(old, self.history.root, writes, own))

    def _later(self, stamp: tuple[int, str]) -> tuple[int, str]:
        """Return a stamp that is later than all writes seen."""
        return max(stamp[0], self.history.latest + 1), stamp[1]

    def _check_horizon(self, write: Write) -> None:
        """Raise `DecodeError` for a new write that a forgotten deletion may have removed."""
        history = self.history
        if write.time <= history.horizon and not (history.hides(write) or history.provable(write)):
            raise DecodeError(
                "parameter stamp",
                -1,
                f"'{joined(write.path)}' is older than deletions that are forgotten: set it again",
            )

    def _sort_out(self, writes: Iterable[Write], what: str) -> tuple[list[Write], list[Write]]:
        """Return the writes with a plausible stamp, and those stamped years ahead."""
        sound: list[Write] = []
        ahead: list[Write] = []
        for write in writes:
            try:
                check_time(write, self._work.now.wall)
                sound.append(write)
            except DecodeError as error:
                self.report(what, error)
                ahead.append(write)
        return sound, ahead
