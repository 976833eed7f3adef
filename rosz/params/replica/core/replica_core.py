"""The core of a replica: events in, effects out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import msgspec

from rosz.errors import RoszError
from rosz.params.history import History
from rosz.params.replica.core import events
from rosz.params.replica.core.calls import CALL, Calls
from rosz.params.replica.core.comparisons import APPEARED, Compared, Comparisons
from rosz.params.replica.core.deliveries import DELIVERY, Deliveries
from rosz.params.replica.core.disk import RETRY
from rosz.params.replica.core.effects import Acknowledge, Answer, Effect
from rosz.params.replica.core.ending import Ending
from rosz.params.replica.core.joining import FIND, MORE, NEXT, Joining
from rosz.params.replica.core.members import Members, Movement
from rosz.params.replica.core.seeds import Seeding
from rosz.params.replica.core.store import Store
from rosz.params.replica.core.upkeep import TICK, Upkeep
from rosz.params.replica.core.work import Config, Work
from rosz.params.wire import ReplicaMember
from rosz.params.writes import latest_time

_WRITER: Final = "writer"


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
        store, members, seeding = self._store, self._members, self._seeding
        self._deliveries = deliveries = Deliveries(work, members)
        self._comparisons = comparisons = Comparisons(work, store, members, deliveries)
        self._joining = Joining(work, store, members, seeding, comparisons)
        self._calls = Calls(work, members, comparisons)
        self._ending = Ending(work, store, members, deliveries, comparisons, self._calls)
        self._upkeep = Upkeep(work, store, members, seeding, deliveries, comparisons)
        self._handlers: dict[type[events.Event], Callable[[Any], object]] = {
            events.Loaded: store.load,
            events.JoinCalled: self._joining.begin,
            events.StoragesRead: self._joining.on_storages_read,
            events.WriteCalled: self._on_write,
            events.FollowCalled: self._calls.begin,
            events.CompareCalled: self._calls.begin,
            events.CloseCalled: self._ending.begin,
            events.BatchReceived: self._on_batch,
            events.Acknowledged: self._on_acknowledged,
            events.Progressed: deliveries.on_progress,
            events.SyncReceived: self._on_sync,
            events.WritesReceived: comparisons.on_writes,
            events.QueryEnded: comparisons.on_ended,
            events.SeedCame: self._on_seed,
            events.SeedWent: self._on_seed,
            events.MemberCame: self._on_member,
            events.MemberWent: self._on_member,
            events.MembersKnown: self._on_members_known,
            events.MemberLeft: self._on_left,
            events.StoppedPeersFound: self._on_peers_stopped,
            events.TimerFired: self._on_timer,
            events.Saved: self._on_saved,
        }
        self._timers: dict[str, Callable[[int], object]] = {
            FIND: self._joining.enter,
            NEXT: self._joining.on_timer,
            MORE: self._joining.on_search_ended,
            TICK: self._upkeep.on_tick,
            CALL: self._on_call_timer,
            APPEARED: comparisons.start_with_appeared,
            DELIVERY: deliveries.on_timer,
            RETRY: store.on_retry,
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

    def members(self) -> list[ReplicaMember]:
        """Return the others that are visible, oldest first."""
        return self._members.all()

    def seeds(self) -> list[ReplicaMember]:
        """Return the other seeds, oldest first."""
        return self._members.seeds()

    def progress(self, stamp: tuple[int, str]) -> tuple[int, list[str]]:
        """Tell how far a batch of this process is; any thread may call this.

        Args:
            stamp: Time and clock of the batch.

        Returns:
            Number of other replicas that have it, and those that it waits for, as shown to users.
        """
        return self._deliveries.progress(stamp)

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
        self._upkeep.notice_halt(now.seconds)
        self._handlers[type(event)](event)
        while self._comparisons.ended:
            self._on_compared(self._comparisons.ended.pop(0))
        if self._joining.done and not self._comparisons.ready:
            self._serve()
        effects, work.effects = work.effects, []
        return effects

    def _serve(self) -> None:
        """Begin to serve others, and to compare with them from time to time."""
        self._comparisons.ready = True
        self._upkeep.begin()
        if self._joining.becomes_seed:
            self._seeding.become()
        self._work.do(Answer(self._joining.call, True))
        for seed in self._members.seeds():
            if seed.zid not in self._joining.known_at_start:
                self._comparisons.start_soon(seed.zid)

    # Writes of this process

    def _on_write(self, event: events.WriteCalled) -> None:
        try:
            writes = self._store.write(event)
        except RoszError as error:
            self._work.do(Answer(event.call, error))
            return
        number = self._deliveries.publish(event, (writes[0].time, writes[0].clock))
        if event.timeout > 0:
            all_known = self._members.follow(_WRITER)
            self._deliveries.await_all(number, all_known, self._store.disk.wait(number))
        else:
            self._deliveries.await_nobody(number)

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
        self._ending.on_acknowledged()

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
        self._joining.on_compared(compared)
        self._calls.on_compared(compared)
        self._ending.on_compared(compared)

    # Other replicas

    def _on_seed(self, event: events.SeedCame | events.SeedWent) -> None:
        if isinstance(event, events.SeedWent):
            self._note(self._members.set_seed(event.zid, None))
            return
        self._note(self._members.set_seed(event.member.zid, event.member))
        if self.ready:
            self._comparisons.start_soon(event.member.zid)

    def _on_member(self, event: events.MemberCame | events.MemberWent) -> None:
        if not self._members.is_current(event.watch):
            return
        if isinstance(event, events.MemberCame):
            self._note(self._members.set_member(event.member.zid, event.member))
        else:
            self._note(self._members.set_member(event.zid, None))

    def _on_members_known(self, event: events.MembersKnown) -> None:
        if not self._members.is_current(event.watch):
            return
        self._note(self._members.set_complete())
        self._deliveries.on_members_known()
        self._joining.enter()
        self._joining.on_search_ended()
        self._calls.on_members_known()

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
        self._ending.hand_over()

    def _on_peers_stopped(self, event: events.StoppedPeersFound) -> None:
        self._deliveries.on_peers_stopped(event.zids)
        self._joining.on_peers_stopped(event.zids)

    def _on_timer(self, event: events.TimerFired) -> None:
        self._timers[event.timer.kind](event.timer.number)

    def _on_call_timer(self, number: int) -> None:
        self._calls.end(number, good=False)
        self._ending.on_timer(number)
