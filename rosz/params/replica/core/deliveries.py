"""The batches of a replica, and the acknowledgements that tell who has them.

A batch is delivered when every replica that it waits for has acknowledged it, and the own disk has
it. It waits for all that are visible and for the absent ones that `Members.awaited` names. One that
has not acknowledged it after a moment, and has not reported that it works on it, gets it once more,
as a query to it alone. One that still does not answer in time is lagging: no batch waits for it
until it answers again, but each names it. One that refuses the batch, or cannot store it,
acknowledges it with the reason. Whatever becomes of it, a batch is never undone: others may have
acknowledged writes that build on it.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable
from collections.abc import Set as AbstractSet
from typing import Final

from rosz.errors import ParamError, PartlyWritten
from rosz.params.paths import Path, joined
from rosz.params.replica.core.effects import Answer, FindStoppedPeers, Outcome, Publish, Resend
from rosz.params.replica.core.events import Acknowledged, Progressed, WriteCalled
from rosz.params.replica.core.members import Members
from rosz.params.replica.core.work import Work, named
from rosz.params.wire import Batch

DELIVERY: Final = "delivery"
_RESEND_AFTER: Final = 0.25
_ROUNDING: Final = 1e-6
"""Seconds that a timer may fire early by rounding; one for what is left would fire at once."""
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
        self.by_progress = call.by_progress
        self.timeout = call.timeout
        self.progressed = now
        self.waiting: set[str] = set()
        self.skipped: set[str] = set()
        self.holders: set[str] = set()
        self.reasons: dict[str, str] = {}
        self.finding = False
        self.storing = False
        self.is_late = False
        self.resent: set[str] = set()

    @property
    def deadline(self) -> float:
        return (self.progressed if self.by_progress else self.began) + self.timeout

    @property
    def done(self) -> bool:
        return not (self.waiting or self.finding or self.storing)


class Deliveries:
    """All batches of a replica that are not yet delivered.

    Args:
        work: Gives the time of the step, and collects its effects.
        members: The other replicas.

    Attributes:
        newest: Number of the newest batch.
        stopped: Sessions of replicas on this machine whose processes are stopped.
    """

    def __init__(self, work: Work, members: Members) -> None:
        self.newest: int = 0
        self.stopped: frozenset[str] = frozenset()
        self._work = work
        self._members = members
        self._open: dict[int, _OpenBatch] = {}
        self._lagging: set[str] = set()
        self._unshared: dict[int, tuple[list[Path], tuple[int, str]]] = {}
        self._told_alone = False

    def publish(self, call: WriteCalled, stamp: tuple[int, str]) -> int:
        """Send a batch to all; return its number."""
        self.newest += 1
        batch = Batch.of(stamp, call.origin, call.changes)
        now = self._work.now.seconds
        delivery = _OpenBatch(self.newest, call, batch, now)
        self._work.do(Publish(self.newest, batch, delivery.paths, bool(self._lagging)))
        self._unshared[self.newest] = delivery.paths, stamp
        if len(self._unshared) > _MAX_UNSHARED:
            del self._unshared[next(iter(self._unshared))]
        self._open[self.newest] = delivery
        return self.newest

    def await_all(self, number: int, all_known: bool, reason: str | None) -> None:
        """Begin to wait for a batch that was sent.

        Args:
            number: Number of the batch.
            all_known: Whether all others are known.
            reason: What `Disk.wait` returns for it.
        """
        delivery = self._open[number]
        delivery.finding, delivery.storing = not all_known, reason is None
        if reason:
            delivery.reasons[self._work.zid] = reason
        self._expect(delivery, self._members.zids | self._members.awaited())
        if not self._end_if_done(delivery):
            self._work.later(min(_RESEND_AFTER, delivery.timeout), DELIVERY, number, delivery.call)

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
                    self._work.do(FindStoppedPeers())

    def acknowledge(self, event: Acknowledged) -> bool:
        """Handle an acknowledgement; return whether it is the first of a replica that lagged."""
        returned = event.zid in self._lagging
        if event.zid in self.stopped:
            self.stopped -= {event.zid}
        if not event.reason:
            self._unshared.pop(event.number, None)
        if returned:
            self._lagging.discard(event.zid)
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
            if delivery.by_progress:
                delivery.progressed = self._work.now.seconds
            self._end_if_done(delivery)
        return returned

    def on_progress(self, event: Progressed) -> None:
        """Handle progress of a batch; a replica that works on it does not get it once more."""
        delivery = self._open.get(event.number)
        if delivery is not None:
            delivery.progressed = self._work.now.seconds
            if event.zid:
                delivery.resent.add(event.zid)

    def progress(self, stamp: tuple[int, str]) -> tuple[int, list[str]]:
        """Return the number of replicas that have a batch, and the labels of those it waits for."""
        for delivery in list(self._open.values()):
            if (delivery.batch.time, delivery.batch.clock) == stamp:
                return len(delivery.holders), self._labels(delivery.waiting.copy())
        return 0, []

    def on_stored(self, number: int, reason: str) -> None:
        """Handle that the own disk has a batch, or cannot store it."""
        delivery = self._open.get(number)
        if delivery is not None:
            delivery.storing = False
            if reason:
                delivery.reasons[self._work.zid] = reason
            self._end_if_done(delivery)

    def add(self, zid: str, before: list[str]) -> None:
        """Wait for a replica that appears, which may have missed what is under way.

        Args:
            zid: Its session.
            before: Sessions under which it was absent.
        """
        self._lagging.difference_update(before)
        self._told_alone = False
        for delivery in self._open.values():
            delivery.waiting.difference_update(before)
            if not delivery.finding and zid not in delivery.holders:
                delivery.waiting.add(zid)
                self._resend(delivery, [zid])

    def expect_absent(self) -> None:
        """Wait for absent replicas as well, if they are to be waited for since others went."""
        for delivery in self._open.values():
            if not delivery.finding:
                self._expect(delivery, self._members.awaited())
                if delivery.is_late and delivery.waiting - delivery.resent:
                    self._work.do(FindStoppedPeers())

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
        now = self._work.now.seconds
        remaining = delivery.deadline - now
        wait = delivery.progressed + _RESEND_AFTER - now
        if delivery.by_progress and delivery.storing:
            remaining = max(remaining, _RESEND_AFTER)
        if remaining < _ROUNDING:
            self._end(delivery)
        elif wait >= _ROUNDING:
            self._work.later(min(remaining, wait), DELIVERY, number, delivery.call)
        else:
            self._work.later(remaining, DELIVERY, number, delivery.call)
            delivery.is_late = True
            if delivery.waiting:
                self._work.do(FindStoppedPeers())

    def on_peers_stopped(self, zids: frozenset[str]) -> None:
        """Send batches once more to those that are not stopped; the others get them later."""
        self.stopped = zids
        for delivery in self._open.values():
            if delivery.is_late:
                self._resend(delivery, sorted(delivery.waiting - delivery.resent - zids))

    def share(self, number: int) -> None:
        """Note that another replica has all batches up to a number."""
        self._unshared = {own: sent for own, sent in self._unshared.items() if own > number}

    @property
    def unshared(self) -> list[tuple[Path, tuple[int, str]]]:
        """The paths and stamps of own batches that nobody else is known to have."""
        return [(path, stamp) for paths, stamp in self._unshared.values() for path in paths]

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
        if self._lagging:
            delivery.skipped |= expected & self._lagging
            expected -= self._lagging
        delivery.waiting |= expected

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
        slow = self._name_slow(delivery) if delivery.skipped or not delivery.done else ()
        holders = len(delivery.holders)
        result: Outcome | ParamError
        if delivery.reasons:
            reasons = {self._label(zid): why for zid, why in delivery.reasons.items()}
            result = PartlyWritten(named(delivery.paths), holders, reasons, slow)
        else:
            alone = not (holders or self._members.zids or delivery.finding)
            result = Outcome(delivery.batch.time, slow, holders, alone)
            if alone and self._members.lost_all and not self._told_alone:
                self._told_alone = True
                self._work.log(logging.WARNING, _ALONE % joined(delivery.paths[0]))
        self._work.do(Answer(delivery.call, result))

    def _name_slow(self, delivery: _OpenBatch) -> tuple[str, ...]:
        """Return the labels of replicas that are late; no batch waits for them from now on."""
        late = self._labels(delivery.waiting)
        if late:
            seconds = self._work.now.seconds - delivery.began
            self._work.log(
                logging.WARNING,
                f"{named(delivery.paths)} is written, but not yet known to {', '.join(late)}, which"
                f" did not answer within {seconds:.2g} s",
            )
        self._lagging |= delivery.waiting
        known = self._members.zids | self._members.awaited()
        slow = [*late, *self._labels(delivery.skipped & known - delivery.waiting)]
        if delivery.finding:
            slow.append(_UNFOUND)
        if delivery.storing:
            slow.append(f"the file of {self._work.config.member.label}")
        return tuple(slow)

    def _labels(self, zids: Iterable[str]) -> list[str]:
        return sorted(self._label(zid) + " (stopped)" * (zid in self.stopped) for zid in zids)

    def _label(self, zid: str) -> str:
        own = self._work.config.member
        return own.label if zid == own.zid else self._members.label(zid)
