"""The world of a simulation: machines, the network between them, and time.

A world carries out the effects of the cores as the shell of a replica does. Whatever may happen
later is an item with a time; who runs the world may change the order.
"""

from __future__ import annotations

import heapq
import itertools
import random
from collections import deque
from typing import Any

import msgspec

from rosz.params.paths import Path
from rosz.params.replica.core import Config
from rosz.params.replica.core import effects as done
from rosz.params.replica.core import events as said
from rosz.params.wire import ReplicaMember
from rosz.params.writes import Change, Write

from .checks import Checks
from .disk import Disk
from .process import WALL, Call, Process, State
from .schedule import Boot, Deliver, Expire, Finish, Fire, Item, Lapse, Reconcile, Relink, Report
from .violation import fail, line_of

LEASE = 10.0
"""Seconds after which the links to a process that stands still are given up."""

JOIN_LIMIT = 60.0
CLOSE_LIMIT = 1.0


class Setting(msgspec.Struct, frozen=True):
    """What a world is made of.

    Attributes:
        machines: Number of machines.
        stored: Machines with a file, as bits.
        keep: Deletions that are never forgotten.
        loss: Chance that a message is lost.
        repeats: Chance that a message arrives twice.
        slow: Chance that a message takes up to three seconds.
        scoped: Whether keys name paths.
    """

    machines: int = 3
    stored: int = 0
    keep: int = 10_000
    loss: float = 0.0
    repeats: float = 0.0
    slow: float = 0.0
    scoped: bool = False


class World:
    """Machines, the network between them, and time.

    Args:
        setting: What it is made of.
        seed: Seed of all that happens by chance.

    Attributes:
        now: Time in seconds.
        processes: All processes that there ever were.
        running: The present process of each machine.
        queue: What happens later, by time.
        batches: Writes of each batch that was sent, by session and number.
        registry: All writes that were ever made.
        lossless: Whether no message was lost since the world began or was mended.
    """

    def __init__(self, setting: Setting, seed: int = 0) -> None:
        self.setting = setting
        self.seed = seed
        self.random = random.Random(seed)
        self.now = 100.0
        self.steps = 0
        self.processes: dict[str, Process] = {}
        self.running: dict[str, Process] = {}
        self.disks: dict[str, Disk] = {}
        self.skews: dict[str, int] = {}
        self.lives: dict[str, int] = {}
        self.cuts: set[tuple[str, str]] = set()
        self.severed: set[str] = set()
        self.queue: list[tuple[float, int, Item]] = []
        self.batches: dict[tuple[str, int], list[Write]] = {}
        self.registry: dict[tuple[int, str, Path], Write] = {}
        self.queries: dict[tuple[str, int], str] = {}
        self.loss = setting.loss
        self.lies = False
        self.lossless = setting.loss == 0
        self.trace: deque[tuple[float, str, Any]] = deque(maxlen=3000)
        self.checks = Checks(self)
        self._count = itertools.count(1)
        self._values = itertools.count(1)
        for index in range(setting.machines):
            name = "abcdefgh"[index]
            self.lives[name] = 0
            self.skews[name] = 0
            if setting.stored >> index & 1:
                self.disks[name] = Disk()

    # What chance decides; an exploration tries all instead

    def later(self, delay: float, item: Item) -> None:
        """Let something happen after some time."""
        heapq.heappush(self.queue, (self.now + delay, next(self._count), item))

    def message_delay(self) -> float:
        """Return how long a message takes."""
        chance = self.random.random()
        if chance < self.setting.slow:
            return self.random.uniform(0.0, 3.0)
        return self.random.uniform(0.0002, 0.002 if chance < 0.9 else 0.1)

    def token_delay(self, *, lost: bool) -> float:
        """Return how long it takes to see that another process is there or not."""
        return self.random.uniform(0.001, 0.3 if not lost or self.random.random() < 0.5 else LEASE)

    def is_lost(self) -> bool:
        """Decide whether a message is lost."""
        return self.loss > 0 and self.random.random() < self.loss

    # Machines

    @property
    def machines(self) -> list[str]:
        """Names of all machines."""
        return list(self.lives)

    def start(self, machine: str, handover: tuple[list[Write], int] | None = None) -> None:
        """Start the program of a machine, if it does not run."""
        if machine in self.running:
            return
        self.lives[machine] += 1
        life = self.lives[machine]
        zid = f"{machine}{life}"
        start = WALL + int(self.now * 1e9) + self.skews[machine]
        disk = self.disks.get(machine)
        config = Config(
            ReplicaMember(start, zid, f"process {machine}"),
            scoped=self.setting.scoped,
            stored=disk is not None,
            seed=self.seed * 1000 + life * 10 + "abcdefgh".index(machine),
            keep=self.setting.keep,
        )
        process = Process(machine, life, config, disk, self.skews[machine])
        self.processes[zid] = self.running[machine] = process
        if handover is not None:
            self.step(process, said.Loaded(*handover, changed=True))
        elif disk is not None:
            self.step(process, said.Loaded(list(disk.content.values()), disk.horizon))
        for other in self.others(process):
            if self.sees(process, other, seed=True):
                process.seeds.add(other.zid)
                process.met.add(other.zid)
                self.step(process, said.SeedCame(other.member))
        self.call(process, said.JoinCalled(self.number()), JOIN_LIMIT)

    def crash(self, machine: str) -> None:
        """Kill the program of a machine; its disk loses what it was not done with."""
        process = self.running.pop(machine, None)
        if process is not None:
            self.note(process, "crashes")
            if process.disk is not None:
                process.disk.crash()
            self._end(process)

    def hand_over(self, machine: str) -> None:
        """Restart the core of a program, which leaves its writes to the next one."""
        process = self.running.get(machine)
        if process is None or process.state is not State.RUNS or not process.core.ready:
            return
        self.note(process, "restarts its core")
        del self.running[machine]
        self._tell_all(process, said.MemberLeft(process.zid, returns=True))
        self._end(process)
        writes, horizon = list(process.core.history.writes()), process.core.history.horizon
        self.later(self.random.choice([0.0, 0.3, 3.0]), Boot(machine, (writes, horizon)))

    def stop(self, machine: str) -> None:
        """Let a program stand still."""
        process = self.running.get(machine)
        if process is not None and process.state is State.RUNS:
            self.note(process, "stands still")
            process.state, process.stopped_at = State.STOPPED, self.now
            self.later(LEASE, Lapse(process.zid, self.now))

    def wake(self, machine: str) -> None:
        """Let a program go on, and all that waited for it happen in any order."""
        process = self.running.get(machine)
        if process is None or process.state is not State.STOPPED:
            return
        self.note(process, "goes on")
        process.state = State.RUNS
        if self.now - process.stopped_at > 4.1 and process.core.ready:
            process.woke_at = self.now
        for call in process.calls.values():
            call.deadline = max(call.deadline, self.now + 0.5)
            call.slept = True
        for item in process.mailbox:
            self.later(self.random.uniform(0.0, 0.05), item)
        process.mailbox = []
        if process.zid in self.severed:
            self.later(self.random.choice([0.1, 1.0, 4.0]), Relink(process.zid))

    def cut(self, source: str, target: str) -> None:
        """Lose all messages from one machine to another; both see that soon."""
        if source != target and (source, target) not in self.cuts:
            self.cuts.add((source, target))
            self._reconcile_machines(source, target, lost=True)

    def mend(self, source: str, target: str) -> None:
        """Undo `cut`."""
        if (source, target) in self.cuts:
            self.cuts.discard((source, target))
            self._reconcile_machines(source, target, lost=False)

    # Calls

    def number(self) -> int:
        """Return a number that was not used before."""
        return next(self._values)

    def write(
        self,
        machine: str,
        changes: list[Change],
        timeout: float = 2.0,
        stamp: tuple[int, str] | None = None,
    ) -> None:
        """Let a process write, if it can."""
        process = self.running.get(machine)
        if process is None or not self.serves(process) or not changes:
            return
        event = said.WriteCalled(
            self.number(),
            changes,
            process.label,
            stamp or (process.wall(self.now), process.zid),
            given=stamp is not None,
            timeout=timeout,
        )
        self.call(process, event, timeout)

    def serves(self, process: Process) -> bool:
        """Tell whether a process runs and takes calls."""
        return process.state is State.RUNS and process.joined and not self.closes(process)

    def closes(self, process: Process) -> bool:
        """Tell whether a process is about to end."""
        return any(isinstance(call.event, said.CloseCalled) for call in process.calls.values())

    def call(self, process: Process, event: Any, limit: float) -> None:
        """Hand a call over, and expect its answer within a limit."""
        call = Call(event.call, event, self.now + limit + 0.3)
        process.calls[call.number] = call
        self.checks.answers.on_call(process, call)
        self.step(process, event)

    # What happens

    def run(self, seconds: float) -> None:
        """Let time pass."""
        until = self.now + seconds
        while self.queue and self.queue[0][0] <= until:
            time, _, item = heapq.heappop(self.queue)
            self.now = max(self.now, time)
            self.happen(item)
        self.now = until
        for process in self.running.values():
            self.checks.on_time(process)

    def happen(self, item: Item) -> None:
        """Let an item happen."""
        zid = getattr(item, "zid", "")
        if zid and not isinstance(item, (Lapse, Relink)):
            process = self.processes[zid]
            if process.state is State.STOPPED:
                process.mailbox.append(item)
                return
            if process.state is State.ENDED:
                return
        getattr(self, f"_on_{type(item).__name__.lower()}")(item)

    def step(self, process: Process, event: said.Event) -> None:
        """Hand an event to a core, check what it does, and carry that out."""
        self.steps += 1
        if not isinstance(event, said.TimerFired) or event.timer.kind != "tick":
            self.trace.append((self.now, process.zid, event))
        wall = process.wall(self.now)
        effects = process.core.step(event, said.Moment(self.now, wall))
        for effect in effects:
            if not isinstance(effect, (done.StartTimer, done.SeedsChanged)):
                self.trace.append((self.now, process.zid, effect))
        self.checks.on_step(process, event, effects)
        for effect in effects:
            self._carry_out(process, effect)

    def _on_deliver(self, item: Deliver) -> None:
        process = self.processes[item.zid]
        if item.source and not self.linked(item.source, item.zid):
            self.lossless = False
            return
        event = item.event
        if isinstance(event, said.QueryEnded):
            if self.queries.pop((item.zid, event.number), None) is None:
                return
        elif isinstance(event, said.MemberLeft) and not event.returns:
            process.left.add(event.zid)
        self.step(process, event)

    def _on_fire(self, item: Fire) -> None:
        process = self.processes[item.zid]
        if item.call:
            if process.timers.get(item.call) != item.ident:
                return
            del process.timers[item.call]
        self.step(process, said.TimerFired(item.timer))

    def _on_finish(self, item: Finish) -> None:
        process = self.processes[item.zid]
        disk = process.disk
        if disk is not None and disk.pending:
            self.lies = self.lies or disk.lies
            self.step(process, disk.finish(self.random.randint(1, len(disk.pending))))

    def _on_expire(self, item: Expire) -> None:
        if self.queries.pop((item.zid, item.number), None) is not None:
            self.step(self.processes[item.zid], said.QueryEnded(item.number, None, failed=True))

    def _on_lapse(self, item: Lapse) -> None:
        process = self.processes[item.zid]
        if process.state is State.STOPPED and process.stopped_at == item.since:
            self.severed.add(item.zid)
            for other in self.others(process):
                self._reconcile(process, other, lost=True)
                self._reconcile(other, process, lost=True)

    def _on_relink(self, item: Relink) -> None:
        process = self.processes[item.zid]
        if process.state is State.RUNS:  # otherwise it looks for the others when it goes on
            self.severed.discard(item.zid)
            for other in self.others(process):
                self._reconcile(process, other, lost=False)
                self._reconcile(other, process, lost=False)

    def _on_boot(self, item: Boot) -> None:
        self.start(item.machine, item.handover)

    def _on_report(self, item: Report) -> None:
        process = self.processes[item.zid]
        if process.watch != item.watch:
            return
        for other in self.others(process):
            if self.sees(process, other):
                process.members.add(other.zid)
                self._is_found(process, other)
                self.step(process, said.MemberCame(item.watch, other.member))
        for zid in sorted(process.seeds - process.members):
            process.lost[zid] = self.now
        process.watching = True
        self.step(process, said.MembersKnown(item.watch))

    def _on_reconcile(self, item: Reconcile) -> None:
        process, other = self.processes[item.zid], self.processes[item.other]
        for seed in (True, False):
            known = process.seeds if seed else process.members
            watched = seed or process.watching
            visible = self.sees(process, other, seed=seed)
            if not watched or visible == (other.zid in known):
                continue
            before = process.visible.copy()
            if visible:
                known.add(other.zid)
                self._is_found(process, other)
                came = other.member
                self.step(
                    process,
                    said.SeedCame(came) if seed else said.MemberCame(process.watch, came),
                )
            else:
                known.discard(other.zid)
                if before != process.visible:
                    process.lost[other.zid] = self.now
                self.step(
                    process,
                    said.SeedWent(other.zid) if seed else said.MemberWent(process.watch, other.zid),
                )

    def _is_found(self, process: Process, other: Process) -> None:
        process.met.add(other.zid)
        process.lost = {
            zid: time
            for zid, time in process.lost.items()
            if self.processes[zid].machine != other.machine
        }

    # Effects

    def _carry_out(self, process: Process, effect: done.Effect) -> None:
        carry_out = getattr(self, f"_do_{type(effect).__name__.lower()}", None)
        if carry_out is not None:
            carry_out(process, effect)

    def _do_publish(self, process: Process, effect: done.Publish) -> None:
        event = said.BatchReceived(process.zid, effect.number, effect.batch)
        self._tell_all(process, event)

    def _do_resend(self, process: Process, effect: done.Resend) -> None:
        for zid in effect.zids:
            # The receiver's reply finds its way by the number of the query.
            query = self._query_id(process, -effect.number)
            event = said.BatchReceived(process.zid, effect.number, effect.batch, query=query)
            self._send(process, zid, event)

    def _do_acknowledge(self, process: Process, effect: done.Acknowledge) -> None:
        event = said.Acknowledged(process.zid, effect.number, effect.reason)
        self._send(process, effect.sender, event)

    def _do_sendquery(self, process: Process, effect: done.SendQuery) -> None:
        self.queries[process.zid, effect.number] = effect.zid
        self.later(effect.timeout, Expire(process.zid, effect.number))
        target = self.processes.get(effect.zid)
        if target is None or target.state is State.ENDED:
            self._deliver(process.zid, said.QueryEnded(effect.number, None), "")
            return
        query = self._query_id(process, effect.number)
        if effect.paths:
            self._send(process, effect.zid, said.WritesReceived(query, effect.request))
        else:
            self._send(process, effect.zid, said.SyncReceived(query, effect.request))

    def _do_reply(self, process: Process, effect: done.Reply) -> None:
        zid, number = self.asker(effect.query)
        if isinstance(effect.reply, str):
            self._send(process, zid, said.QueryEnded(number, None, failed=True))
        else:
            self._send(process, zid, said.QueryEnded(number, effect.reply))

    def _do_starttimer(self, process: Process, effect: done.StartTimer) -> None:
        ident = next(self._count)
        if effect.call:
            if effect.call not in process.calls:
                return
            process.timers[effect.call] = ident
        self.later(effect.seconds, Fire(process.zid, effect.timer, effect.call, ident))

    def _do_save(self, process: Process, effect: done.Save | done.Compact) -> None:
        if process.disk is None:
            fail(self, process, "saves without a file")
        process.disk.pending.append(effect)
        self.later(process.disk.slow + self.disk_delay(), Finish(process.zid))

    def disk_delay(self) -> float:
        """Return how long the disk takes."""
        return self.random.uniform(0.0001, 0.02)

    _do_compact = _do_save

    def _do_treechanged(self, process: Process, effect: done.TreeChanged) -> None:
        process.show(effect)

    def _do_answer(self, process: Process, effect: done.Answer) -> None:
        process.timers.pop(effect.call, None)
        call = process.calls.pop(effect.call, None)
        if call is not None and isinstance(call.event, said.JoinCalled):
            process.joined = True
        if call is not None and isinstance(call.event, said.CloseCalled):
            self.running.pop(process.machine, None)
            self._end(process)

    def _do_declaretoken(self, process: Process, _: done.DeclareToken) -> None:
        process.token = True
        self._show(process)

    def _do_declareseed(self, process: Process, _: done.DeclareSeed) -> None:
        process.seed = True
        self._show(process)

    def _do_undeclareseed(self, process: Process, _: done.UndeclareSeed) -> None:
        process.seed = False
        self._show(process)

    def _do_followall(self, process: Process, effect: done.FollowAll) -> None:
        process.watch = effect.watch
        process.watching = False
        process.members = set()
        self.later(self.token_delay(lost=False), Report(process.zid, effect.watch))

    def _do_unfollowall(self, process: Process, _: done.UnfollowAll) -> None:
        process.watch = 0
        process.watching = False
        process.members = set()

    def _do_leave(self, process: Process, _: done.Leave) -> None:
        self._tell_all(process, said.MemberLeft(process.zid))
        process.token = process.seed = False
        self._show(process)

    def _do_findstoppedpeers(self, process: Process, _: done.FindStoppedPeers) -> None:
        self._deliver(process.zid, said.StoppedPeersFound(self.stopped()), "")

    def stopped(self) -> frozenset[str]:
        """Return the sessions of processes that stand still."""
        return frozenset(
            other.zid for other in self.running.values() if other.state is State.STOPPED
        )

    def _do_readstorages(self, process: Process, _: done.ReadStorages) -> None:
        self._deliver(process.zid, said.StoragesRead([]), "")

    # The network

    def others(self, process: Process) -> list[Process]:
        """Return the processes of the other machines."""
        return [other for other in self.running.values() if other is not process]

    def linked(self, source: str, target: str) -> bool:
        """Tell whether messages of one process reach another."""
        link = self.processes[source].machine, self.processes[target].machine
        return link not in self.cuts and not self.severed & {source, target}

    def sees(self, process: Process, other: Process, *, seed: bool = False) -> bool:
        """Tell whether a process can see the token of another."""
        return (
            (other.seed if seed else other.token)
            and other.state is not State.ENDED
            and self.linked(process.zid, other.zid)
            and self.linked(other.zid, process.zid)
        )

    def _send(self, process: Process, zid: str, event: said.Event) -> None:
        if zid not in self.processes or self.is_lost() or not self.linked(process.zid, zid):
            self.lossless = False
            return
        self._deliver(zid, event, process.zid)
        repeats = self.setting.repeats
        if repeats and not isinstance(event, said.QueryEnded) and self.random.random() < repeats:
            self._deliver(zid, event, process.zid)

    def _deliver(self, zid: str, event: said.Event, source: str) -> None:
        delay = self.message_delay() if source else self.random.uniform(0.0, 0.002)
        self.later(delay, Deliver(zid, event, source))

    def _tell_all(self, process: Process, event: said.Event) -> None:
        for other in self.others(process):
            self._send(process, other.zid, event)

    def _show(self, process: Process) -> None:
        for other in self.others(process):
            self._reconcile(other, process, lost=False)

    def _reconcile(self, process: Process, other: Process, *, lost: bool) -> None:
        self.later(self.token_delay(lost=lost), Reconcile(process.zid, other.zid))

    def _reconcile_machines(self, source: str, target: str, *, lost: bool) -> None:
        here, there = self.running.get(source), self.running.get(target)
        if here is not None and there is not None:
            self._reconcile(here, there, lost=lost)
            self._reconcile(there, here, lost=lost)

    def _end(self, process: Process) -> None:
        process.end()
        self.severed.discard(process.zid)
        for other in self.others(process):
            self._reconcile(other, process, lost=True)

    def _query_id(self, process: Process, number: int) -> int:
        """Return a number that names a query in the whole world; negative numbers are batches."""
        index = "abcdefgh".index(process.machine)
        return ((process.life * 8 + index) * 1_000_000 + abs(number)) * 2 + (number < 0)

    def asker(self, query: int) -> tuple[str, int]:
        """Return the session and the number of a query."""
        rest, number = divmod(query // 2, 1_000_000)
        life, index = divmod(rest, 8)
        return f"{'abcdefgh'[index]}{life}", number

    # The trace

    def note(self, process: Process, text: str) -> None:
        """Add a line to the trace."""
        self.trace.append((self.now, process.zid, text))

    def story(self, last: int = 3000) -> str:
        """Return the trace as text."""
        lines = [f"{time:9.4f} {zid:3} {line_of(what)}" for time, zid, what in self.trace]
        return "\n".join(lines[-last:])
