"""The search of a whole small world: many states at a time, as rows of numbers.

A state is a row: the numbers of the local states of its machines, each a process with what is on
its way to it, and the number of the rest, such as the calls to come. A world of millions of states
has thousands of local states, in all combinations that the network can make of them. So a sweep
learns each move of a local state once, as a rule of `Rules`, by a step of `Exploration`, and
applies it to all rows that it fits at once. Of a state that was met, only a hash of 64 bits is
kept, and, in a file, which state and move led to it.

Nothing is lost by that:

- Two rows to which a rule applies agree in all that its move reads; see `Rules`.
- What an answer promises depends on the other processes as well, but only on their writes, on what
  is on their disks and on whether they are about to end. It is checked once for each combination
  of these.
- Two states with one hash would be taken for one. With ten million states the chance that there is
  any such pair is one in 300 000; with a billion, one in 40.

No order is left out. To make only the moves of one replica in a state would be sound if nothing
that the others may still do could come before them; but any other may send something to it or
crash, and its links may be cut.

Tests compare it with the search that makes each move by itself, also on cores with faults.
Worlds that take longer than a test may are explored by
``python -m tests.params.simulation --explore NAME…``.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

import numpy as np

from .exploration import Exploration
from .local_states import LocalStates
from .rules import (
    ADVANCE,
    CALL,
    CRASH,
    HAPPEN,
    LOSE,
    START,
    TURN,
    BrokenBy,
    Rest,
    Rests,
    Rules,
)
from .scripts import Script
from .search import Result
from .states import Move, State, story_of
from .tables import Array, Hashes, Index, hashes_of
from .violation import Violation

ROWS: Final = 50_000
"""Rows that are worked on at a time."""

_PARENT: Final = np.dtype([("number", np.uint32), ("rule", np.uint32)])


class _Choices(NamedTuple):
    """Kinds of moves of rows: the row, the kind, the machine or the pair, and what it reads."""

    row: Array
    kind: Array
    machine: Array
    key: Array


class Sweep:
    """The search of a whole small world.

    Args:
        script: The small world.
    """

    def __init__(self, script: Script) -> None:
        self.result = Result()
        self._exploration = exploration = Exploration(script)
        self._count = len(exploration.machines)
        self._locals = LocalStates(exploration)
        self._rests = Rests(exploration)
        self._rules = Rules(exploration, self._locals, self._rests)
        self._ranges = Index()
        self._met, self._judged = Hashes(), Hashes()
        self._parents = tempfile.TemporaryFile()  # noqa: SIM115  # closed with the sweep

    def run(self, most: int, tell: Callable[[Result, int], object]) -> Result:
        """Search until all is explored, or a number of states was met."""
        begun, result = time.monotonic(), self.result
        stack: list[tuple[Array, Array]] = []
        told = 0
        try:
            stack.append(self._first())
            while stack and result.states < most:
                numbers, rows = stack.pop()
                while stack and len(rows) < ROWS // 4:
                    more = stack.pop()
                    numbers, rows = (
                        np.concatenate([numbers, more[0]]),
                        np.concatenate([rows, more[1]]),
                    )
                if len(rows) > ROWS:
                    stack.append((numbers[ROWS:], rows[ROWS:]))
                    numbers, rows = numbers[:ROWS], rows[:ROWS]
                found = self._expand(numbers, rows)
                if len(found[0]):
                    stack.append(found)
                result.seconds = time.monotonic() - begun
                if result.states - told >= 1_000_000:
                    told = result.states
                    tell(result, sum(len(entry[0]) for entry in stack))
        except _Finding as finding:
            result.finding = self._story(finding)
        except Violation as violation:
            result.finding = str(violation)  # before the first state
        result.finished = not stack and not result.finding
        result.processes = len(self._exploration.stage.states)
        result.locals = self._locals.size
        result.steps = self._exploration.stage.steps
        result.seconds = time.monotonic() - begun
        self._parents.close()
        return result

    # Rows and states

    def _first(self) -> tuple[Array, Array]:
        state = self._exploration.first()
        items = self._exploration.items
        row = [
            self._locals.of(process, [n for n in state.pending if items[n].zid.startswith(machine)])
            for process, machine in zip(state.processes, self._exploration.machines, strict=True)
        ]
        rest = Rest(
            *(state.now, state.lives, state.disks, state.ended),
            *(state.cuts, state.left, state.budget, state.lossless),
        )
        rows = np.array([[*row, self._rests.of(rest)]], np.int64)
        self._met.add(hashes_of(*rows.T))
        self._parents.write(np.zeros(1, _PARENT).tobytes())
        self.result.states = 1
        return np.zeros(1, np.int64), rows

    def _state_of(self, row: Array) -> State:
        rest = self._rests[row[-1]]
        locals_ = [self._locals[number] for number in row[:-1].tolist()]
        return State(
            rest.now,
            tuple(local.process for local in locals_),
            rest.lives,
            rest.disks,
            rest.ended,
            tuple(sorted(item for local in locals_ for item in local.items)),
            rest.cuts,
            rest.left,
            rest.budget,  # type: ignore[arg-type]
            rest.lossless,
        )

    # One round: the moves of many rows

    def _expand(self, numbers: Array, rows: Array) -> tuple[Array, Array]:
        """Make all moves of some rows; return the rows that are new, and their numbers."""
        choices = self._choices(rows)
        result = self._finish(numbers, rows, choices)
        ranges = self._ranges_of(numbers, rows, choices)
        count = self._rules.ranges["count"][ranges]
        begin = np.cumsum(count) - count
        rules = np.repeat(self._rules.ranges["start"][ranges] - begin, count)
        rules += np.arange(len(rules))
        row = np.repeat(choices.row, count)
        result.moves += len(row)
        self._judge(numbers, rows, row, rules)
        after = self._apply(rows, row, rules)
        new = self._met.add(hashes_of(*after.T))
        parents = np.empty(len(new), _PARENT)
        parents["number"], parents["rule"] = numbers[row[new]], rules[new]
        self._parents.write(parents.tobytes())
        start = result.states
        result.states += len(new)
        return np.arange(start, result.states), after[new]

    def _finish(self, numbers: Array, rows: Array, choices: _Choices) -> Result:
        """Let the quiet time follow where nothing is left to happen."""
        result = self.result
        goes_on = np.zeros(len(rows), bool)
        goes_on[choices.row] = True
        for end in np.nonzero(~goes_on)[0]:
            state = self._state_of(rows[end])
            result.ends += 1
            result.finals.add(self._exploration.form_of(state))
            try:
                self._exploration.finish(state)
            except Violation as violation:
                raise _Finding(violation, int(numbers[end]), None) from None
        return result

    def _choices(self, rows: Array) -> _Choices:
        """Return what may be next in each row; see `Exploration.successors`."""
        count, facts, rests = self._count, self._locals.facts, self._rests.facts
        rest, every = rows[:, count], np.arange(len(rows))
        locals_ = [rows[:, machine] for machine in range(count)]
        faces = [facts["face"][local] for local in locals_]
        budget, world = rests["budget"][rest], rests["world"][rest]
        waits = [facts["waits"][local] for local in locals_]
        goes_on = np.logical_or.reduce([rests["calls"][rest], *waits])
        parts: list[_Choices] = []

        def add(kind: int, machine: int, row: Array, *read: Array) -> None:
            key = hashes_of(np.full(len(row), kind << 8 | machine), *read)
            parts.append(_Choices(row, np.full(len(row), kind), np.full(len(row), machine), key))

        dues = np.column_stack([facts["due"][local] for local in locals_])
        owns = np.logical_or.reduce([facts["own"][local] for local in locals_])
        first = dues.argmin(axis=1)
        fires = (budget[:, 3] > 0) & ~owns & np.isfinite(dues[every, first])
        for machine, local in enumerate(locals_):
            zid = facts["zid"][local]
            seen = world.copy()
            taken = np.zeros(len(rows), np.uint64)
            for other in range(count):
                if other != machine:
                    seen = seen << 12 | faces[other]
                    taken |= self._locals.asked_by(zid, locals_[other])
            read = hashes_of(seen, taken, local)

            def of(kind: int, row: Array, *more: Array) -> None:
                add(kind, machine, row, read[row], *more)  # noqa: B023  # called at once

            of(HAPPEN, np.nonzero(waits[machine])[0])
            of(LOSE, np.nonzero(facts["loses"][local] & (budget[:, 2] > 0))[0])
            call = rests["call"][rest, machine]
            row = np.nonzero((call >= 0) & facts["serves"][local])[0]
            of(CALL, row, call[row])
            of(ADVANCE, np.nonzero(fires & (first == machine))[0])
            is_there = facts["process"][local] > 0
            of(CRASH, np.nonzero(is_there & goes_on & (budget[:, 1] > 0))[0])
            # The checks note what the others hold when a process starts.
            row = np.nonzero(~is_there)[0]
            add(START, machine, row, rest[row], *(facts["process"][each[row]] for each in locals_))
        for pair in range(len(self._rests.pairs)):
            row = np.nonzero(goes_on & (rests["cut"][rest, pair] | (budget[:, 0] > 0)))[0]
            add(TURN, pair, row, world[row], *(face[row] for face in faces))
        return _Choices(*(np.concatenate(part) for part in zip(*parts, strict=True)))

    def _ranges_of(self, numbers: Array, rows: Array, choices: _Choices) -> Array:
        """Return the range of the rules of each choice; learn those that are new."""
        ranges = self._ranges.of(choices.key)
        missing = np.nonzero(ranges < 0)[0]
        if len(missing):
            keys, first, place = np.unique(
                choices.key[missing], return_index=True, return_inverse=True
            )
            made = np.zeros(len(keys), np.int64)
            for index, at in enumerate(missing[first].tolist()):
                row, kind = rows[choices.row[at]], int(choices.kind[at])
                machine = int(choices.machine[at])
                try:
                    made[index] = self._rules.learn(
                        self._state_of(row), row[:-1].tolist(), kind, machine
                    )
                except BrokenBy as broken:
                    number = int(numbers[choices.row[at]])
                    raise _Finding(broken.violation, number, broken.move) from None
            self._ranges.put(keys, made)
            ranges[missing] = made[place]
        return ranges

    def _judge(self, numbers: Array, rows: Array, row: Array, rules: Array) -> None:
        """Check what answers promise, where that has not been done."""
        answers = self._rules.facts["answers"][rules]
        at = np.nonzero(answers)[0]
        if not len(at):
            return
        facts, machine = self._locals.facts, self._rules.facts["machine"][rules[at]]
        judged = [
            np.where(machine == other, 0, facts["judged"][rows[row[at], other]])
            for other in range(self._count)
        ]
        view = self._rests.facts["view"][rows[row[at], self._count]]
        for index in at[self._judged.add(hashes_of(answers[at], view, *judged))].tolist():
            move = self._rules.move(rules[index])
            try:
                self._exploration.make(self._state_of(rows[row[index]]), move)
            except Violation as violation:
                raise _Finding(violation, int(numbers[row[index]]), move) from None

    def _apply(self, rows: Array, row: Array, rules: Array) -> Array:
        """Return the row after each move."""
        count, facts = self._count, self._rules.facts
        after = rows[row]
        local = facts["local"][rules]
        moves = np.nonzero(local >= 0)[0]
        after[moves, facts["machine"][rules[moves]]] = local[moves]
        for machine in range(count):
            more = facts["more"][rules, machine]
            at = np.nonzero(more)[0]
            after[at, machine] = self._locals.with_more(after[at, machine], more[at])
        change = facts["change"][rules]
        at = np.nonzero(change)[0]
        after[at, count] = self._rests.after(after[at, count], change[at])
        for machine in range(count):
            at = np.nonzero(self._locals.facts["looks"][after[:, machine]])[0]
            faces = [self._locals.facts["face"][after[at, other]] for other in range(count)]
            cuts = self._rests.facts["cuts"][after[at, count], machine]
            after[at, machine] = self._locals.without_looks(after[at, machine], faces, cuts)
        return after

    # Findings

    def _story(self, finding: _Finding) -> str:
        moves = [*self._path(finding.number), *([finding.move] if finding.move else [])]
        state, told = self._exploration.first(), []
        for move in moves[: len(moves) - bool(finding.move)]:
            draft = self._exploration.make(state, move, judges=False)
            told += draft.told
            state = self._exploration.freeze(draft)
        return f"{finding.violation}\nafter:\n{story_of(told)}"

    def _path(self, number: int) -> Iterator[Move]:
        """Return the moves that led to a state."""
        rules: list[int] = []
        while number:
            self._parents.seek(number * _PARENT.itemsize)
            parent = np.frombuffer(self._parents.read(_PARENT.itemsize), _PARENT)[0]
            rules.append(int(parent["rule"]))
            number = int(parent["number"])
        return (self._rules.move(rule) for rule in reversed(rules))


class _Finding(Exception):
    """What does not hold, in which state, and after which move of it."""

    def __init__(self, violation: Violation, number: int, move: Move | None) -> None:
        super().__init__(str(violation))
        self.violation, self.number, self.move = violation, number, move


def sweep(
    script: Script, most: int = 1 << 40, tell: Callable[[Result, int], object] = lambda *_: None
) -> Result:
    """Explore all that may happen in a small world, up to a number of states.

    Args:
        script: The small world.
        most: Number of states to stop at.
        tell: Function called from time to time, with the result so far and the number of states
            that wait.
    """
    return Sweep(script).run(most, tell)
