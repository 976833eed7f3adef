"""The periodic work of a replica, and the detection of a process that was stopped."""

from __future__ import annotations

from typing import Final

from rosz.params.replica.core.comparisons import Comparisons
from rosz.params.replica.core.deliveries import Deliveries
from rosz.params.replica.core.members import Members
from rosz.params.replica.core.seeds import Seeding
from rosz.params.replica.core.store import Store
from rosz.params.replica.core.work import Work

TICK: Final = "tick"
_TICK_SECONDS: Final = 1.0
_STOPPED: Final = 3.0
"""Delay of a tick in seconds that means that the process was stopped, and is not merely slow."""

_COMPARE_EVERY: Final = (10.0, 30.0)
_LISTENERS_COMPARE_EVERY: Final = (5.0, 5.0)
_FORGET_EVERY: Final = 60.0


class Upkeep:
    """The periodic work of a replica, from when it has joined.

    Args:
        work: Gives the time of the step, and collects its effects.
        store: The writes of this replica.
        members: The other replicas.
        seeding: Whether this replica is a seed.
        deliveries: The own batches.
        comparisons: The comparisons with the others.
    """

    def __init__(
        self,
        work: Work,
        store: Store,
        members: Members,
        seeding: Seeding,
        deliveries: Deliveries,
        comparisons: Comparisons,
    ) -> None:
        self._work = work
        self._store = store
        self._members = members
        self._seeding = seeding
        self._deliveries = deliveries
        self._comparisons = comparisons
        self._stopped_at = float("inf")
        self._compare_at = self._forget_at = 0.0

    def begin(self) -> None:
        """Begin, when the replica has joined."""
        self._expect_tick()
        self._schedule_comparison()
        self._forget_at = self._work.now.seconds + _FORGET_EVERY
        self._work.later(_TICK_SECONDS, TICK)

    def notice_halt(self, seconds: float) -> None:
        """Look for the others again if this process was stopped: they may have closed their links.

        Args:
            seconds: Time of the step.
        """
        if seconds > self._stopped_at:
            self._expect_tick()
            self._members.recover()
            for seed in self._members.seeds():
                self._comparisons.start_soon(seed.zid)

    def on_tick(self, _: int) -> None:
        """Do what is due."""
        now = self._work.now.seconds
        self._expect_tick()
        self._work.later(_TICK_SECONDS, TICK)
        self._deliveries.drop(self._members.expire())
        for zid in self._seeding.check(self._deliveries.stopped):
            self._comparisons.start(zid, appoints=True)
        if now >= self._compare_at:
            self._schedule_comparison()
            self._comparisons.start_with_one()
        if now >= self._forget_at:
            self._forget_at = now + _FORGET_EVERY
            self._store.forget()

    def _expect_tick(self) -> None:
        self._stopped_at = self._work.now.seconds + _TICK_SECONDS + _STOPPED

    def _schedule_comparison(self) -> None:
        listens = self._work.config.listens
        every = _LISTENERS_COMPARE_EVERY if listens else _COMPARE_EVERY
        self._compare_at = self._work.now.seconds + self._work.random.uniform(*every)
