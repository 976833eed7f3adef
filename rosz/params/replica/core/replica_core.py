"""The core of a replica: events in, effects out."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any, Final

import msgspec

from rosz.errors import RoszError
from rosz.params.history import History
from rosz.params.paths import joined
from rosz.params.replica.core import events
from rosz.params.replica.core.comparisons import APPEARED, Compared, Comparisons
from rosz.params.replica.core.deliveries import DELIVERY, Deliveries
from rosz.params.replica.core.disk import RETRY
from rosz.params.replica.core.effects import (
    Acknowledge,
    Answer,
    DeclareToken,
    Effect,
    Leave,
    ReadStorages,
)
from rosz.params.replica.core.joining import MORE, NEXT, Joining
from rosz.params.replica.core.members import Members, Movement
from rosz.params.replica.core.seeds import Seeding
from rosz.params.replica.core.store import Store
from rosz.params.replica.core.work import Config, Work
from rosz.params.wire import ReplicaMember
from rosz.params.writes import latest_time

_TICK: Final = "tick"
_TICK_SECONDS: Final = 1.0
_STOPPED: Final = 3.0
"""Delay of a tick in seconds that means that the process was stopped, and is not merely slow."""

_COMPARE_EVERY: Final = (10.0, 30.0)
_LISTENERS_COMPARE_EVERY: Final = (5.0, 5.0)
_FORGET_EVERY: Final = 60.0
_FIND: Final = "find"
_FIND_TIMEOUT: Final = 10.0
"""Seconds of the search for replicas; it takes milliseconds, or more while many start at once."""

_CALL: Final = "call"
_WRITER: Final = "writer"
_READER: Final = "reader"


class _Call(msgspec.Struct):
    """A call that waits for others.

    Attributes:
        number: Number of the call.
        compares: Whether it compares with all once they are known.
        open: Sessions that it compares with.
        good: Whether all comparisons so far went well.
    """

    number: int
    compares: bool
    open: set[str]
    good: bool = True


class ReplicaCore:
    """A replica of the parameter store, without threads, clocks, sockets and chance.

    Args:
        config: What the replica is.
    """

    def __init__(self, config: Config) -> None:
        self.config: Config = config
        self._work = work = Work(config)
        self._store = Store(work)
        self._members = Members(work)
        self._seeding = Seeding(work, self._members)
        self._deliveries = Deliveries(work, self._members)
        self._comparisons = Comparisons(work, self._store, self._members)
        self._join_call = 0
        self._joining: Joining | None = None
        self._finding = False
        self._becomes_seed = False
        self._known_at_start: frozenset[str] = frozenset()
        self._calls: dict[int, _Call] = {}
        self._closing: events.CloseCalled | None = None
        self._asked_to_take: set[str] = set()
        self._ticked = self._compare_at = self._forget_at = 0.0
        self._stopped: frozenset[str] = frozenset()
        self._handlers: dict[type[events.Event], Callable[[Any], object]] = {
            events.Loaded: self._store.load,
            events.JoinCalled: self._on_join,
            events.WriteCalled: self._on_write,
            events.FollowCalled: self._on_follow,
            events.CompareCalled: self._on_compare,
            events.CloseCalled: self._on_close,
            events.BatchReceived: self._on_batch,
            events.Acknowledged: self._on_acknowledged,
            events.SyncReceived: self._on_sync,
            events.WritesReceived: self._comparisons.on_writes,
            events.QueryEnded: self._comparisons.on_ended,
            events.SeedCame: self._on_seed,
            events.SeedWent: self._on_seed_went,
            events.MemberCame: self._on_member,
            events.MemberWent: self._on_member_went,
            events.MembersKnown: self._on_members_known,
            events.MemberLeft: self._on_left,
            events.StoppedFound: self._on_stopped,
            events.TimerFired: self._on_timer,
            events.Saved: self._on_saved,
            events.StoragesRead: self._on_storages_read,
        }
        self._timers: dict[str, Callable[[int], object]] = {
            _TICK: self._on_tick,
            _FIND: self._on_find_timer,
            _CALL: self._on_call_timer,
            APPEARED: self._on_appeared_timer,
            DELIVERY: self._deliveries.on_timer,
            MORE: self._on_more_timer,
            NEXT: self._on_next_timer,
            RETRY: self._on_retry_timer,
        }

    @property
    def history(self) -> History:
        """The writes, their tree and digest; not to be changed."""
        return self._store.history

    @property
    def ready(self) -> bool:
        """Whether it has joined the others, and serves them."""
        return self._comparisons.ready

    @property
    def zids(self) -> frozenset[str]:
        """Sessions of the others that are visible."""
        return self._members.zids

    @property
    def is_seed(self) -> bool:
        """Whether it is a seed."""
        return self._seeding.active

    @property
    def is_oldest_seed(self) -> bool:
        """Whether it is the oldest seed."""
        return self._seeding.is_oldest

    @property
    def recovering(self) -> bool:
        """Whether it stood still a moment ago, and waits for those that gave up their links."""
        return self._members.recovering

    def members(self) -> list[ReplicaMember]:
        """Return the others that are visible, oldest first."""
        return self._members.all()

    def seeds(self) -> list[ReplicaMember]:
        """Return the other seeds, oldest first."""
        return self._members.seeds()

    def label(self, zid: str) -> str:
        """Return the process of another replica, as shown to users."""
        return self._members.label(zid)

    def may_defer(self, time: int, wall: int) -> bool:
        """Tell whether a batch of this time is not refused for it, and may be applied later.

        Args:
            time: Time of the stamp of the batch.
            wall: Time of the clock of the machine, in nanoseconds.
        """
        return self._store.history.horizon < time <= latest_time(wall)

    def step(self, event: events.Event, now: events.Moment) -> list[Effect]:
        """Handle an event.

        Args:
            event: What happened.
            now: When; ``seconds`` never goes back.

        Returns:
            What to do, in this order.
        """
        work = self._work
        work.now = now
        if self.ready and now.seconds - self._ticked > _TICK_SECONDS + _STOPPED:
            self._on_woken()
        self._handlers[type(event)](event)
        while self._comparisons.ended:
            self._on_compared(self._comparisons.ended.pop(0))
        effects, work.effects = work.effects, []
        return effects

    # Joining

    def _on_join(self, event: events.JoinCalled) -> None:
        self._join_call = event.call
        self._finding = True
        if self._seeding.prepare():
            self._enter()
        else:
            self._work.later(_FIND_TIMEOUT, _FIND)

    def _enter(self) -> None:
        """Show this replica to the others, and ask them for what they have."""
        if not self._finding:
            return
        self._finding = False
        self._becomes_seed = self._seeding.decide()
        self._known_at_start = self._members.zids
        if not self.config.listens:
            self._work.do(DeclareToken())
        if self._members.zids:
            work, call = self._work, self._join_call
            self._joining = Joining(work, self._members, self._comparisons, call)
            self._joining.query_next()
            self._end_joining()
        elif self.config.listens:
            self._work.do(Answer(self._join_call, False))
        else:
            self._work.do(ReadStorages())

    def _on_storages_read(self, event: events.StoragesRead) -> None:
        if not self.ready:
            self._store.load(events.Loaded(event.writes))
            self._store.disk.save(event.writes)
            self._serve()

    def _end_joining(self) -> None:
        if self._joining is not None and self._joining.done:
            self._joining = None
            self._serve()

    def _serve(self) -> None:
        """Begin to serve others, and to compare with them from time to time."""
        now = self._work.now.seconds
        self._comparisons.ready = True
        self._ticked = now
        self._schedule_comparison()
        self._forget_at = now + _FORGET_EVERY
        self._work.later(_TICK_SECONDS, _TICK)
        if self._becomes_seed:
            self._seeding.become()
        self._work.do(Answer(self._join_call, True))
        for seed in self._members.seeds():
            if seed.zid not in self._known_at_start:
                self._comparisons.start_soon(seed.zid)

    # Calls

    def _on_write(self, event: events.WriteCalled) -> None:
        try:
            writes = self._store.write(event)
        except RoszError as error:
            self._work.do(Answer(event.call, error))
            return
        number = self._deliveries.publish(event, (writes[0].time, writes[0].clock))
        if event.timeout <= 0:
            self._deliveries.await_nobody(number)
            return
        finding = not self._members.follow(_WRITER)
        reason = self._store.disk.wait(number)
        self._deliveries.await_all(
            number, finding=finding, storing=reason is None, reason=reason or ""
        )

    def _on_follow(self, event: events.FollowCalled) -> None:
        self._await_members(_Call(event.call, False, set()), event.timeout)

    def _on_compare(self, event: events.CompareCalled) -> None:
        self._await_members(_Call(event.call, True, set()), event.timeout)

    def _await_members(self, call: _Call, timeout: float) -> None:
        self._calls[call.number] = call
        self._work.later(timeout, _CALL, call.number, call.number)
        if self._members.follow(_READER):
            self._on_all_found(call)

    def _on_all_found(self, call: _Call) -> None:
        if call.compares:
            call.open = set(self._members.zids)
            for zid in sorted(call.open):
                self._comparisons.start(zid, self._deliveries.newest, call.number)
        if not call.open:
            self._end_call(call, good=True)

    def _end_call(self, call: _Call, *, good: bool) -> None:
        if self._calls.pop(call.number, None) is not None:
            self._work.do(Answer(call.number, good))

    # Writes of others, and acknowledgements

    def _on_batch(self, event: events.BatchReceived) -> None:
        reason: str | None = self._store.receive(event.batch, event.reach)
        if event.acknowledged or self.config.listens:
            return
        acknowledgement = Acknowledge(event.sender, event.number, reason or "", event.query)
        if not reason:
            reason = self._store.disk.wait(acknowledgement)
        if reason is not None:
            self._work.do(msgspec.structs.replace(acknowledgement, reason=reason))

    def _on_acknowledged(self, event: events.Acknowledged) -> None:
        if self._deliveries.acknowledge(event):
            self._comparisons.start_soon(event.zid)  # it may lack others
        if self._closing is not None and not self._deliveries.unshared:
            self._leave()

    def _on_saved(self, event: events.Saved) -> None:
        for waiter, reason in self._store.disk.on_saved(event):
            if isinstance(waiter, int):
                self._deliveries.on_stored(waiter, reason)
            else:
                self._work.do(msgspec.structs.replace(waiter, reason=reason))

    def _on_sync(self, event: events.SyncReceived) -> None:
        if event.request.appoints and self.ready:
            self._seeding.become()
        self._comparisons.on_sync(event)

    def _on_compared(self, compared: Compared) -> None:
        self._deliveries.share(compared.shared)
        if compared.waiter == self._join_call and self._joining is not None:
            self._joining.on_compared(compared)
            self._end_joining()
        call = self._calls.get(compared.waiter)
        if call is not None:
            call.open.discard(compared.zid)
            call.good = call.good and compared.good and compared.joined
            if not call.open:
                self._end_call(call, good=call.good)
        if self._closing is not None and compared.waiter == self._closing.call:
            self._hand_over()

    # Other replicas

    def _on_seed(self, event: events.SeedCame) -> None:
        self._note(self._members.set_seed(event.member.zid, event.member))
        if self.ready:
            self._comparisons.start_soon(event.member.zid)

    def _on_seed_went(self, event: events.SeedWent) -> None:
        self._note(self._members.set_seed(event.zid, None))

    def _on_member(self, event: events.MemberCame) -> None:
        if self._members.is_current(event.watch):
            self._note(self._members.set_member(event.member.zid, event.member))

    def _on_member_went(self, event: events.MemberWent) -> None:
        if self._members.is_current(event.watch):
            self._note(self._members.set_member(event.zid, None))

    def _on_members_known(self, event: events.MembersKnown) -> None:
        if not self._members.is_current(event.watch):
            return
        self._note(self._members.set_complete())
        self._deliveries.on_members_known()
        self._enter()
        self._on_more_timer()
        for call in list(self._calls.values()):
            if not call.open:
                self._on_all_found(call)

    def _on_left(self, event: events.MemberLeft) -> None:
        gone = self._members.leave(event.zid, returns=event.returns)
        if gone and event.zid not in self._members.zids:
            self._deliveries.drop([event.zid])

    def _note(self, movement: Movement) -> None:
        """Handle that replicas appeared and disappeared."""
        awaited = self._members.awaited()
        if movement.gone and awaited:
            self._deliveries.expect_absent()
        for zid in movement.gone:
            self._comparisons.forget(zid)
            if zid not in awaited:
                self._deliveries.drop([zid])
        for member, before in movement.came:
            self._deliveries.add(member.zid, before)
            if self.ready and self._members.complete and (before or member < self.config.member):
                self._comparisons.start_soon(member.zid)
        if self._closing is not None:
            self._hand_over()

    def _on_stopped(self, event: events.StoppedFound) -> None:
        self._stopped = event.zids
        self._deliveries.on_stopped(event.zids)
        if self._joining is not None:
            self._joining.on_stopped(event.zids)
            self._end_joining()

    # Time

    def _on_timer(self, event: events.TimerFired) -> None:
        self._timers[event.timer.kind](event.timer.number)

    def _on_call_timer(self, number: int) -> None:
        call = self._calls.get(number)
        if call is not None:
            self._end_call(call, good=False)
        if self._closing is not None and self._closing.call == number:
            self._leave()

    def _on_find_timer(self, _: int) -> None:
        self._enter()

    def _on_appeared_timer(self, _: int) -> None:
        self._comparisons.start_with_appeared(self._deliveries.newest)

    def _on_retry_timer(self, _: int) -> None:
        self._store.disk.on_retry(self._store.history)

    def _on_next_timer(self, number: int) -> None:
        if self._joining is not None:
            self._joining.on_timer(number)
            self._end_joining()

    def _on_more_timer(self, _: int = 0) -> None:
        if self._joining is not None:
            self._joining.on_found()
            self._end_joining()

    def _on_tick(self, _: int) -> None:
        now = self._work.now.seconds
        self._ticked = now
        self._work.later(_TICK_SECONDS, _TICK)
        self._deliveries.drop(self._members.expire())
        for zid in self._seeding.check(self._stopped):
            self._comparisons.start(zid, self._deliveries.newest, appoints=True)
        if now >= self._compare_at:
            self._schedule_comparison()
            self._comparisons.start_with_one(self._deliveries.newest)
        if now >= self._forget_at:
            self._forget_at = now + _FORGET_EVERY
            self._store.forget()

    def _schedule_comparison(self) -> None:
        every = _LISTENERS_COMPARE_EVERY if self.config.listens else _COMPARE_EVERY
        self._compare_at = self._work.now.seconds + self._work.random.uniform(*every)

    def _on_woken(self) -> None:
        """Look for others, who may have given up their links to this process."""
        self._ticked = self._work.now.seconds
        self._members.recover()
        for seed in self._members.seeds():
            self._comparisons.start_soon(seed.zid)

    # The end

    def _on_close(self, event: events.CloseCalled) -> None:
        self._closing = event
        self._store.disk.on_retry(self._store.history)
        self._work.later(event.timeout, _CALL, event.call, event.call)
        self._hand_over()

    def _hand_over(self) -> None:
        """Let another replica have the writes that nobody else has."""
        if self._closing is None:
            return
        unfit = self._asked_to_take | self._deliveries.lagging | self._stopped
        candidates = [member.zid for member in (*self._members.seeds(), *self._members.all())]
        zid = next((zid for zid in candidates if zid not in unfit), "")
        if self._store.disk.is_current or not self._deliveries.unshared:
            self._leave()
        elif zid:
            self._asked_to_take.add(zid)
            self._comparisons.start(zid, self._deliveries.newest, self._closing.call)
        elif not (self._comparisons.any_open or self._members.awaited()):
            self._leave()

    def _leave(self) -> None:
        call, self._closing = self._closing, None
        if call is None:
            return
        unshared, members = self._deliveries.unshared, self._members
        # If all others have ended in the ordinary way, the store ends with the last one.
        unreached = members.zids or members.lost_all
        if unshared and unreached and not self._store.disk.is_current:
            more = f" and {len(unshared) - 1} more" if len(unshared) > 1 else ""
            self._work.log(
                logging.WARNING,
                f"'{joined(unshared[0])}'{more} is lost with this process, which ends: no other"
                " that holds the parameters could be reached",
            )
        self._deliveries.abandon()
        for waiting in list(self._calls.values()):
            self._end_call(waiting, good=False)
        self._work.do(Leave())
        self._work.do(Answer(call.call, True))
