"""Which replicas are seeds: a few that follow all others, so that others need not."""

from __future__ import annotations

from typing import Final

from rosz.params.replica.core.effects import DeclareSeed, SeedsChanged, UndeclareSeed
from rosz.params.replica.core.members import Members
from rosz.params.replica.core.work import Work

SEEDS: Final = 3
"""Seeds that there should be."""

_FOLLOWING: Final = "seed"
_CHANCE: Final = 0.02
"""Chance that a replica becomes a seed in a second, if there is none; it grows each second."""

_GROWTH: Final = 4
_APPOINT_EVERY: Final = 10.0
"""Seconds in which a replica that was appointed becomes a seed, and all others are told."""


class Seeding:
    """Whether this replica is a seed, and who else has to be.

    Args:
        work: Gives the time of the step, and collects its effects.
        members: The other replicas.

    Attributes:
        active: Whether this replica is a seed.
    """

    def __init__(self, work: Work, members: Members) -> None:
        self.active: bool = False
        self._work = work
        self._members = members
        self._chance = _CHANCE
        self._appoint_at = 0.0

    @property
    def is_oldest(self) -> bool:
        """Whether this replica is the oldest seed."""
        own = self._work.config.member
        return self.active and all(own < seed for seed in self._members.seeds())

    def prepare(self) -> bool:
        """Look for all others before this replica joins, if it may have to be a seed.

        Returns:
            Whether nothing has to be found any more.
        """
        # Where rules may keep some replicas apart from others, all are seeds.
        if self._work.config.scoped or not self._members.seeds():
            return self._members.follow(_FOLLOWING)
        return True

    def decide(self) -> bool:
        """Return whether this replica becomes a seed when it has joined."""
        if self._work.config.scoped or not self._members.seeds():
            return True
        self._members.unfollow(_FOLLOWING)
        return False

    def become(self) -> None:
        """Become a seed."""
        if not self.active and not self._work.config.listens:
            self.active = True
            self._members.follow(_FOLLOWING)
            self._work.do(DeclareSeed())
            self._work.do(SeedsChanged())

    def check(self, unfit: frozenset[str]) -> list[str]:
        """Be a seed if there is none, and none any more if there are too many.

        Args:
            unfit: Sessions that cannot be seeds.

        Returns:
            Sessions of those that have to become seeds.
        """
        seeds = self._members.seeds()
        own = self._work.config.member
        if self.active:
            if not self._work.config.scoped and sum(seed < own for seed in seeds) >= SEEDS:
                self.active = False
                self._work.do(UndeclareSeed())
                self._work.do(SeedsChanged())
                self._members.unfollow(_FOLLOWING)
            elif len(seeds) < SEEDS - 1 and self.is_oldest:
                return self._appoint(SEEDS - 1 - len(seeds), unfit)
        elif seeds:
            self._chance = _CHANCE
        elif self._work.random.random() < self._chance:
            self.become()
        else:
            self._chance = min(1.0, self._chance * _GROWTH)
        return []

    def _appoint(self, count: int, unfit: frozenset[str]) -> list[str]:
        """Choose others: all see that there are too few, and not who else becomes one."""
        now = self._work.now.seconds
        others = sorted(self._members.zids - {seed.zid for seed in self._members.seeds()} - unfit)
        if now < self._appoint_at or not others:
            return []
        self._appoint_at = now + _APPOINT_EVERY
        return self._work.random.sample(others, min(count, len(others)))
