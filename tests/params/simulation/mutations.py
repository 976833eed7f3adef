"""Deliberate faults of the core; each is a function that puts one in by patching."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import msgspec
import pytest

from rosz.params.history import History
from rosz.params.replica.core import deliveries as deliveries_module
from rosz.params.replica.core import effects as done
from rosz.params.replica.core import events as said
from rosz.params.replica.core.comparisons import Comparisons
from rosz.params.replica.core.deliveries import Deliveries
from rosz.params.replica.core.disk import Disk
from rosz.params.replica.core.joining import Joining
from rosz.params.replica.core.members import Members
from rosz.params.replica.core.store import Store
from rosz.params.replica.core.work import Work
from rosz.params.writes import DELETED

from .violation import Violation

Patch = pytest.MonkeyPatch
Mutation = Callable[[Patch], None]


def nothing(*_: Any, **__: Any) -> Any:
    """Do nothing."""


# The disk


def acknowledges_before_the_disk(patch: Patch) -> None:
    wait = Disk.wait

    def mutant(disk: Disk, waiter: Any) -> str | None:
        return wait(disk, waiter) if isinstance(waiter, int) else ""

    patch.setattr(Disk, "wait", mutant)


def answers_before_the_own_disk(patch: Patch) -> None:
    wait = Disk.wait

    def mutant(disk: Disk, waiter: Any) -> str | None:
        return "" if isinstance(waiter, int) else wait(disk, waiter)

    patch.setattr(Disk, "wait", mutant)


def forgets_what_a_full_disk_refused(patch: Patch) -> None:
    patch.setattr(Disk, "_keep", nothing)


def compacts_without_the_newest_write(patch: Patch) -> None:
    compact = Disk.compact

    def mutant(disk: Disk, history: History) -> None:
        compact(disk, history)
        effects = disk._work.effects
        if effects and isinstance(effects[-1], done.Compact):
            writes = sorted(effects[-1].writes, key=lambda write: write.order)[:-1]
            effects[-1] = msgspec.structs.replace(effects[-1], writes=writes)

    patch.setattr(Disk, "compact", mutant)


def takes_any_end_of_a_save_for_success(patch: Patch) -> None:
    on_saved = Disk.on_saved

    def mutant(disk: Disk, event: said.Saved) -> Any:
        return on_saved(disk, msgspec.structs.replace(event, reason=""))

    patch.setattr(Disk, "on_saved", mutant)


# The writes


def takes_a_part_of_a_batch(patch: Patch) -> None:
    receive = Store.receive

    def mutant(store: Store, batch: Any, reach: Any) -> str:
        return receive(store, msgspec.structs.replace(batch, puts=batch.puts[:1]), reach)

    patch.setattr(Store, "receive", mutant)


def acknowledges_what_it_refuses(patch: Patch) -> None:
    receive = Store.receive

    def mutant(store: Store, batch: Any, reach: Any) -> str:
        receive(store, batch, reach)
        return ""

    patch.setattr(Store, "receive", mutant)


def undoes_what_is_not_kept_everywhere(patch: Patch) -> None:
    end, make = Deliveries._end, Store.__init__

    def mutant_make(store: Store, work: Any) -> None:
        make(store, work)
        work.store = store

    def mutant(deliveries: Deliveries, delivery: Any) -> None:
        end(deliveries, delivery)
        if delivery.reasons:
            store = deliveries._work.store  # type: ignore[attr-defined]
            old, fresh = store.history.root, History()
            stamp = delivery.batch.time, delivery.batch.clock
            writes = list(store.history.writes())
            fresh.apply([write for write in writes if (write.time, write.clock) != stamp])
            store.history.__dict__.update(fresh.__dict__)
            store._show(old, writes, own=True)

    patch.setattr(Store, "__init__", mutant_make)
    patch.setattr(Deliveries, "_end", mutant)


def gives_stamps_of_its_own_clock(patch: Patch) -> None:
    patch.setattr(Store, "_later", lambda _, stamp: stamp)


def shows_no_batches_of_others(patch: Patch) -> None:
    show = Store._show

    def mutant(store: Store, old: Any, writes: Any, *, own: bool) -> None:
        if own or len(writes) < 2:
            show(store, old, writes, own=own)

    patch.setattr(Store, "_show", mutant)


def keeps_no_deletions(patch: Patch) -> None:
    add = History._add

    def mutant(history: History, write: Any) -> Any:
        steps = add(history, write)
        if steps and write.value is DELETED and history.find(write.path) == write:
            history._drop(write.path)
        return steps

    patch.setattr(History, "_add", mutant)


def forgets_its_horizon(patch: Patch) -> None:
    patch.setattr(History, "restore", nothing)


def tells_no_horizon(patch: Patch) -> None:
    compare = Comparisons._compare

    def mutant(comparisons: Comparisons, request: Any) -> Any:
        reply = compare(comparisons, request)
        reply.whole, reply.horizon = False, 0
        return reply

    patch.setattr(Comparisons, "_compare", mutant)


def has_digests_without_stamps(patch: Patch) -> None:
    def mutant(data: bytes, **more: Any) -> Any:
        return hashlib.blake2b(data.split(b" ", 2)[-1], **more)

    patch.setattr("rosz.params.history.blake2b", mutant)


def drops_without_a_word(patch: Patch) -> None:
    merge = Store.merge

    def mutant(store: Store, writes: Any, horizon: int) -> None:
        merge(store, writes, horizon)
        effects = store._work.effects
        store._work.effects = [line for line in effects if not isinstance(line, done.Log)]

    patch.setattr(Store, "merge", mutant)


# Acknowledgements


class Found(NamedTuple):
    """Where a fault shows, and how.

    Attributes:
        seed: Seed of the history; -1 if it does not show.
        text: What does not hold.
    """

    seed: int
    text: str


class _Counted(set[str]):
    """A set that counts all that was ever added."""

    def __init__(self) -> None:
        super().__init__()
        self.count = 0

    def add(self, zid: str) -> None:
        super().add(zid)
        self.count += 1

    def __len__(self) -> int:
        return self.count


def _patch_deliveries(patch: Patch, change: Callable[[Any], None]) -> None:
    publish = Deliveries.publish

    def mutant(deliveries: Deliveries, *arguments: Any) -> int:
        number = publish(deliveries, *arguments)
        change(deliveries._open[number])
        return number

    patch.setattr(Deliveries, "publish", mutant)


def counts_an_acknowledgement_twice(patch: Patch) -> None:
    def change(delivery: Any) -> None:
        delivery.holders = _Counted()

    _patch_deliveries(patch, change)


def takes_an_acknowledgement_for_the_newest_batch(patch: Patch) -> None:
    acknowledge = Deliveries.acknowledge

    def mutant(deliveries: Deliveries, event: said.Acknowledged) -> bool:
        event = msgspec.structs.replace(event, number=deliveries.newest)
        return acknowledge(deliveries, event)

    patch.setattr(Deliveries, "acknowledge", mutant)


def counts_a_lagging_replica_as_holder(patch: Patch) -> None:
    end = Deliveries._end

    def mutant(deliveries: Deliveries, delivery: Any) -> None:
        delivery.holders |= delivery.skipped
        end(deliveries, delivery)

    patch.setattr(Deliveries, "_end", mutant)


def does_not_name_the_lagging(patch: Patch) -> None:
    end = Deliveries._end

    def mutant(deliveries: Deliveries, delivery: Any) -> None:
        delivery.skipped = set()
        end(deliveries, delivery)

    patch.setattr(Deliveries, "_end", mutant)


def never_sends_again(patch: Patch) -> None:
    patch.setattr(Deliveries, "_resend", nothing)


def waits_without_a_limit(patch: Patch) -> None:
    later = Work.later

    def mutant(work: Any, seconds: float, kind: str, number: int = 0, call: int = 0) -> None:
        if kind != deliveries_module.DELIVERY or seconds <= 0.25:
            later(work, seconds, kind, number, call)

    patch.setattr(Work, "later", mutant)


def does_not_wait_for_the_last_one(patch: Patch) -> None:
    expect = Deliveries._expect

    def mutant(deliveries: Deliveries, delivery: Any, *more: Any) -> None:
        expect(deliveries, delivery, *more)
        if len(delivery.waiting) > 1:
            delivery.waiting.discard(max(delivery.waiting))

    patch.setattr(Deliveries, "_expect", mutant)


# The others


def never_forgets_a_member(patch: Patch) -> None:
    set_member = Members.set_member

    def mutant(members: Members, zid: str, member: Any) -> Any:
        return set_member(members, zid, member or members._all.get(zid))

    patch.setattr(Members, "set_member", mutant)


def does_not_notice_that_it_stood_still(patch: Patch) -> None:
    patch.setattr(Members, "recover", nothing)


def does_not_miss_whom_it_lost(patch: Patch) -> None:
    patch.setattr(Members, "_lose", nothing)


def takes_who_is_lost_for_one_that_left(patch: Patch) -> None:
    patch.setattr(Members, "awaited", lambda _: set())


def leaves_without_handing_over(patch: Patch) -> None:
    patch.setattr(Deliveries, "unshared", property(lambda _: []))


def joins_too_early(patch: Patch) -> None:
    patch.setattr(Joining, "query_next", Joining._end)


def never_sends_what_others_lack(patch: Patch) -> None:
    on_reply = Comparisons._on_reply

    def mutant(comparisons: Comparisons, comparison: Any, reply: Any) -> None:
        reply.wanted = []
        on_reply(comparisons, comparison, reply)

    patch.setattr(Comparisons, "_on_reply", mutant)


def never_compares_of_its_own(patch: Patch) -> None:
    patch.setattr(Comparisons, "start_with_one", nothing)


def calls_any_comparison_good(patch: Patch) -> None:
    end = Comparisons._end

    def mutant(comparisons: Comparisons, comparison: Any, **_: bool) -> None:
        comparison.joined = True
        end(comparisons, comparison, good=True)

    patch.setattr(Comparisons, "_end", mutant)


MUTATIONS: tuple[Mutation, ...] = (
    acknowledges_before_the_disk,
    answers_before_the_own_disk,
    forgets_what_a_full_disk_refused,
    compacts_without_the_newest_write,
    takes_any_end_of_a_save_for_success,
    takes_a_part_of_a_batch,
    acknowledges_what_it_refuses,
    undoes_what_is_not_kept_everywhere,
    gives_stamps_of_its_own_clock,
    shows_no_batches_of_others,
    keeps_no_deletions,
    forgets_its_horizon,
    tells_no_horizon,
    has_digests_without_stamps,
    drops_without_a_word,
    counts_an_acknowledgement_twice,
    takes_an_acknowledgement_for_the_newest_batch,
    counts_a_lagging_replica_as_holder,
    does_not_name_the_lagging,
    never_sends_again,
    waits_without_a_limit,
    does_not_wait_for_the_last_one,
    never_forgets_a_member,
    does_not_notice_that_it_stood_still,
    does_not_miss_whom_it_lost,
    takes_who_is_lost_for_one_that_left,
    leaves_without_handing_over,
    joins_too_early,
    never_sends_what_others_lack,
    never_compares_of_its_own,
    calls_any_comparison_good,
)


@contextmanager
def faulty(mutation: Mutation) -> Iterator[None]:
    """Return a context in which all cores have a fault."""
    with pytest.MonkeyPatch.context() as patch:
        mutation(patch)
        yield


def first_found(mutation: Mutation, play: Callable[[int], object], seeds: Iterable[int]) -> Found:
    """Return the first seed whose history shows a fault, and how; -1 if none does."""
    for seed in seeds:
        try:
            with faulty(mutation):
                play(seed)
        except Violation as error:
            return Found(seed, str(error).splitlines()[0])
    return Found(-1, "")
