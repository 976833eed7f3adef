"""One step of one process, apart from the world: what it becomes, and what leaves it.

An exploration meets the same process in the same state, with the same event, in many worlds. A step
is therefore made once, on a copy, and remembered.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from rosz.params.replica.core import effects as done
from rosz.params.replica.core import events as said
from rosz.params.writes import Write

from .answers import Answers
from .copies import Form, clone
from .disk import Disk
from .process import Alarm, Process, State
from .schedule import Finish, Item, Reconcile, Report
from .world import Setting, World

URGENT = frozenset({"delivery", "call", "appeared", "save again", "query the next", "find more"})
"""Timers that may fire before anything else; the others fire in the quiet time."""


class Sent(NamedTuple):
    """What leaves a process in a step.

    Attributes:
        kind: ``all`` and ``one`` send an event, ``query`` sends one that has an end, ``own`` is an
            event for the process itself, ``show`` tells others to look at its tokens, ``finish``
            lets its disk work, ``report`` lets it see the others, ``end`` ends it.
        target: Session of the receiver, if there is one.
        event: What is sent.
        number: Number of a query or a watch.
    """

    kind: str
    target: str = ""
    event: Any = None
    number: int = 0


class Asked(NamedTuple):
    """An answer to judge: the process as it answered, the answer, and the effects of the step."""

    process: Process
    answer: done.Answer
    effects: list[done.Effect]


class Reaction(NamedTuple):
    """What a step made.

    Attributes:
        after: Number of the state of the process.
        sent: What leaves it.
        asked: Its answers to calls.
        told: The event and the effects, for a trace.
    """

    after: int
    sent: tuple[Sent, ...]
    asked: tuple[Asked, ...]
    told: tuple[Any, ...]


class _Chance:
    """Chance that always decides alike; what depends on order is explored instead."""

    def uniform(self, low: float, _: float) -> float:
        return low

    def random(self) -> float:
        return 0.5

    def choice(self, choices: list[Any]) -> Any:
        return choices[0]

    def sample(self, choices: list[Any], count: int) -> list[Any]:
        return choices[:count]

    def randint(self, low: int, _: int) -> int:
        return low


class _Listener(Answers):
    """Notes answers, since what they promise depends on the other processes."""

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        self.asked: list[Asked] = []

    def on_answer(self, process: Process, effect: done.Answer, effects: list[done.Effect]) -> None:
        self.asked.append(Asked(clone(process, {}), effect, effects))


class Stage(World):
    """A world for one step at a time.

    Args:
        setting: What the explored world is made of.

    Attributes:
        states: All states of processes that were met, by number; 0 is none.
        listener: Notes answers.
        calls_made: Number of the last call.
    """

    def __init__(self, setting: Setting) -> None:
        super().__init__(setting)
        self.random = _Chance()  # type: ignore[assignment]
        self.states: list[Process] = [Process.__new__(Process)]
        self.listener = self.checks.answers = _Listener(self)
        self.calls_made = 0
        self.named: dict[str, Process] = {}
        self._forms: dict[int, int] = {}
        self._sent: list[Sent] = []
        self._told: list[Any] = []
        self._taken: tuple[int, ...] = ()
        self._seen: frozenset[str] = frozenset()

    def react(
        self,
        process: Process,
        now: float,
        taken: tuple[int, ...],
        do: Callable[[Process], object],
    ) -> Reaction:
        """Let a copy of a process do something.

        Args:
            process: The process.
            now: The time.
            taken: Numbers of its queries that are still on their way.
            do: What it does.
        """

        def act() -> Process:
            copy: Process = clone(process, {})
            do(copy)
            return copy

        return self._record(now, taken, act)

    def boot(
        self,
        machine: str,
        life: int,
        disk: Disk | None,
        others: list[Process],
        cuts: frozenset[tuple[str, str]],
        now: float,
    ) -> Reaction:
        """Start a process.

        Args:
            machine: Its machine.
            life: Number of lives of its program before.
            disk: Disk of the machine.
            others: The other processes.
            cuts: Links that are cut.
            now: The time.
        """

        def act() -> Process:
            self.lives[machine] = life
            self.running = {other.machine: other for other in others}
            self.disks = {} if disk is None else {machine: clone(disk, {})}
            self.cuts = set(cuts)
            self.calls_made = 1_000_000 + 1000 * life
            unseen = {source for source, target in cuts if target == machine}
            self._seen = frozenset(other.zid for other in others if other.machine not in unseen)
            self.start(machine)
            process = self.running[machine]
            self.named[process.zid] = process
            return process

        return self._record(now, (), act)

    def intern(self, process: Process) -> int:
        """Return the number of the state of a process."""
        form = hash(Form().of(process))
        number = self._forms.get(form)
        if number is None:
            number = self._forms[form] = len(self.states)
            self.states.append(process)
        return number

    def _record(self, now: float, taken: tuple[int, ...], do: Callable[[], Process]) -> Reaction:
        self.now, self._taken = now, taken
        self._sent, self._told, self.listener.asked = [], [], []
        process = do()
        return Reaction(
            self.intern(process), tuple(self._sent), tuple(self.listener.asked), tuple(self._told)
        )

    # What a process can do

    def take(self, process: Process, event: said.Event) -> None:
        """Let an event reach a process."""
        if isinstance(event, said.QueryEnded):
            numbers = [n for n, query in process.queries.items() if query[0] == event.number]
            if not numbers:
                return
            del process.queries[numbers[0]]
            event = said.QueryEnded(numbers[0], event.reply, event.failed)
        elif isinstance(event, said.MemberLeft) and not event.returns:
            process.left.add(event.zid)
        elif isinstance(event, said.BatchReceived):
            process.received[event.sender, event.number] = event.batch.writes()
        self.step(process, event)

    def look(self, process: Process, other: Process, *, linked: bool) -> None:
        """Let a process see whether another one is there."""
        self._seen = frozenset({other.zid} if linked else ())
        self.processes |= {process.zid: process, other.zid: other}
        self._on_reconcile(Reconcile(process.zid, other.zid))

    def report(self, process: Process, watch: int, others: list[Process]) -> None:
        """Report to a process all others, which it sees."""
        self._seen = frozenset(other.zid for other in others)
        self.running = {other.machine: other for other in others}
        self.processes |= {process.zid: process}
        self._on_report(Report(process.zid, watch))

    def finish(self, process: Process) -> None:
        """Let the disk of a process do its next task."""
        disk = process.disk
        if disk is not None and disk.pending:
            self.step(process, disk.finish(1))

    def fire(self, process: Process, key: Any) -> None:
        """Let a timer of a process fire, or a query take its time."""
        if key in process.alarms:
            alarm = process.alarms.pop(key)
            self.step(process, said.TimerFired(said.Timer(alarm.kind, alarm.number)))
        else:
            del process.queries[key]
            self.step(process, said.QueryEnded(key, None, failed=True))

    def ask(self, process: Process, event: Any, limit: float) -> None:
        """Hand a call over."""
        self.call(process, event, limit)

    # What of it concerns the process alone

    def number(self) -> int:
        self.calls_made += 1
        return self.calls_made

    def step(self, process: Process, event: said.Event) -> None:
        process.core._work.random = self.random
        self.processes[process.zid] = process
        self.batches = process.received.copy()
        # In another world, the same stamp may belong to another write.
        self.registry = process.ever | {write.order: write for write in _writes_of(event)}
        self.trace.clear()
        super().step(process, event)
        if process.disk is None or not process.disk.pending:
            process.received = {}
        self._told += [(zid, what) for _, zid, what in self.trace]

    def later(self, _delay: float, item: Item) -> None:
        if isinstance(item, Finish):
            self._sent.append(Sent("finish"))
        elif isinstance(item, Report):
            self._sent.append(Sent("report", number=item.watch))

    def _do_starttimer(self, process: Process, effect: done.StartTimer) -> None:
        if effect.call and effect.call not in process.calls:
            return
        due, timer = self.now + effect.seconds, effect.timer
        key = effect.call or (timer.kind, timer.number, due)
        process.alarms[key] = Alarm(due, timer.kind, timer.number)

    def _do_answer(self, process: Process, effect: done.Answer) -> None:
        process.alarms.pop(effect.call, None)
        super()._do_answer(process, effect)

    def _do_sendquery(self, process: Process, effect: done.SendQuery) -> None:
        used = {*self._taken, *(query[0] for query in process.queries.values())}
        number = next(number for number in range(1, 1000) if number not in used)
        process.queries[effect.number] = number, self.now + effect.timeout
        query = self._query_id(process, number)
        kind = said.WritesReceived if effect.paths else said.SyncReceived
        self._sent.append(Sent("query", effect.zid, kind(query, effect.request), number))

    def _end(self, process: Process) -> None:
        process.end()
        self._sent.append(Sent("end"))

    def _send(self, _process: Process, zid: str, event: said.Event) -> None:
        self._sent.append(Sent("one", zid, event))

    def _tell_all(self, _process: Process, event: said.Event) -> None:
        self._sent.append(Sent("all", "", event))

    def _deliver(self, zid: str, event: said.Event, _source: str) -> None:
        self._sent.append(Sent("own", zid, event))

    def _show(self, _process: Process) -> None:
        self._sent.append(Sent("show"))

    def sees(self, _process: Process, other: Process, *, seed: bool = False) -> bool:
        return other.zid in self._seen and (other.seed if seed else other.token)

    def stopped(self) -> frozenset[str]:
        return frozenset()


def _writes_of(event: said.Event) -> list[Write]:
    """Return the writes that an event brings."""
    if isinstance(event, said.BatchReceived):
        return event.batch.writes()
    if isinstance(event, said.WritesReceived):
        return [record.write() for record in event.request.records]
    if isinstance(event, said.QueryEnded) and event.reply is not None:
        return [record.write() for record in event.reply.records]
    return []


def serves(process: Process) -> bool:
    """Tell whether a process takes calls."""
    closes = any(isinstance(call.event, said.CloseCalled) for call in process.calls.values())
    return process.state is State.RUNS and process.joined and not closes


def next_due(process: Process, *, urgent: bool) -> tuple[float, Any] | None:
    """Return the time and the key of the next timer, or query that takes its time."""
    dues = [
        (alarm.due, key)
        for key, alarm in process.alarms.items()
        if not urgent or alarm.kind in URGENT
    ]
    dues += [(due, key) for key, (_, due) in process.queries.items()]
    return min(dues, key=lambda entry: (entry[0], str(entry[1])), default=None)
