"""The other replicas that a replica knows, by their tokens, and those that it has lost.

A replica follows the tokens of seeds, which are a few of all replicas, whatever their number: it
joins from one of them and compares with them. Seeds follow all replicas, and so does whoever
writes, to know who has to acknowledge that. The tokens of all would cost each replica as much as
there are others.

A replica that leaves says so. One that disappears without that is **absent**: its link is lost, it
was killed, or it stands still. Absent replicas are waited for, for a while, by one that

- has lost all others,
- has itself stood still, so that others gave up their links to it, or
- heard from the absent one that it restarts.

Anybody else does not wait: a program that crashes must not delay those that go on.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import msgspec

from rosz.params.replica.core.effects import FollowAll, SeedsChanged, UnfollowAll
from rosz.params.replica.core.work import Work
from rosz.params.wire import ReplicaMember

RECOVERY: Final = 10.0
"""Seconds in which links that were lost are there again, or the other end is gone for good."""

_MAX_EXPIRED: Final = 100
"""Most absent replicas that are remembered after that; a program may crash repeatedly."""


class _Absence(msgspec.Struct, frozen=True):
    member: ReplicaMember
    until: float
    returns: bool


class Movement(NamedTuple):
    """A change of the set of visible replicas.

    Attributes:
        came: Those that appeared, and the sessions under which each of them was absent.
        gone: Sessions of those that disappeared.
    """

    came: list[tuple[ReplicaMember, list[str]]]
    gone: list[str]


class Members:
    """Other replicas of a domain: the seeds, and all of them as long as somebody needs them.

    Args:
        work: Gives the time of the step, and collects its effects.

    Attributes:
        zids: Sessions of those that are visible; the set is replaced, never changed in place.
        complete: Whether all are followed, and those that existed have been reported.
    """

    def __init__(self, work: Work) -> None:
        self.zids: frozenset[str] = frozenset()
        self.complete: bool = False
        self._work = work
        self._seeds: dict[str, ReplicaMember] = {}
        self._all: dict[str, ReplicaMember] = {}
        self._visible: dict[str, ReplicaMember] = {}
        self._absent: dict[str, _Absence] = {}
        self._left: dict[str, bool] = {}
        self._reasons: set[str] = set()
        self._watch = 0
        self._recovers_until = float("-inf")

    @property
    def lost_all(self) -> bool:
        """Whether nobody is visible, and some disappeared without saying that they leave."""
        return bool(self._absent) and not self._visible

    def follow(self, reason: str) -> bool:
        """Follow all replicas, until `unfollow` for each reason; return whether all are known."""
        if not self._reasons:
            self._watch += 1
            self._work.do(FollowAll(self._watch))
        self._reasons.add(reason)
        return self.complete

    def unfollow(self, reason: str) -> None:
        """Undo `follow` for one reason."""
        if reason in self._reasons:
            self._reasons.discard(reason)
            if not self._reasons:
                self.complete = False
                for zid, member in self._visible.items():
                    if zid not in self._seeds:  # out of sight, but perhaps there
                        self._lose(member)
                self._all = {}
                self._visible = dict(self._seeds)
                self.zids = frozenset(self._visible)
                self._work.do(UnfollowAll())

    def is_current(self, watch: int) -> bool:
        """Tell whether a watch of all replicas is the one that counts."""
        return watch == self._watch and bool(self._reasons)

    def set_seed(self, zid: str, member: ReplicaMember | None) -> Movement:
        """Handle a token of a seed; without a member, it disappeared."""
        self._work.do(SeedsChanged())
        return self._set(self._seeds, zid, member)

    def set_member(self, zid: str, member: ReplicaMember | None) -> Movement:
        """Handle a token of a replica; without a member, it disappeared."""
        return self._set(self._all, zid, member)

    def set_complete(self) -> Movement:
        """Handle that all tokens that existed have been reported."""
        self.complete = True
        return self._difference()

    def leave(self, zid: str, *, returns: bool) -> bool:
        """Handle that a replica said that it leaves; return whether it is not to be waited for."""
        absence = self._absent.get(zid)
        if absence is None:
            if zid in self._visible:
                self._left[zid] = returns
        elif returns:
            self._absent[zid] = msgspec.structs.replace(absence, returns=True)
        else:
            del self._absent[zid]
        return not returns

    def recover(self) -> None:
        """Wait for whoever disappears from now on, since this process stood still."""
        self._recovers_until = self._work.now.seconds + RECOVERY

    @property
    def recovering(self) -> bool:
        """Whether this process stood still a moment ago."""
        return self._work.now.seconds < self._recovers_until

    def awaited(self) -> set[str]:
        """Return the sessions of absent replicas that a write has to wait for."""
        if not self._absent:
            return set()
        now, every = self._work.now.seconds, self.recovering or not self._visible
        return {
            zid
            for zid, absence in self._absent.items()
            if now < absence.until and (every or absence.returns)
        }

    def expire(self) -> list[str]:
        """Return the sessions of those that are not waited for any more."""
        now = self._work.now.seconds
        expired = [zid for zid, absence in self._absent.items() if now >= absence.until]
        for zid in expired[:-_MAX_EXPIRED]:
            del self._absent[zid]
        return expired

    def all(self) -> list[ReplicaMember]:
        """Return the replicas that are visible, oldest first."""
        return sorted(self._visible.values())

    def seeds(self) -> list[ReplicaMember]:
        """Return the seeds, oldest first."""
        return sorted(self._seeds.copy().values())  # other threads call this

    def label(self, zid: str) -> str:
        """Return the process of a replica, as shown to users."""
        if zid in self._absent:
            return f"{self._absent[zid].member.label} (link lost)"
        member = self._visible.get(zid) or self._seeds.get(zid) or self._all.get(zid)
        return member.label if member is not None else f"session {zid}"

    def _set(
        self, members: dict[str, ReplicaMember], zid: str, member: ReplicaMember | None
    ) -> Movement:
        if zid != self._work.zid:
            if member is not None:
                members[zid] = member
            else:
                members.pop(zid, None)
        return self._difference()

    def _difference(self) -> Movement:
        """Compare who is visible with who was, and remember who disappeared."""
        before = self._visible
        self._visible = dict(self._all) if self.complete else self._seeds | self._all
        self.zids = frozenset(self._visible)
        gone = [zid for zid in before if zid not in self._visible]
        for zid in gone:
            self._lose(before[zid])
        came = [
            (member, self._find_again(member))
            for zid, member in self._visible.items()
            if zid not in before
        ]
        return Movement(came, gone)

    def _lose(self, member: ReplicaMember) -> None:
        returns = self._left.pop(member.zid, None)
        if returns is not False:
            until = self._work.now.seconds + RECOVERY
            self._absent[member.zid] = _Absence(member, until, bool(returns))

    def _find_again(self, member: ReplicaMember) -> list[str]:
        """Return the sessions under which a replica that appears was absent."""
        self._left.pop(member.zid, None)
        # A program that restarts has another session, and the same label.
        labels = {zid: absence.member.label for zid, absence in self._absent.items()}
        before = [zid for zid in labels if zid == member.zid or labels[zid] == member.label]
        for zid in before:
            del self._absent[zid]
        return before
