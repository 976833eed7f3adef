"""The batches of a replica, and the acknowledgements that tell who has them.

A batch is delivered when every replica that it waits for has acknowledged it, and the own disk has
it. It waits for all that are visible and for the absent ones that `Members.awaited` names. One that
has not acknowledged it after a moment is sent it once more, as a query to it alone. One that still
does not answer in time is lagging: no batch waits for it until it answers again, but each names it.
One that refuses the batch, or cannot store it, acknowledges it with the reason. Whatever becomes of
it, a batch is never undone: others may have acknowledged writes that build on it.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable
from collections.abc import Set as AbstractSet
from typing import Final

from rosz.errors import ParamError, PartlyWritten
from rosz.params.paths import Path, joined
from rosz.params.replica.core.effects import Answer, FindStopped, Outcome, Publish, Resend
from rosz.params.replica.core.events import Acknowledged, WriteCalled
from rosz.params.replica.core.members import Members
from rosz.params.replica.core.work import Work
from rosz.params.wire import Batch

DELIVERY: Final = "delivery"
_RESEND_AFTER: Final = 0.25
_MAX_UNSHARED: Final = 10_000
"""Own batches that are remembered because nobody else is known to have them."""

_ALONE: Final = (
    "only this process has '%s': the links to all others are lost; they get it when they are back"
)
_UNFOUND: Final = "others that were not found in time"


class _OpenBatch:
    """One batch that is not yet delivered."""

    def __init__(self, number: int, call: WriteCalled, batch: Batch, now: float) -> None:
        self.number = number
        self.call = call.call
        self.batch = batch
        self.paths = [path for path, _ in call.changes]
        self.began = now
        self.deadline = now + call.timeout
        self.waiting: set[str] = set()
        self.skipped: set[str] = set()
        self.holders: set[str] = set()
        self.reasons: dict[str, str] = {}
        self.finding = False
        self.storing = False
        self.is_late = False
        self.resent: set[str] = set()

    @property
    def done(self) -> bool:
        return not (self.waiting or self.finding or self.storing)


class Deliveries:
    """All batches of a replica that are not yet delivered.

    Args:
        work: The step.
        members: The other replicas.

    Attributes:
        newest: Number of the newest batch.
    """

    def __init__(self, work: Work, members: Members) -> None:
        self.newest: int = 0
        self._work = work
        self._members = members
        self._open: dict[int, _OpenBatch] = {}
        self._lagging: set[str] = set()
        self._stopped: frozenset[str] = frozenset()
        self._unshared: dict[int, list[Path]] = {}
        self._told_alone = False

    def publish(self, call: WriteCalled, stamp: tuple[int, str]) -> int:
        """Send a batch to all; return its number."""
        self.newest += 1
        batch = Batch.of(stamp, call.origin, call.changes)
        now = self._work.now.seconds
        delivery = _OpenBatch(self.newest, call, batch, now)
        self._work.do(Publish(self.newest, batch, delivery.paths, bool(self._lagging)))
        self._unshared[self.newest] = delivery.paths
        if len(self._unshared) > _MAX_UNSHARED:
            del self._unshared[next(iter(self._unshared))]
        self._open[self.newest] = delivery
        return self.newest

    def await_all(self, number: int, *, finding: bool, storing: bool, reason: str) -> None:
        """Begin to wait for a batch that was sent.

        Args:
            number: Number of the batch.
            finding: Whether not all others are known yet.
            storing: Whether the own disk does not have it yet.
            reason: Why the own disk cannot store it.
        """
        delivery = self._open[number]
        delivery.finding, delivery.storing = finding, storing
        if reason:
            delivery.reasons[self._work.zid] = reason
        self._expect(delivery, self._members.zids | self._members.awaited())
        timeout = delivery.deadline - self._work.now.seconds
        if not self._end_if_done(delivery):
            self._work.later(min(_RESEND_AFTER, timeout), DELIVERY, number, delivery.call)

    def await_nobody(self, number: int) -> None:
        """Return from a call that does not wait."""
        delivery = self._open.pop(number)
        self._work.do(Answer(delivery.call, Outcome(delivery.batch.time)))

    def on_members_known(self) -> None:
        """Wait for all others, which are known now."""
        for delivery in list(self._open.values()):
            if delivery.finding:
                delivery.finding = False
                self._expect(delivery, self._members.zids | self._members.awaited())
                if not self._end_if_done(delivery) and delivery.is_late:
                    self._work.do(FindStopped())

    def acknowledge(self, event: Acknowledged) -> bool:
        """Handle an acknowledgement; return whether it is the first of a replica that lagged."""
        returned = event.zid in self._lagging
        self._lagging.discard(event.zid)
        self._stopped -= {event.zid}
        if not event.reason:
            self._unshared.pop(event.number, None)
        if returned:
            self._await_returned(event.zid, event.number)
        delivery = self._open.get(event.number)
        if delivery is not None:
            if event.reason:
                delivery.reasons[event.zid] = event.reason
            else:
                delivery.holders.add(event.zid)
                delivery.reasons.pop(event.zid, None)
            delivery.waiting.discard(event.zid)
            delivery.skipped.discard(event.zid)
            self._end_if_done(delivery)
        return returned

    def on_stored(self, number: int, reason: str) -> None:
        """Handle that the own disk has a batch, or cannot store it."""
        delivery = self._open.get(number)
        if delivery is not None:
            delivery.storing = False
            if reason:
                delivery.reasons[self._work.zid] = reason
            self._end_if_done(delivery)

    def add(self, zid: str, before: str) -> None:
        """Wait for a replica that appears, which may have missed what is under way.

        Args:
            zid: Its session.
            before: Session under which it was absent; empty if it was not.
        """
        self._lagging.discard(before)
        self._told_alone = False
        for delivery in self._open.values():
            delivery.waiting.discard(before)
            if not delivery.finding and zid not in delivery.holders:
                delivery.waiting.add(zid)
                self._resend(delivery, [zid])

    def expect_absent(self) -> None:
        """Wait for absent replicas as well, if they are to be waited for since others went."""
        for delivery in self._open.values():
            if not delivery.finding:
                self._expect(delivery, self._members.awaited())
                if delivery.is_late and delivery.waiting - delivery.resent:
                    self._work.do(FindStopped())

    def drop(self, zids: Iterable[str]) -> None:
        """Stop waiting for replicas that are gone."""
        for zid in zids:
            self._lagging.discard(zid)
            for delivery in list(self._open.values()):
                if zid in delivery.waiting:
                    delivery.waiting.discard(zid)
                    self._end_if_done(delivery)

    def on_timer(self, number: int) -> None:
        """Send a batch once more, or stop waiting for it."""
        delivery = self._open.get(number)
        if delivery is None:
            return
        remaining = delivery.deadline - self._work.now.seconds
        if remaining <= 0:
            self._end(delivery)
            return
        self._work.later(remaining, DELIVERY, number, delivery.call)
        delivery.is_late = True
        if delivery.waiting:
            self._work.do(FindStopped())

    def on_stopped(self, zids: frozenset[str]) -> None:
        """Send batches once more to those that are not stopped; the others get them later."""
        self._stopped = zids
        for delivery in self._open.values():
            if delivery.is_late:
                self._resend(delivery, sorted(delivery.waiting - delivery.resent - zids))

    def share(self, number: int) -> None:
        """Note that another replica has all batches up to a number."""
        for shared in [shared for shared in self._unshared if shared <= number]:
            del self._unshared[shared]

    @property
    def unshared(self) -> list[Path]:
        """The paths of own batches that nobody else is known to have."""
        return [path for paths in self._unshared.values() for path in paths]

    @property
    def lagging(self) -> frozenset[str]:
        """The sessions of replicas that no batch waits for."""
        return frozenset(self._lagging)

    def abandon(self) -> None:
        """Stop waiting for everybody, since the replica ends."""
        for delivery in list(self._open.values()):
            self._end(delivery)

    def _expect(self, delivery: _OpenBatch, zids: AbstractSet[str]) -> None:
        expected = zids - delivery.holders - delivery.reasons.keys()
        delivery.skipped |= expected & self._lagging
        delivery.waiting |= expected - self._lagging

    def _await_returned(self, zid: str, number: int) -> None:
        """Wait for a replica that lagged, for all batches but the one that it acknowledges now."""
        for delivery in self._open.values():
            if zid in delivery.skipped and delivery.number != number:
                delivery.skipped.discard(zid)
                delivery.waiting.add(zid)
                self._resend(delivery, [zid])

    def _resend(self, delivery: _OpenBatch, zids: list[str]) -> None:
        timeout = delivery.deadline - self._work.now.seconds
        if zids and timeout > 0:
            delivery.resent.update(zids)
            number, batch, paths = delivery.number, delivery.batch, delivery.paths
            self._work.do(Resend(tuple(zids), number, batch, paths, timeout))

    def _end_if_done(self, delivery: _OpenBatch) -> bool:
        if delivery.done:
            self._end(delivery)
        return delivery.done

    def _end(self, delivery: _OpenBatch) -> None:
        """Tell the caller how far a batch got."""
        del self._open[delivery.number]
        late = self._labels(delivery.waiting)
        name = joined(delivery.paths[0])
        more = f" and {len(delivery.paths) - 1} more" if len(delivery.paths) > 1 else ""
        if delivery.waiting:
            seconds = self._work.now.seconds - delivery.began
            self._work.log(
                logging.WARNING,
                f"'{name}'{more} is written, but not yet known to {', '.join(late)}, which did not"
                f" answer within {seconds:.2g} s",
            )
        self._lagging |= delivery.waiting
        known = self._members.zids | self._members.awaited()
        slow = [*late, *self._labels(delivery.skipped & known)]
        if delivery.finding:
            slow.append(_UNFOUND)
        if delivery.storing:
            slow.append(f"the file of {self._work.config.member.label}")
        holders = len(delivery.holders)
        result: Outcome | ParamError
        if delivery.reasons:
            reasons = {self._label(zid): why for zid, why in delivery.reasons.items()}
            result = PartlyWritten(f"'{name}'{more}", holders, reasons, tuple(slow))
        else:
            alone = not (holders or self._members.zids or delivery.finding)
            result = Outcome(delivery.batch.time, tuple(slow), holders, alone)
            if alone and self._members.lost_all and not self._told_alone:
                self._told_alone = True
                self._work.log(logging.WARNING, _ALONE % name)
        self._work.do(Answer(delivery.call, result))

    def _labels(self, zids: Iterable[str]) -> list[str]:
        return sorted(self._label(zid) + " (stopped)" * (zid in self._stopped) for zid in zids)

    def _label(self, zid: str) -> str:
        own = self._work.config.member
        return own.label if zid == own.zid else self._members.label(zid)
