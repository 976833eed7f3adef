"""The moves of a small world, each learnt once for all states in which it reads the same."""

from __future__ import annotations

import itertools
from typing import Any, Final, NamedTuple

import numpy as np

from .exploration import Exploration
from .local_states import LocalStates
from .states import Draft, Move, State
from .tables import Array, Facts, Index, Numbers, looked_up
from .violation import Violation

KINDS: Final = ("happen", "lose", "call", "advance", "crash", "start", "turn")
HAPPEN, LOSE, CALL, ADVANCE, CRASH, START, TURN = range(7)


class Rest(NamedTuple):
    """What a state has beside its local states; see `State`."""

    now: float
    lives: tuple[int, ...]
    disks: tuple[int, ...]
    ended: tuple[int, ...]
    cuts: frozenset[tuple[str, str]]
    left: tuple[int, ...]
    budget: tuple[int, ...]
    lossless: bool


class _Change(NamedTuple):
    """What a move changes in a `Rest`, whatever else that holds."""

    now: float
    lives: tuple[int, ...]
    cuts: frozenset[tuple[str, str]]
    disks: tuple[tuple[int, int], ...]
    ended: tuple[int, ...]
    spent: tuple[int, ...]
    called: tuple[int, ...]
    loses: bool

    def apply(self, rest: Rest) -> Rest:
        disks = list(rest.disks)
        for index, disk in self.disks:
            disks[index] = disk
        return Rest(
            self.now,
            self.lives,
            tuple(disks),
            tuple(sorted({*rest.ended, *self.ended})),
            self.cuts,
            tuple(call for call in rest.left if call not in self.called),
            tuple(left - spent for left, spent in zip(rest.budget, self.spent, strict=True)),
            rest.lossless and not self.loses,
        )


class _Result(NamedTuple):
    """What a move makes of the process of a machine, and what it adds to what is on its way."""

    process: int
    added: tuple[tuple[int, ...], ...]
    change: int
    answers: int


class Rests:
    """What states have beside their local states, by number, and facts about it.

    Args:
        exploration: Explores the world.

    Attributes:
        facts: ``world``, the number of the time, the lives and the cuts; ``view``, that of what
            checks of answers depend on; ``call``, the next call of each machine, or -1; ``budget``;
            ``cut``, whether the link of each pair is cut; ``cuts``, whether those of each machine
            are, as bits; ``calls``, whether there are calls to come.
    """

    def __init__(self, exploration: Exploration) -> None:
        count = len(exploration.machines)
        self.pairs: list[tuple[int, int]] = list(itertools.combinations(range(count), 2))
        self._exploration = exploration
        self._numbers, self._worlds, self._views = Numbers(), Numbers(), Numbers()
        self._changes = Numbers(None)
        self._after = Index()
        self.facts = Facts(
            world=(np.int64, 0),
            view=(np.int64, 0),
            call=(np.int64, count),
            budget=(np.int64, 4),
            cut=(bool, len(self.pairs)),
            cuts=(np.int64, count),
            calls=(bool, 0),
        )

    def __getitem__(self, number: int) -> Rest:
        rest: Rest = self._numbers.things[number]
        return rest

    @property
    def size(self) -> int:
        """Number of them."""
        return self.facts.size

    def of(self, rest: Rest) -> int:
        """Return the number of one."""
        number = self._numbers.of(rest)
        if number == self.facts.size:
            machines, steps = self._exploration.machines, self._exploration.script.steps
            cut = [(machines[one], machines[other]) in rest.cuts for one, other in self.pairs]
            cuts = [0] * len(machines)
            for (one, other), is_cut in zip(self.pairs, cut, strict=True):
                cuts[one] |= is_cut << other
                cuts[other] |= is_cut << one
            self.facts.add(
                world=self._worlds.of((rest.now, rest.lives, rest.cuts)),
                view=self._views.of((rest.now, rest.ended, rest.cuts, rest.lossless)),
                call=[
                    next((call for call in rest.left if steps[call].machine == machine), -1)
                    for machine in machines
                ],
                budget=rest.budget,
                cut=cut,
                cuts=cuts,
                calls=bool(rest.left),
            )
        return number

    def change(self, state: State, draft: Draft) -> int:
        """Return the number of what a move changes; 0 if that is nothing."""
        disks = enumerate(zip(state.disks, draft.disks, strict=True))
        spent = zip(state.budget, draft.budget, strict=True)
        change = _Change(
            draft.now,
            tuple(draft.lives),
            draft.cuts,
            tuple((index, disk) for index, (before, disk) in disks if before != disk),
            draft.ended,
            tuple(before - after for before, after in spent),
            tuple(sorted(set(state.left) - set(draft.left))),
            not draft.lossless,
        )
        none = _Change(state.now, state.lives, state.cuts, (), (), (0, 0, 0, 0), (), loses=False)
        return 0 if change == none else self._changes.of(change)

    def after(self, rests: Array, changes: Array) -> Array:
        """Return what becomes of some of them by changes."""

        def made(key: int) -> int:
            change: _Change = self._changes.things[key & 0xFFFFFFFF]
            return self.of(change.apply(self[key >> 32]))

        return looked_up(self._after, rests.astype(np.int64) << 32 | changes, made)


class Rules:
    """The moves that were learnt.

    A rule is found by all that its move reads: the local state of the machine, the time, the
    lives and the cuts, what the others show, and which numbers of queries are taken; where a
    process starts, the states of all others. Two states that agree in these differ in nothing
    that the code of the move can see, so its effects are the same.

    Args:
        exploration: Explores the world.
        locals_: Its local states.
        rests: What its states have beside them.

    Attributes:
        facts: ``machine``; ``local``, its local state after the move, or -1 if that stays;
            ``more``, what is sent to each machine, which are numbers of bundles; ``change``, that
            of the rest; ``answers``, the number of the answers to judge, or 0; ``code``, a number
            that tells the move.
        ranges: ``start`` and ``count`` of the rules of what has the same key.
    """

    def __init__(self, exploration: Exploration, locals_: LocalStates, rests: Rests) -> None:
        self._exploration, self._locals, self._rests = exploration, locals_, rests
        self._results: dict[Any, _Result] = {}
        self._answers = 0
        self._machines = range(len(exploration.machines))
        self.facts = Facts(
            machine=(np.int64, 0),
            local=(np.int64, 0),
            more=(np.int64, len(self._machines)),
            change=(np.int64, 0),
            answers=(np.int64, 0),
            code=(np.int64, 0),
        )
        self.ranges = Facts(start=(np.int64, 0), count=(np.int64, 0))

    def learn(self, state: State, row: list[int], kind: int, machine: int) -> int:
        """Learn moves of a kind.

        Args:
            state: The state before.
            row: Its local states.
            kind: The kind.
            machine: Index of the machine, or of the pair of machines.

        Returns:
            Number of the range of the rules.

        Raises:
            BrokenBy: Something does not hold after one of them.
        """
        start = self.facts.size
        if kind in (HAPPEN, LOSE):
            every = self._exploration.items
            for what in dict.fromkeys(self._locals[row[machine]].items):
                if kind == HAPPEN or every[what].can_be_lost:
                    self._add(state, row, kind, machine, what)
        else:
            self._add(state, row, kind, machine, machine)
        self.ranges.add(start=start, count=self.facts.size - start)
        return self.ranges.size - 1

    def move(self, rule: int) -> Move:
        """Return the move of a rule."""
        kind, what = divmod(int(self.facts["code"][rule]), 1 << 32)
        if kind == TURN:
            return Move("turn", *self._rests.pairs[what])
        return Move(KINDS[kind], what)

    def _add(self, state: State, row: list[int], kind: int, machine: int, what: int) -> None:
        result = self._result(state, row, kind, machine, what)
        local, more = -1, [self._locals.bundle(added) for added in result.added]
        if kind != TURN:
            items = list(self._locals[row[machine]].items)
            if kind in (HAPPEN, LOSE):
                items.remove(what)
            local = self._locals.of(result.process, (*items, *result.added[machine]))
            more[machine] = 0
        self.facts.add(
            machine=machine,
            local=local,
            more=more,
            change=result.change,
            answers=result.answers,
            code=kind << 32 | what,
        )

    def _result(self, state: State, row: list[int], kind: int, machine: int, what: int) -> _Result:
        """Return what a move does, whatever else is on its way."""
        faces = self._locals.facts["face"][row].tolist()
        taken: list[Any] = []
        if kind == START:
            taken = [state.disks, state.processes]
        elif kind == CALL:
            taken = [next(call for call in state.left if self._is_of(call, machine))]
        if kind != TURN:
            faces[machine] = state.processes[machine]
            zid = self._zid(state.processes[machine])
            pending = list(state.pending)
            if kind in (HAPPEN, LOSE):
                pending.remove(what)
            queries = (self._exploration.items[item].query for item in pending)
            taken += sorted(query[1] for query in queries if query and query[0] == zid)
        key = kind, what, state.now, state.lives, state.cuts, *faces, *taken
        result = self._results.get(key)
        if result is None:
            result = self._results[key] = self._make(state, kind, machine, what)
        return result

    def _make(self, state: State, kind: int, machine: int, what: int) -> _Result:
        move = Move("turn", *self._rests.pairs[what]) if kind == TURN else Move(KINDS[kind], what)
        before = state._replace(ended=(), lossless=True)
        try:
            draft = self._exploration.make(before, move, judges=False)
        except Violation as violation:
            raise BrokenBy(violation, move) from None
        machines, items = self._exploration.machines, self._exploration.items
        added: list[list[int]] = [[] for _ in machines]
        for number in draft.added:
            added[machines.index(items[number].zid[0])].append(number)
        self._answers += draft.answers
        return _Result(
            0 if kind == TURN else draft.processes[machine],
            tuple(map(tuple, added)),
            self._rests.change(before, draft),
            self._answers if draft.answers else 0,
        )

    def _zid(self, process: int) -> str:
        return self._exploration.stage.states[process].zid if process else ""

    def _is_of(self, call: int, machine: int) -> bool:
        step = self._exploration.script.steps[call]
        return step.machine == self._exploration.machines[machine]


class BrokenBy(Exception):
    """What does not hold after a move."""

    def __init__(self, violation: Violation, move: Move) -> None:
        super().__init__(str(violation))
        self.violation, self.move = violation, move
