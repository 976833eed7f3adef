"""The search of a whole small world: many states at a time, as rows of numbers.

A search spends nearly all its time on moves that it has seen before: a world of a hundred thousand
states has a few hundred states of processes, in all combinations that the network can make of
them. A sweep therefore learns each move once, as a **rule**, by a step of `Exploration`, and
applies it to all rows that it fits at once. Of a state that was met, only a hash of 64 bits is
kept, and which state and move led to it.

Nothing is lost by that:

- A rule is found by all that its move reads: what arrives or is called, the state of the process,
  the time, who runs, which links are cut, and which numbers of queries are taken; where tokens are
  looked at, those of the others; where a process starts, the states of all others. Two rows that
  agree in these differ in nothing that the code of the move can see, so its effects are the same.
- What an answer promises depends on the other processes as well, but only on their writes, on what
  is on their disks and on whether they are about to end. It is checked once for each combination
  of these.
- Two states with one hash would be taken for one. With ten million states the chance that there is
  any such pair is one in 300 000.

A test compares it with the search that makes each move by itself. Worlds that take longer than a
test may are explored by ``python -m tests.params.simulation --explore NAME…``.
"""

from __future__ import annotations

import itertools
import time
from bisect import bisect_right
from collections.abc import Callable, Iterator
from typing import Any, Final, NamedTuple

import numpy as np

from .copies import Form
from .exploration import Exploration
from .scripts import Script
from .search import Result
from .stage import next_due, serves
from .states import Draft, Item, Move, State, story_of
from .tables import Array, Facts, Hashes, Numbers, hashes_of, mixed, stacked
from .violation import Violation

ROWS: Final = 30_000
"""Rows that are worked on at a time."""

_KINDS: Final = ("happen", "lose", "call", "advance", "turn", "crash", "start")
_HAPPEN, _LOSE, _CALL, _ADVANCE, _TURN, _CRASH, _START = range(7)
_EMPTY: Final = np.zeros(0, np.int64)


class _Rest(NamedTuple):
    """What a state has beside its processes and what is on its way; see `State`."""

    now: float
    lives: tuple[int, ...]
    disks: tuple[int, ...]
    ended: tuple[int, ...]
    cuts: frozenset[tuple[str, str]]
    left: tuple[int, ...]
    budget: tuple[int, ...]
    lossless: bool
    runs: tuple[bool, ...]


class _Change(NamedTuple):
    """What a move changes in a `_Rest`, whatever else that holds."""

    now: float
    lives: tuple[int, ...]
    cuts: frozenset[tuple[str, str]]
    runs: tuple[bool, ...]
    disks: tuple[tuple[int, int], ...]
    ended: tuple[int, ...]
    spent: tuple[int, ...]
    called: tuple[int, ...]
    loses: bool

    def apply(self, rest: _Rest) -> _Rest:
        disks = list(rest.disks)
        for index, disk in self.disks:
            disks[index] = disk
        return _Rest(
            self.now,
            self.lives,
            tuple(disks),
            tuple(sorted({*rest.ended, *self.ended})),
            self.cuts,
            tuple(call for call in rest.left if call not in self.called),
            tuple(left - spent for left, spent in zip(rest.budget, self.spent, strict=True)),
            rest.lossless and not self.loses,
            self.runs,
        )


class _Moves(NamedTuple):
    """Moves of rows: the row, the kind, what moves, its machine (-1 if none), and its column."""

    row: Array
    kind: Array
    what: Array
    machine: Array
    column: Array


class Sweep:
    """The search of a whole small world.

    Args:
        script: The small world.
    """

    def __init__(self, script: Script) -> None:
        self.result = Result()
        self._exploration = Exploration(script)
        self._count = count = len(self._exploration.machines)
        self._pairs = list(itertools.combinations(range(count), 2))
        self._zids, self._shown, self._judged_as = Numbers(), Numbers(), Numbers()
        self._rests, self._views, self._worlds = Numbers(), Numbers(), Numbers()
        self._changes = Numbers()
        self._rest_facts = Facts(
            world=(np.int64, 0),
            view=(np.int64, 0),
            call=(np.int64, count),
            budget=(np.int64, 4),
            cut=(bool, len(self._pairs)),
            calls=(bool, 0),
        )
        self._process_facts = Facts(
            zid=(np.int64, 0),
            serves=(bool, 0),
            due=(np.float64, 0),
            shown=(np.int64, 0),
            token=(np.int8, 0),
            judged=(np.int64, 0),
        )
        self._item_facts = Facts(
            zid=(np.int64, 0),
            machine=(np.int64, 0),
            source=(np.int64, 0),
            other=(np.int64, 0),
            look=(np.int64, 0),
            tells=(bool, 0),
            single=(bool, 0),
            own=(bool, 0),
            loses=(bool, 0),
            asker=(np.int64, 0),
            query=(np.int64, 0),
        )
        self._rules: dict[int, int] = {}
        self._rule_facts = Facts(
            process=(np.int64, 0), change=(np.int64, 0), answers=(bool, 0), added=(np.int64, 12)
        )
        self._rest_after: dict[int, int] = {}
        self._looks: list[Item] = []
        self._known = np.full((0, 0), -1, np.int8)
        self._met, self._judged = Hashes(), Hashes()
        self._parents: list[tuple[int, Array, Array]] = []

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
                    numbers, rows = np.concatenate([numbers, more[0]]), stacked(rows, more[1])
                if len(rows) > ROWS:
                    stack.append((numbers[ROWS:], rows[ROWS:]))
                    numbers, rows = numbers[:ROWS], rows[:ROWS]
                found = self._expand(numbers, rows)
                if len(found[0]):
                    stack.append(found)
                result.seconds = time.monotonic() - begun
                if result.states - told >= 100_000:
                    told = result.states
                    tell(result, sum(len(entry[0]) for entry in stack))
        except _Finding as finding:
            result.finding = self._story(finding)
        except Violation as violation:
            result.finding = str(violation)  # before the first state
        result.finished = not stack and not result.finding
        result.processes = len(self._exploration.stage.states)
        result.steps = self._exploration.stage.steps
        result.seconds = time.monotonic() - begun
        return result

    # Rows and states

    def _first(self) -> tuple[Array, Array]:
        state = self._exploration.first()
        self._learn()
        rest = self._number_of(
            _Rest(
                *(state.now, state.lives, state.disks, state.ended, state.cuts, state.left),
                *(state.budget, state.lossless, tuple(map(bool, state.processes))),
            )
        )
        row = np.array([[*state.processes, rest, *state.pending, 0]], np.int64)
        self._met.add(self._hash(row))
        self._parents.append((0, np.zeros(1, np.uint32), np.zeros(1, np.int64)))
        self.result.states = 1
        return np.zeros(1, np.int64), row

    def _state_of(self, row: Array) -> State:
        rest: _Rest = self._rests.things[row[self._count]]
        processes = tuple(int(number) for number in row[: self._count])
        pending = tuple(sorted(int(item) for item in row[self._count + 1 :] if item))
        return State(
            rest.now,
            processes,
            rest.lives,
            rest.disks,
            rest.ended,
            pending,
            rest.cuts,
            rest.left,
            rest.budget,  # type: ignore[arg-type]
            rest.lossless,
        )

    def _hash(self, rows: Array) -> Array:
        """Return hashes that do not heed the order of what is on its way."""
        count = self._count + 1
        salts = np.arange(1, count + 1, dtype=np.uint64) << np.uint64(40)
        fixed = mixed(rows[:, :count].astype(np.uint64) + salts)
        items = np.where(rows[:, count:] > 0, mixed(rows[:, count:].astype(np.uint64)), 0)
        total: Array = fixed.sum(axis=1, dtype=np.uint64) + items.sum(axis=1, dtype=np.uint64)
        return mixed(total)

    def _number_of(self, rest: _Rest) -> int:
        number = self._rests.of(rest)
        if number == self._rest_facts.size:
            machines, steps = self._exploration.machines, self._exploration.script.steps
            calls = [
                next((call for call in rest.left if steps[call].machine == machine), -1)
                for machine in machines
            ]
            self._rest_facts.add(
                world=self._worlds.of((rest.now, rest.lives, rest.cuts, rest.runs)),
                view=self._views.of((rest.now, rest.ended, rest.cuts, rest.lossless)),
                call=calls,
                budget=rest.budget,
                cut=[(machines[one], machines[other]) in rest.cuts for one, other in self._pairs],
                calls=bool(rest.left),
            )
        return number

    def _learn(self) -> None:
        """Note the facts about states of processes, and about items, that are new."""
        exploration = self._exploration
        states, items = exploration.stage.states, exploration.items
        while self._process_facts.size < len(states):
            process = states[self._process_facts.size]
            if not self._process_facts.size:  # no process
                none = {"zid": self._zids.of(""), "serves": False, "due": np.inf, "token": 0}
                self._process_facts.add(**none, shown=self._shown.of(None), judged=-1)
                continue
            due = next_due(process, urgent=True)
            closes = not serves(process) and process.joined
            self._process_facts.add(
                zid=self._zids.of(process.zid),
                serves=serves(process),
                due=due[0] if due else np.inf,
                shown=self._shown.of((process.token, process.seed, process.member.start)),
                token=process.seed | process.token << 1,
                judged=self._judged_as.of(
                    (process.zid, closes, Form().of((process.core.history, process.disk)))
                ),
            )
        while self._item_facts.size < len(items):
            item = items[self._item_facts.size]
            looks = item.kind == "look"
            if looks:
                self._looks.append(item)
            asker, query = item.query or ("none", 0)
            machine = exploration.machines.index(item.zid[0]) if item.zid else 0
            self._item_facts.add(
                zid=self._zids.of(item.zid),
                machine=machine,
                source=self._zids.of(item.source),
                other=exploration.machines.index(item.source[0]) if looks else 0,
                look=len(self._looks) - 1 if looks else -1,
                tells=item.kind == "report",
                single=item.kind != "deliver",
                own=item.is_own,
                loses=item.can_be_lost,
                asker=self._zids.of(asker),
                query=1 << query,
            )

    # One round: the moves of many rows

    def _expand(self, numbers: Array, rows: Array) -> tuple[Array, Array]:
        """Make all moves of some rows; return the rows that are new, and their numbers."""
        moves = self._moves(rows)
        result = self.result
        result.moves += len(moves.row)
        ends = np.setdiff1d(np.arange(len(rows)), moves.row)
        for end in ends:
            state = self._state_of(rows[end])
            result.ends += 1
            result.finals.add(self._exploration.form_of(state))
            try:
                self._exploration.finish(state)
            except Violation as violation:
                raise _Finding(violation, int(numbers[end]), None) from None
        self._learn()  # a quiet time meets states of processes as well
        if not len(moves.row):
            return _EMPTY, rows[:0]
        rules = self._find_rules(numbers, rows, moves)
        self._judge(numbers, rows, moves, rules)
        after = self._apply(rows, moves, rules)
        hashes, first = np.unique(self._hash(after), return_index=True)
        first = first[self._met.add(hashes)]
        start, size = result.states, len(first)
        result.states += size
        codes = moves.kind[first] << 40 | moves.what[first] << 8 | moves.machine[first] + 1
        self._parents.append((start, numbers[moves.row[first]].astype(np.uint32), codes))
        return np.arange(start, start + size), after[first]

    def _moves(self, rows: Array) -> _Moves:
        """Return what may be next in each row; see `Exploration.successors`."""
        count, items = self._count, rows[:, self._count + 1 :]
        rest, facts = rows[:, count], self._rest_facts
        budget, process = facts["budget"][rest], self._process_facts
        made: list[_Moves] = []

        def add(kind: int, row: Array, what: Any, machine: Any, column: Any = -1) -> None:
            sizes = (np.broadcast_to(value, len(row)) for value in (kind, what, machine, column))
            made.append(_Moves(row, *sizes))

        there = items > 0
        there[:, 1:] &= items[:, 1:] != items[:, :-1]
        row, column = np.nonzero(there)
        what = items[row, column]
        add(_HAPPEN, row, what, self._item_facts["machine"][what], column)
        row, column = np.nonzero(there & self._item_facts["loses"][items] & (budget[:, 2:3] > 0))
        what = items[row, column]
        add(_LOSE, row, what, self._item_facts["machine"][what], column)
        owns = (self._item_facts["own"][items] & (items > 0)).any(axis=1)
        dues = process["due"][rows[:, :count]]
        row = np.nonzero((budget[:, 3] > 0) & ~owns & np.isfinite(dues.min(axis=1)))[0]
        add(_ADVANCE, row, 0, dues[row].argmin(axis=1))
        goes_on = facts["calls"][rest] | (items > 0).any(axis=1)
        for pair, (one, _) in enumerate(self._pairs):
            may = goes_on & (facts["cut"][rest, pair] | (budget[:, 0] > 0))
            add(_TURN, np.nonzero(may)[0], pair, one)
        for machine in range(count):
            number, call = rows[:, machine], facts["call"][rest, machine]
            row = np.nonzero((call >= 0) & process["serves"][number])[0]
            add(_CALL, row, call[row], machine)
            add(_CRASH, np.nonzero((number > 0) & goes_on & (budget[:, 1] > 0))[0], 0, machine)
            add(_START, np.nonzero(number == 0)[0], 0, machine)
        return _Moves(*(np.concatenate(parts) for parts in zip(*made, strict=True)))

    def _find_rules(self, numbers: Array, rows: Array, moves: _Moves) -> Array:
        """Return the rule of each move; learn those that are new."""
        keys, place = np.unique(self._read(rows, moves), return_inverse=True)
        rules = np.zeros(len(keys), np.int64)
        unknown: list[int] = []
        for index, key in enumerate(keys.tolist()):
            rule = self._rules.get(key)
            if rule is None:
                unknown.append(index)
            else:
                rules[index] = rule
        if unknown:
            first = np.full(len(keys), -1)
            first[place[::-1]] = np.arange(len(place))[::-1]
            for index in unknown:
                at = int(first[index])
                rule = self._make_rule(numbers, rows, moves, at)
                rules[index] = self._rules[int(keys[index])] = rule
            self._learn()
        found: Array = rules[place]
        return found

    def _read(self, rows: Array, moves: _Moves) -> Array:
        """Return a hash of all that each move reads."""
        count, facts = self._count, self._item_facts
        number = rows[moves.row, moves.machine]
        number = np.where(moves.kind == _TURN, 0, number)
        rest = rows[moves.row, count]
        world = np.where(moves.kind == _START, rest, self._rest_facts["world"][rest])
        items = rows[moves.row, count + 1 :].copy()
        drops = np.nonzero(moves.column >= 0)[0]
        items[drops, moves.column[drops]] = 0
        zid = self._process_facts["zid"][number]
        taken = np.bitwise_or.reduce(
            np.where(facts["asker"][items] == zid[:, None], facts["query"][items], 0), axis=1
        )
        shown = self._process_facts["shown"][rows[moves.row, :count]]
        arrives = moves.kind == _HAPPEN
        what = np.where(arrives, moves.what, 0)
        looks = arrives & (facts["look"][what] >= 0)
        one = shown[np.arange(len(shown)), facts["other"][what]]
        shown[np.arange(len(shown)), moves.machine] = 0
        every = (shown << np.arange(count) * 16).sum(axis=1)
        seen = np.where(looks, one, np.where(arrives & facts["tells"][what], every, 0))
        # The checks note what the others hold when a process starts.
        whole = hashes_of(rows[moves.row, :count])
        seen = np.where(moves.kind == _START, whole.astype(np.int64), seen)
        parts = (moves.kind, moves.what, moves.machine, number, world, taken, seen)
        return hashes_of(np.column_stack(parts))

    def _make_rule(self, numbers: Array, rows: Array, moves: _Moves, at: int) -> int:
        row, machine = rows[moves.row[at]], int(moves.machine[at])
        move = self._move(int(moves.kind[at]), int(moves.what[at]), machine)
        state = self._state_of(row)._replace(ended=(), lossless=True)
        try:
            draft = self._exploration.make(state, move, judges=False)
        except Violation as violation:
            raise _Finding(violation, int(numbers[moves.row[at]]), move) from None
        self._rule_facts.add(
            process=draft.processes[machine],
            change=self._changes.of(_change_of(state, draft)),
            answers=draft.answers,
            added=draft.added + [0] * (12 - len(draft.added)),
        )
        return self._rule_facts.size - 1

    def _move(self, kind: int, what: int, machine: int) -> Move:
        if kind == _TURN:
            return Move("turn", *self._pairs[what])
        return Move(_KINDS[kind], what if kind in (_HAPPEN, _LOSE) else machine)

    def _judge(self, numbers: Array, rows: Array, moves: _Moves, rules: Array) -> None:
        """Check what answers promise, where that has not been done."""
        at = np.nonzero(self._rule_facts["answers"][rules])[0]
        if not len(at):
            return
        judged = self._process_facts["judged"][rows[moves.row[at], : self._count]]
        judged[np.arange(len(at)), moves.machine[at]] = -2
        view = self._rest_facts["view"][rows[moves.row[at], self._count]]
        read = hashes_of(np.column_stack([rules[at], view, judged]))
        keys, first = np.unique(read, return_index=True)
        for index in at[first[self._judged.add(keys)]]:
            row = rows[moves.row[index]]
            kind, what = int(moves.kind[index]), int(moves.what[index])
            move = self._move(kind, what, int(moves.machine[index]))
            try:
                self._exploration.make(self._state_of(row), move)
            except Violation as violation:
                raise _Finding(violation, int(numbers[moves.row[index]]), move) from None
        self._learn()

    def _apply(self, rows: Array, moves: _Moves, rules: Array) -> Array:
        """Return the row after each move."""
        count, size = self._count, len(moves.row)
        facts, every = self._rule_facts, np.arange(size)
        after = stacked(rows[moves.row], None, facts["added"].shape[1])
        after[:, -facts["added"].shape[1] :] = facts["added"][rules]
        drops = np.nonzero(moves.column >= 0)[0]
        after[drops, count + 1 + moves.column[drops]] = 0
        after[every, moves.machine] = facts["process"][rules]
        # The process of a machine is what the rule says, except if a link is turned or a message
        # is lost, which change none.
        stays = np.nonzero((moves.kind == _TURN) | (moves.kind == _LOSE))[0]
        after[stays, :count] = rows[moves.row[stays], :count]
        pairs, place = np.unique(
            after[:, count] << 32 | facts["change"][rules], return_inverse=True
        )
        after[:, count] = np.array([self._rest(pair) for pair in pairs.tolist()])[place]
        items = after[:, count + 1 :]
        items[~self._matter(after)] = 0
        items = -np.sort(-items, axis=1)
        again = (items[:, 1:] == items[:, :-1]) & self._item_facts["single"][items[:, 1:]]
        if again.any():
            items[:, 1:][again] = 0
            items = -np.sort(-items, axis=1)
        width = max(1, int((items > 0).any(axis=0).sum()))
        return np.concatenate([after[:, : count + 1], items[:, :width]], axis=1)

    def _rest(self, pair: int) -> int:
        """Return the number of a rest after a change."""
        number = self._rest_after.get(pair)
        if number is None:
            change: _Change = self._changes.things[pair & 0xFFFFFFFF]
            number = self._number_of(change.apply(self._rests.things[pair >> 32]))
            self._rest_after[pair] = number
        return number

    def _matter(self, rows: Array) -> Array:
        """Tell whether each thing on its way can change anything; see `Exploration.freeze`."""
        count, facts, process = self._count, self._item_facts, self._process_facts
        items = rows[:, count + 1 :]
        number = np.take_along_axis(rows[:, :count], facts["machine"][items], axis=1)
        matter: Array = (items > 0) & (process["zid"][number] == facts["zid"][items])
        row, column = np.nonzero(matter & (facts["look"][items] >= 0))
        look, here = items[row, column], number[row, column]
        other = rows[row, facts["other"][look]]
        pairs = {pair: index for index, pair in enumerate(self._pairs)}
        link = np.zeros((count, count), np.int64)
        for (one, two), index in pairs.items():
            link[one, two] = link[two, one] = index
        cut = self._rest_facts["cut"][
            rows[row, count], link[facts["machine"][look], facts["other"][look]]
        ]
        is_there = (process["zid"][other] == facts["source"][look]) & ~cut
        token = np.where(is_there, process["token"][other], 0)
        known = self._what_is_known(facts["look"][look], here)
        differs = token ^ known
        matter[row, column] = (differs & 1 > 0) | ((differs & 2 > 0) & (known & 4 > 0))
        return matter

    def _what_is_known(self, look: Array, number: Array) -> Array:
        """Return what processes know of those that they may look at.

        These are bits: whether it is a seed, whether it is a member, whether members are watched.
        """
        shape = len(self._looks), self._process_facts.size
        if self._known.shape[0] < shape[0] or self._known.shape[1] < shape[1]:
            grown = np.full((shape[0] + 16, 2 * shape[1]), -1, np.int8)
            grown[: self._known.shape[0], : self._known.shape[1]] = self._known
            self._known = grown
        known: Array = self._known[look, number]
        if (known < 0).any():
            for index in np.nonzero(known < 0)[0]:
                process = self._exploration.stage.states[number[index]]
                zid = self._looks[look[index]].source
                bits = (zid in process.seeds) | (zid in process.members) << 1
                self._known[look[index], number[index]] = bits | process.watching << 2
            known = self._known[look, number]
        return known

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
        starts = [start for start, _, _ in self._parents]
        codes: list[int] = []
        while number:
            start, parents, made = self._parents[bisect_right(starts, number) - 1]
            codes.append(int(made[number - start]))
            number = int(parents[number - start])
        for code in reversed(codes):
            yield self._move(code >> 40, code >> 8 & 0xFFFFFFFF, (code & 0xFF) - 1)


class _Finding(Exception):
    """What does not hold, in which state, and after which move of it."""

    def __init__(self, violation: Violation, number: int, move: Move | None) -> None:
        super().__init__(str(violation))
        self.violation, self.number, self.move = violation, number, move


def _change_of(state: State, draft: Draft) -> _Change:
    return _Change(
        draft.now,
        tuple(draft.lives),
        draft.cuts,
        tuple(map(bool, draft.processes)),
        tuple(
            (index, disk)
            for index, (before, disk) in enumerate(zip(state.disks, draft.disks, strict=True))
            if before != disk
        ),
        draft.ended,
        tuple(before - after for before, after in zip(state.budget, draft.budget, strict=True)),
        tuple(sorted(set(state.left) - set(draft.left))),
        not draft.lossless,
    )


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
