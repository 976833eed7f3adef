"""All orders in which little can happen.

An exploration begins with a few replicas that know each other. From there it tries everything that
may happen next: each message and each token may arrive first, each disk may be done, the next timer
may fire before any of them, the next call may be made, a link may be cut and a process may crash.
From each state in which nothing is left to happen, a quiet time follows.

A state of the world is the numbers of the states of its processes and of what is on its way, so
that worlds that are alike are explored once. They are alike whatever the numbers of queries, and
whatever led to them, except for what the checks remember of it. No two replicas are exchangeable:
the core heeds which one is older.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

from rosz.params.replica.core import events as said

from .checks import Checks
from .copies import Form, clone
from .disk import Disk
from .process import Process
from .scripts import Script, Step
from .stage import Reaction, Sent, Stage, next_due, serves
from .states import Draft, Item, Move, State, Told, story_of
from .violation import Violation
from .world import World

_QUIET = 45.0
_LIMIT = 2.0


class Exploration:
    """All that may happen in a small world.

    Args:
        script: The small world.
    """

    def __init__(self, script: Script) -> None:
        self.script = script
        self.stage = Stage(script.setting)
        self.machines = self.stage.machines
        self._judge = World(script.setting)
        self.items: list[Item] = [Item("none", "")]
        self._numbers: dict[Any, int] = {}
        self._item_of: dict[tuple[int, str, str], tuple[int, said.Event]] = {}
        self._reactions: dict[Any, Reaction] = {}
        self._disks: list[Disk | None] = [None]
        self._calm: set[int] = set()
        self._judged: set[int] = set()

    def first(self) -> State:
        """Return the state in which all replicas know each other, and have written once."""
        script = self.script
        count = len(self.machines)
        none = (0,) * count
        disks = tuple(
            self._number_of_disk(self.stage.disks.get(machine)) for machine in self.machines
        )
        budget = (script.cuts, script.crashes, script.losses, script.advances)
        left = tuple(range(len(script.steps)))
        draft = Draft(
            State(100.0, none, none, disks, (), (), frozenset(), left, budget, lossless=True)
        )
        for index in range(count):
            self._start(draft, index)
            self._settle(draft, 3.0)
        for machine in sorted({step.machine for step in script.steps}):
            self._call(draft, self.machines.index(machine), -1)
            self._settle(draft, 3.0)
        draft.told = []
        return self.freeze(draft)

    # States

    def _process(self, draft: Draft, index: int) -> Process | None:
        number = draft.processes[index]
        return self.stage.states[number] if number else None

    def _at(self, draft: Draft, zid: str) -> int:
        """Return the index of the machine of a process that runs; -1 if it does not."""
        index = self.machines.index(zid[0])
        process = self._process(draft, index)
        return index if process is not None and process.zid == zid else -1

    def freeze(self, draft: Draft) -> State:
        """Return the state that a draft became."""
        pending = [number for number in draft.pending if self._matters(draft, number)]
        draft.pending = sorted(pending)
        return State(
            draft.now,
            tuple(draft.processes),
            tuple(draft.lives),
            tuple(draft.disks),
            draft.ended,
            tuple(draft.pending),
            draft.cuts,
            draft.left,
            tuple(draft.budget),  # type: ignore[arg-type]
            draft.lossless,
        )

    def form_of(self, state: State) -> int:
        """Return a hash of a state that heeds none of the numbers of this exploration."""
        states = self.stage.states
        return hash(
            (
                state._replace(processes=(), disks=(), ended=(), pending=()),
                tuple([Form().of(states[number]) if number else 0 for number in state.processes]),
                frozenset((states[n].zid, Form().of(states[n].core.history)) for n in state.ended),
                tuple([Form().of(self._disks[number]) for number in state.disks]),
                len(state.pending),
            )
        )

    def _matters(self, draft: Draft, number: int) -> bool:
        """Tell whether something on its way can change anything.

        A look that shows nothing new does not: whatever changes makes others look again.
        """
        item = self.items[number]
        index = self._at(draft, item.zid)
        if index < 0:
            return False
        if item.kind != "look":
            return True
        process = self.stage.states[draft.processes[index]]
        other, linked = self._look(draft, process, item.source)
        seed, member = (other.seed and linked, other.token and linked) if other else (False, False)
        is_known = item.source in process.seeds
        watched = process.watching and member != (item.source in process.members)
        return seed != is_known or watched

    def _look(self, draft: Draft, process: Process, zid: str) -> tuple[Process | None, bool]:
        """Return another process if it runs, and whether both are linked."""
        index = self._at(draft, zid)
        other = self._process(draft, index) if index >= 0 else None
        here, there = process.machine, zid[0]
        return other, (here, there) not in draft.cuts and (there, here) not in draft.cuts

    def _number(self, item: Item) -> int:
        """Return the number of something on its way."""
        form = (item.kind, item.zid, item.source, item.number, Form().of(item.event))
        number = self._numbers.get(form)
        if number is None:
            number = self._numbers[form] = len(self.items)
            self.items.append(item)
        return number

    def _number_of_disk(self, disk: Disk | None) -> int:
        if disk is None:
            return 0
        form = Form().of(disk)
        for number, other in enumerate(self._disks):
            if other is not None and Form().of(other) == form:
                return number
        self._disks.append(disk)
        return len(self._disks) - 1

    # Steps of processes

    def _react(self, draft: Draft, index: int, key: Any, do: Callable[[Process], object]) -> None:
        """Let a process do something, and carry out what comes of it."""
        number = draft.processes[index]
        process = self.stage.states[number]
        taken = tuple(
            query[1]
            for query in (self.items[item].query for item in draft.pending)
            if query is not None and query[0] == process.zid
        )
        full = number, key, draft.now, taken
        reaction = self._reactions.get(full)
        if reaction is None:
            reaction = self._reactions[full] = self.stage.react(process, draft.now, taken, do)
        self._carry_out(draft, index, reaction)

    def _carry_out(self, draft: Draft, index: int, reaction: Reaction) -> None:
        draft.told += reaction.told
        draft.answers = draft.answers or bool(reaction.asked)
        if reaction.asked and draft.judges:
            self._judge_answers(draft, index, reaction)
        draft.processes[index] = reaction.after
        process = self.stage.states[reaction.after]
        for sent in reaction.sent:
            self._carry(draft, index, process, sent)

    def _judge_answers(self, draft: Draft, index: int, reaction: Reaction) -> None:
        """Check what the answers of a process promise, given what all others have."""
        others = tuple(other for at, other in enumerate(draft.processes) if at != index)
        case = id(reaction), others, draft.ended, draft.cuts, draft.lossless, draft.now
        if hash(case) in self._judged:
            return
        for asked in reaction.asked:
            judge = self._set_up(draft, asked.process)
            judge.checks.answers.on_answer(asked.process, asked.answer, asked.effects)
        self._judged.add(hash(case))

    def _carry(self, draft: Draft, index: int, process: Process, sent: Sent) -> None:
        zid, others = process.zid, self._others(draft, index)
        if sent.kind in {"one", "query"}:
            others = [other for other in others if other.zid == sent.target]
        if sent.kind == "end":
            draft.processes[index] = 0
            draft.disks[index] = self._number_of_disk(process.disk)
            draft.ended = tuple(sorted({*draft.ended, self._remains(process)}))
        if sent.kind in {"end", "show"}:
            for other in others:
                self._add(draft, Item("look", other.zid, zid))
        elif sent.kind in {"finish", "report"}:
            self._add(draft, Item(sent.kind, zid, number=sent.number))
        elif sent.kind == "own":
            self._send(draft, zid, sent.event, "")
        elif sent.kind == "query" and not others:
            self._send(draft, zid, said.QueryEnded(sent.number, None), "")
        for other in others if sent.kind in {"one", "all", "query"} else ():
            if (process.machine, other.machine) in draft.cuts:
                draft.lossless = False
            else:
                self._send(draft, other.zid, sent.event, zid)

    def _add(self, draft: Draft, item: Item) -> None:
        number = self._number(item)
        draft.added.append(number)
        if number not in draft.pending:
            draft.pending.append(number)

    def _send(self, draft: Draft, zid: str, event: said.Event, source: str) -> None:
        place = id(event), zid, source
        if place not in self._item_of:
            query: tuple[str, int] | None = None
            if isinstance(event, said.QueryEnded):
                query = zid, event.number
            elif isinstance(event, (said.SyncReceived, said.WritesReceived)):
                query = self.stage.asker(event.query)
            # The event is kept, and so its id is not given to another one.
            number = self._number(Item("deliver", zid, source, event, 0, query))
            self._item_of[place] = number, event
        draft.added.append(self._item_of[place][0])
        draft.pending.append(self._item_of[place][0])

    def _others(self, draft: Draft, index: int) -> list[Process]:
        every = (self._process(draft, other) for other in range(len(self.machines)))
        return [other for at, other in enumerate(every) if other is not None and at != index]

    def _remains(self, process: Process) -> int:
        """Return the number of a process that ended, of which only its writes matter."""
        form = "ended", process.zid, Form().of(process.core.history)
        if form not in self._numbers:
            self._numbers[form] = len(self.stage.states)
            self.stage.states.append(process)
        return self._numbers[form]

    def _set_up(self, draft: Draft, *replaced: Process) -> World:
        """Return the world of a state, for checks that need all of it."""
        judge = self._judge
        every = [self.stage.states[number] for number in draft.processes if number]
        running = {process.machine: process for process in every}
        running |= {process.machine: process for process in replaced}
        ended = {self.stage.states[number].zid: self.stage.states[number] for number in draft.ended}
        judge.now, judge.running, judge.cuts = draft.now, running, set(draft.cuts)
        judge.processes = ended | {process.zid: process for process in running.values()}
        judge.lossless = draft.lossless
        return judge

    # What may be next

    def successors(self, state: State) -> Iterator[tuple[Move, State, Told]]:
        """Yield each thing that may be next, the state after it, and what happens."""
        for move in self._moves(state):
            draft = self.make(state, move)
            yield move, self.freeze(draft), draft.told

    def _moves(self, state: State) -> Iterator[Move]:
        """Yield what may be next."""
        may_advance = bool(state.budget[3])
        for number in dict.fromkeys(state.pending):
            item = self.items[number]
            yield Move("happen", number)
            # What a machine finds out about itself is there before the next timer.
            may_advance = may_advance and not item.is_own
            if state.budget[2] and item.can_be_lost:
                yield Move("lose", number)
        machines = {self.script.steps[call].machine for call in state.left}
        for index, number in enumerate(state.processes):
            if number and self.machines[index] in machines and serves(self.stage.states[number]):
                yield Move("call", index)
        if may_advance and self.next_timer(state.processes, urgent=True) is not None:
            yield Move("advance")
        yield from self._faults(state)

    def _faults(self, state: State) -> Iterator[Move]:
        goes_on = bool(state.left or state.pending)
        for one, other in itertools.combinations(range(len(self.machines)), 2):
            is_cut = (self.machines[one], self.machines[other]) in state.cuts
            if (is_cut or state.budget[0]) and goes_on:
                yield Move("turn", one, other)
        for index, number in enumerate(state.processes):
            if not number:
                yield Move("start", index)
            elif state.budget[1] and goes_on:
                yield Move("crash", index)

    def make(self, state: State, move: Move, *, judges: bool = True) -> Draft:
        """Make a move.

        Args:
            state: The state before.
            move: The move.
            judges: Whether to check what answers promise.
        """
        draft = Draft(state)
        draft.judges = judges
        match move.kind:
            case "happen":
                self._happen(draft, move.what)
            case "lose":
                item = self.items[move.what]
                draft.budget[2] -= 1
                draft.lossless = False
                draft.pending.remove(move.what)
                draft.told = [(item.zid, f"-- does not get {item.event!r:.200}")]
            case "call":
                self._call_next(draft, move.what)
            case "advance":
                draft.budget[3] -= 1
                self._advance(draft, urgent=True)
            case "turn":
                one, other = self.machines[move.what], self.machines[move.other]
                draft.budget[0] -= (one, other) not in draft.cuts
                self._turn(draft, one, other)
            case "start":
                self._start(draft, move.what)
            case "crash":
                draft.budget[1] -= 1
                self._crash(draft, move.what)
        return draft

    # What happens

    def _happen(self, draft: Draft, number: int) -> None:
        """Let something that is on its way happen."""
        draft.pending.remove(number)
        item = self.items[number]
        index = self._at(draft, item.zid)
        if index < 0:
            return
        stage, process = self.stage, self.stage.states[draft.processes[index]]
        if item.kind == "finish":
            self._react(draft, index, number, stage.finish)
            disk = self.stage.states[draft.processes[index]].disk
            if disk is not None and disk.pending:
                self._add(draft, item)
        elif item.kind == "look":
            other, linked = self._look(draft, process, item.source)
            if other is None:
                other = stage.named[item.source]
                linked = False
            shown = (other.member.start, other.seed and linked, other.token and linked)
            do = partial(stage.look, other=other, linked=linked)
            self._react(draft, index, (number, shown), do)
        elif item.kind == "report":
            if process.watch == item.number:
                seen = [
                    other
                    for other in self._others(draft, index)
                    if other.token and self._look(draft, process, other.zid)[1]
                ]
                key = number, tuple((other.zid, other.member.start) for other in seen)
                do = partial(stage.report, watch=item.number, others=seen)
                self._react(draft, index, key, do)
        elif item.source and (item.source[0], process.machine) in draft.cuts:
            draft.lossless = False
        else:
            self._react(draft, index, number, partial(stage.take, event=item.event))

    def _call_next(self, draft: Draft, index: int) -> None:
        machine = self.machines[index]
        call = next(call for call in draft.left if self.script.steps[call].machine == machine)
        draft.left = tuple(other for other in draft.left if other != call)
        self._call(draft, index, call)

    def _call(self, draft: Draft, index: int, call: int) -> None:
        """Let a process make a call; -1 is the one before all others."""
        machine = self.machines[index]
        step = self.script.steps[call] if call >= 0 else Step(machine, ("w", machine))
        process = self.stage.states[draft.processes[index]]
        event: said.Event
        if step.path:
            # Each call has stamps of its own, whatever the order.
            stamp = process.wall(draft.now) + 1000 * call, process.zid
            changes = [(step.path, step.value)]
            event = said.WriteCalled(1000 + call, changes, process.label, stamp, timeout=_LIMIT)
        else:
            event = said.CloseCalled(1000 + call)
        limit = _LIMIT if step.path else 1.0
        do = partial(self.stage.ask, event=event, limit=limit)
        self._react(draft, index, ("call", call), do)

    def next_timer(
        self, processes: Sequence[int], *, urgent: bool
    ) -> tuple[float, Any, int] | None:
        """Return the time and the key of the next timer of all, and the index of its machine."""
        dues = [
            (*due, index)
            for index, number in enumerate(processes)
            if number and (due := next_due(self.stage.states[number], urgent=urgent))
        ]
        return min(dues, key=lambda entry: (entry[0], entry[2]), default=None)

    def _advance(self, draft: Draft, *, urgent: bool, until: float = float("inf")) -> bool:
        """Let the next timer fire; return whether there is one."""
        timer = self.next_timer(draft.processes, urgent=urgent)
        if timer is None or timer[0] > until:
            return False
        due_at, key, index = timer
        draft.now = max(draft.now, due_at)
        self._react(draft, index, ("fire", key), partial(self.stage.fire, key=key))
        return True

    def _turn(self, draft: Draft, one: str, other: str) -> None:
        """Cut a link, or mend it."""
        is_cut = (one, other) in draft.cuts
        draft.told = [(one, f"-- the link to {other} is {'mended' if is_cut else 'cut'}")]
        draft.cuts = draft.cuts ^ {(one, other), (other, one)}
        here, there = (self._process(draft, self.machines.index(name)) for name in (one, other))
        if here is not None and there is not None:
            self._add(draft, Item("look", here.zid, there.zid))
            self._add(draft, Item("look", there.zid, here.zid))

    def _crash(self, draft: Draft, index: int) -> None:
        process: Process = clone(self.stage.states[draft.processes[index]], {})
        if process.disk is not None:
            process.disk.crash()
        process.end()
        draft.told = [(process.zid, "-- crashes")]
        self._carry(draft, index, process, Sent("end"))

    def _start(self, draft: Draft, index: int) -> None:
        others = self._others(draft, index)
        disk = self._disks[draft.disks[index]]
        reaction = self.stage.boot(
            self.machines[index], draft.lives[index], disk, others, draft.cuts, draft.now
        )
        draft.lives[index] += 1
        draft.disks[index] = 0
        self._carry_out(draft, index, reaction)

    # The quiet time

    def _settle(self, draft: Draft, seconds: float, *, calm: bool = False) -> bool:
        """Let all happen in one order, for some time.

        Args:
            draft: The state.
            seconds: The time.
            calm: Whether to stop in a state that has come to rest before.

        Returns:
            Whether it did not stop.
        """
        until = draft.now + seconds
        passed: list[int] = []
        while True:
            state = self.freeze(draft)
            if calm:
                passed.append(hash(state))
                if passed[-1] in self._calm:
                    break
            if draft.pending:
                self._happen(draft, draft.pending[0])
            elif not self._advance(draft, urgent=False, until=until):
                draft.now = until
                self._calm.update(passed)
                return True
        self._calm.update(passed)
        return False

    def finish(self, state: State) -> None:
        """Mend everything, wait, and check what must hold then."""
        draft = Draft(state)
        draft.left, draft.budget = (), [0, 0, 0, 0]
        for one, other in itertools.combinations(self.machines, 2):
            if (one, other) in draft.cuts:
                self._turn(draft, one, other)
        for index, number in enumerate(state.processes):
            if not number:
                self._start(draft, index)
        draft.told = []
        try:
            if self._settle(draft, _QUIET, calm=True):
                Checks(self._set_up(draft)).on_quiet()
        except Violation as violation:
            raise Violation(f"{violation}\nin the quiet time:\n{story_of(draft.told)}") from None
