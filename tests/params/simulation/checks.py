"""What must hold after every step of a core."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from params.oracle import replay
from rosz.params.history import History
from rosz.params.paths import joined
from rosz.params.replica.core import effects as done
from rosz.params.replica.core import events as said
from rosz.params.tree import MISSING, Tree, leaves, lookup
from rosz.params.writes import DELETED, Order, Write

from .answers import Answers
from .process import WATCHED, Process, State
from .violation import fail

if TYPE_CHECKING:
    from .world import World


class Checks:
    """All checks of a world.

    Args:
        world: The world.
    """

    def __init__(self, world: World) -> None:
        self.world = world
        self.buried: dict[Order, Write] = {}
        self.witnesses: set[str] = set()
        self.answers = Answers(world)

    # After each step

    def on_step(self, process: Process, event: said.Event, effects: list[done.Effect]) -> None:
        """Check what a core did in a step, before it is carried out."""
        history = process.core.history
        for effect in effects:
            if isinstance(effect, done.Publish):
                self._on_publish(process, event, effect)
        mark = history.root, history.horizon, len(history)
        if mark[0] is not process.mark[0] or mark[1:] != process.mark[1:]:
            process.mark = mark
            self._on_history(process, event, effects)
        self._on_event(process, event, effects)
        shown = process.shown
        for effect in effects:
            if isinstance(effect, done.TreeChanged):
                self._on_tree(process, shown, effect)
                shown = effect.new
            elif isinstance(effect, done.Acknowledge):
                self._on_acknowledge(process, effect)
        if shown is not history.root and shown != history.root:
            fail(self.world, process, f"shows {shown}, and holds {history.root}")
        for effect in effects:
            if isinstance(effect, done.Answer):
                self.answers.on_answer(process, effect, effects)

    def _on_event(self, process: Process, event: said.Event, effects: list[done.Effect]) -> None:
        if isinstance(event, said.BatchReceived):
            self._on_batch(process, event, effects)
        elif isinstance(event, said.Saved):
            self._on_saved(process, event)
        for call in process.calls.values():
            for effect in effects:
                if isinstance(effect, done.Resend) and call.batch == effect.number:
                    call.resent |= set(effect.zids)
            if isinstance(event, said.StoppedPeersFound):
                call.resent |= event.zids  # nobody sends anything to those

    def on_time(self, process: Process) -> None:
        """Check that no call waits for too long."""
        if process.state is State.RUNS:
            for call in process.calls.values():
                if self.world.now > call.deadline:
                    fail(self.world, process, f"has not answered {call.event} in time")

    def _on_publish(self, process: Process, event: said.Event, effect: done.Publish) -> None:
        writes = effect.batch.writes()
        self.world.batches[process.zid, effect.number] = writes
        for write in writes:
            known = self.world.registry.setdefault(write.order, write)
            if known.value != write.value:
                fail(self.world, process, f"gives the stamp of {known} again, to {write}")
        if isinstance(event, said.WriteCalled) and event.call in process.calls:
            call = process.calls[event.call]
            call.writes, call.batch = writes, effect.number
            root = process.core.history.root
            for path, value in event.changes[-1:]:
                expected = MISSING if value is DELETED else value
                if not event.given and path and lookup(root, path) != expected:
                    fail(self.world, process, f"does not read what it wrote: {event}")

    def _on_history(self, process: Process, event: said.Event, effects: list[done.Effect]) -> None:
        history = process.core.history
        held = {write.order: write for write in history.writes()}
        before, process.held = process.held, held
        if isinstance(event, said.Loaded):
            for order, write in held.items():
                self.world.registry.setdefault(order, write)
        self._check_lost(process, before, effects)
        for order, write in held.items():
            if order not in before:
                self._check_new(process, write)
        process.ever.update(held)
        # The tree is that of all there ever was, as long as nothing had to be forgotten.
        tree = replay((held if history.horizon else process.ever).values())
        if tree != history.root:
            fail(self.world, process, f"has the tree {history.root}, and ROS 1 has {tree}")

    def _check_lost(
        self, process: Process, before: dict[Order, Write], effects: list[done.Effect]
    ) -> None:
        """A write may leave a set only for newer ones, or behind a horizon, with a word."""
        history = process.core.history
        dropped = any(
            isinstance(effect, done.Log) and "are dropped" in effect.text for effect in effects
        )
        for order, write in before.items():
            if order in process.held:
                continue
            if history.hides(write):
                process.gone.add(order)
            elif write.time > history.horizon:
                fail(self.world, process, f"loses {write}")
            elif write.value is not DELETED and not dropped:
                fail(self.world, process, f"drops {write} without a word")

    def _check_new(self, process: Process, write: Write) -> None:
        """A write that enters a set must have been made, and not have been overwritten."""
        if write.order in process.gone:
            fail(self.world, process, f"takes {write} again, which was overwritten")
        known = self.world.registry.get(write.order)
        # What is left of a dict whose parts may be deleted; see `History.provable`.
        rest = write.value in (DELETED, {}) and write.clock.endswith("0")
        if known is None and not rest:
            fail(self.world, process, f"has {write}, which nobody wrote")
        if known is not None and known.value != write.value:
            fail(self.world, process, f"has {write} instead of {known}")

    def _on_tree(self, process: Process, shown: Tree, effect: done.TreeChanged) -> None:
        if effect.old is not shown and effect.old != shown:
            fail(self.world, process, f"shows a change of {effect.old}, after {shown}")
        old, new = dict(leaves(effect.old)), dict(leaves(effect.new))
        for path in old.keys() | new.keys():
            differs = path and old.get(path, MISSING) != new.get(path, MISSING)
            if differs and not any(_meet(write.path, path) for write in effect.writes):
                fail(self.world, process, f"changes {path} without telling its watchers")

    def _on_batch(
        self, process: Process, event: said.BatchReceived, effects: list[done.Effect]
    ) -> None:
        """A batch must be taken as a whole, or be refused."""
        refused = any(isinstance(effect, done.Acknowledge) and effect.reason for effect in effects)
        history = process.core.history
        for write in self.world.batches[event.sender, event.number]:
            if not refused and not history.hides(write):
                fail(self.world, process, f"neither takes nor refuses {write}")

    def _on_acknowledge(self, process: Process, effect: done.Acknowledge) -> None:
        writes = self.world.batches.get((effect.sender, effect.number))
        if writes is None:
            fail(self.world, process, f"acknowledges what nobody sent: {effect}")
        if not effect.reason:
            if not process.applied(writes):
                fail(self.world, process, f"acknowledges what it has not: {effect}")
            if not process.has(writes):
                fail(self.world, process, f"acknowledges what it has not stored: {effect}")

    def _on_saved(self, process: Process, event: said.Saved) -> None:
        disk = process.disk
        if disk is None or disk.pending or event.reason or process.core._store.disk.reason:
            return
        for write in process.held.values():
            if not disk.holds(write) and process.state is State.RUNS:
                fail(self.world, process, f"has nothing to save, and {write} is not in its file")

    # When all is quiet

    def on_quiet(self) -> None:
        """Check that all replicas hold the same, and nothing that is gone."""
        world = self.world
        processes = list(world.running.values())
        for process in processes:
            if process.calls:
                fail(self.world, process, f"has not answered {list(process.calls.values())}")
            if not process.core.ready:
                fail(self.world, process, "is not ready")
            self._check_memory(process)
        if not processes:  # all were about to end when the quiet time began
            return
        first = processes[0]
        for process in processes[1:]:
            if process.held != first.held:
                ours, theirs = set(first.held), set(process.held)
                fail(
                    self.world,
                    process,
                    f"differs from {first.zid}: lacks {sorted(ours - theirs)[:5]}, has"
                    f" {sorted(theirs - ours)[:5]}",
                )
            if process.core.history.digest() != first.core.history.digest():
                fail(self.world, process, f"has another digest than {first.zid}")
            if process.core.history.root != first.core.history.root:
                fail(self.world, process, f"has another tree than {first.zid}")
            others = {other.zid for other in processes} - {process.zid}
            if process.watching and process.core.zids != others:
                fail(self.world, process, f"sees {sorted(process.core.zids)}")
        self._check_buried(first)

    def _check_memory(self, process: Process) -> None:
        """Compare what a core keeps up to date with what follows from its writes."""
        fresh = History()
        fresh.apply(process.held.values())
        history = process.core.history
        if fresh.digest() != history.digest():
            hidden = [write for write in history.writes() if not fresh.find(write.path)]
            fail(
                self.world,
                process,
                f"has a digest that is not that of its writes; hidden: {hidden}",
            )
        if fresh.root != history.root:
            fail(self.world, process, "has a tree that is not that of its writes")
        for path in WATCHED:
            seen = process.seen.get(path, MISSING)
            value = lookup(history.root, path)
            if seen != value and not history.horizon:
                fail(
                    self.world,
                    process,
                    f"has {joined(path)} = {value}; its watcher saw {seen} last",
                )
        disk = process.disk
        if disk is not None and not disk.pending:
            lacking = [write for write in process.held.values() if not disk.holds(write)]
            if lacking:
                fail(self.world, process, f"is quiet, and has not stored {lacking[0]}")
            stored = History()
            stored.apply(disk.content.values())
            stored.restore(disk.horizon)
            if stored.root != history.root:
                fail(self.world, process, f"has stored {stored.root} of {history.root}")

    def _check_buried(self, process: Process) -> None:
        """Nothing that all had lost to newer writes may be there again, if one is left of them."""
        if not self.witnesses & {other.zid for other in self.world.running.values()}:
            self.buried = {}
        self.witnesses = {other.zid for other in self.world.running.values()}
        for order, write in process.held.items():
            if order in self.buried and write.value is not DELETED:
                fail(self.world, process, f"has {write} again, which all had lost")
        self.buried = {
            order: write
            for order, write in self.world.registry.items()
            if order not in process.held
            and (process.core.history.hides(write) or write.time <= process.core.history.horizon)
        }


def _meet(path: Iterable[str], other: Iterable[str]) -> bool:
    """Tell whether one path lies at or below the other."""
    return all(left == right for left, right in zip(path, other, strict=False))
