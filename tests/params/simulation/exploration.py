"""All orders in which little can happen.

An exploration begins with a few replicas that know each other. From there it tries everything that
may happen next: each message and each token may arrive first, each disk may be done, the next timer
may fire before any of them, the next call may be made, a link may be cut and a process may crash.
States that are alike are explored once, also if they differ only in the names of replicas that
nobody calls. From each state in which nothing is left to happen, a quiet time follows.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator
from typing import Any

import msgspec

from rosz.params.paths import Path
from rosz.params.replica.core import events as said
from rosz.params.writes import DELETED, Deleted

from .checks import Checks
from .copies import Form, clone
from .disk import Disk
from .process import Process
from .violation import Violation
from .world import Deliver, Expire, Finish, Fire, Item, Reconcile, Setting, World

_URGENT = frozenset({"delivery", "call", "appeared", "save again", "query the next", "find more"})
"""Timers that may fire before anything else; the others fire in the quiet time."""


class Step(msgspec.Struct, frozen=True):
    """One call of a process: a value to set, or ``DELETED``.

    Attributes:
        machine: Machine of the process.
        path: Path that is written; if empty, the process ends.
        value: Value.
    """

    machine: str
    path: Path
    value: int | Deleted = 0


class Script(msgspec.Struct, frozen=True):
    """A small world.

    Attributes:
        setting: What it is made of.
        steps: Calls, those of one machine in this order.
        cuts: How often a link may be cut.
        crashes: How often a process may crash.
        losses: How many messages may be lost.
        advances: How many timers may fire early.
    """

    setting: Setting
    steps: tuple[Step, ...]
    cuts: int = 0
    crashes: int = 0
    losses: int = 0
    advances: int = 1


class Result(msgspec.Struct):
    """What an exploration found.

    Attributes:
        states: Number of states.
        ends: Number of states in which nothing was left to happen.
        steps: Steps of cores.
        finished: Whether all states were explored.
        seconds: How long it took.
        finding: What did not hold.
    """

    states: int = 0
    ends: int = 0
    steps: int = 0
    finished: bool = True
    seconds: float = 0.0
    finding: str = ""

    def __str__(self) -> str:
        end = "all" if self.finished else "not all"
        text = f"{self.states} states ({end}), {self.ends} ends, {self.steps} steps,"
        return f"{text} {self.seconds:.1f} s\n{self.finding}".rstrip()


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


class _Chain:
    """A list whose copies share what they have in common."""

    def __init__(self, last: Any = None) -> None:
        self.last = last

    def append(self, entry: Any) -> None:
        self.last = (self.last, entry)

    def __iter__(self) -> Iterator[Any]:
        entries: list[Any] = []
        link = self.last
        while link is not None:
            link, entry = link
            entries.append(entry)
        yield from reversed(entries)


class _SmallWorld(World):
    """A world whose future is a set of items, of which any may be next."""

    def __init__(self, script: Script) -> None:
        self.pending: list[Item] = []
        self.timers: list[tuple[float, Item]] = []
        self.left = script.steps
        self.cuts_left = script.cuts
        self.crashes_left = script.crashes
        self.losses_left = script.losses
        self.advances_left = script.advances
        self.owned: set[str] = set()
        self.forms: dict[tuple[str, int], Any] = {}
        super().__init__(script.setting)
        self.random = _Chance()  # type: ignore[assignment]
        self.trace = _Chain()  # type: ignore[assignment]
        for machine in self.machines:
            self.start(machine)
            self.settle(3.0)
        for machine in sorted({step.machine for step in script.steps}):
            self.write(machine, [(("w", machine), 0)])
            self.settle(3.0)

    def later(self, delay: float, item: Item) -> None:
        if isinstance(item, (Fire, Expire)):
            self.timers.append((self.now + delay, item))
        elif not (isinstance(item, (Reconcile, Finish)) and item in self.pending):
            self.pending.append(item)

    def start(self, machine: str, handover: Any = None) -> None:
        if machine in self.running:
            return
        self.owned.add(f"{machine}{self.lives[machine] + 1}")
        super().start(machine, handover)

    def step(self, process: Process, event: said.Event) -> None:
        process.core._work.random = self.random
        super().step(process, event)

    def fork(self) -> _SmallWorld:
        """Return a copy; its processes are copied when they change."""
        made = object.__new__(_SmallWorld)
        made.__dict__.update(self.__dict__)
        for name in ("processes", "running", "disks", "lives", "cuts", "severed", "batches"):
            setattr(made, name, getattr(self, name).copy())
        for name in ("registry", "queries", "pending", "timers", "forms"):
            setattr(made, name, getattr(self, name).copy())
        made.trace = _Chain(self.trace.last)  # type: ignore[assignment, attr-defined]
        made._count = itertools.count(int(repr(self._count)[6:-1]))
        made._values = itertools.count(int(repr(self._values)[6:-1]))
        made.checks = Checks(made)
        made.owned = set()
        return made

    def own(self, zid: str) -> None:
        """Copy a process that other worlds may share."""
        if zid not in self.owned:
            self.owned.add(zid)
            self.forms = {key: form for key, form in self.forms.items() if key[0] != zid}
            process: Process = clone(self.processes[zid], {})
            self.processes[zid] = process
            present = self.running.get(process.machine)
            if present is not None and present.zid == zid:
                self.running[process.machine] = process
                if process.disk is not None:
                    self.disks[process.machine] = process.disk

    def happen(self, item: Item) -> None:
        zid = getattr(item, "zid", "")
        if zid:
            self.own(zid)
        super().happen(item)

    # What may be next

    def successors(self) -> Iterator[_SmallWorld]:
        """Yield the world after each thing that may be next."""
        for index, item in enumerate(self.pending):
            if item not in self.pending[:index]:
                yield self._after_item(index)
                if self.losses_left and isinstance(item, Deliver) and item.source:
                    made = self.fork()
                    made.losses_left -= 1
                    made.lossless = False
                    del made.pending[index]
                    yield made
        for machine in {step.machine for step in self.left}:
            process = self.running.get(machine)
            if process is not None and self.serves(process):
                yield self._after_call(machine)
        # What a machine finds out about itself is there before the next timer.
        is_local = any(isinstance(item, Deliver) and not item.source for item in self.pending)
        may_advance = self.advances_left and not is_local
        if may_advance and any(_is_urgent(item) for _, item in self.timers):
            made = self.fork()
            made.advances_left -= 1
            made.advance()
            yield made
        yield from self._after_faults()

    def _after_item(self, index: int) -> _SmallWorld:
        made = self.fork()
        made.happen(made.pending.pop(index))
        return made

    def _after_call(self, machine: str) -> _SmallWorld:
        made = self.fork()
        step = next(step for step in made.left if step.machine == machine)
        index = made.left.index(step)
        made.left = made.left[:index] + made.left[index + 1 :]
        process = made.running[machine]
        made.own(process.zid)
        if step.path:
            made.write(machine, [(step.path, step.value)])
        else:
            process = made.running[machine]
            made.call(process, said.CloseCalled(made.number()), 1.0)
        return made

    def _after_faults(self) -> Iterator[_SmallWorld]:
        machines = self.machines
        for one, other in itertools.combinations(machines, 2):
            is_cut = (one, other) in self.cuts
            if (is_cut or self.cuts_left) and (self.left or self.pending):
                made = self.fork()
                for source, target in ((one, other), (other, one)):
                    if is_cut:
                        made.mend(source, target)
                    else:
                        made.cut(source, target)
                made.cuts_left -= not is_cut
                yield made
        for machine in machines:
            process = self.running.get(machine)
            if process is None:
                made = self.fork()
                made.start(machine)
                yield made
            elif self.crashes_left and (self.left or self.pending):
                made = self.fork()
                made.own(process.zid)
                made.crashes_left -= 1
                made.crash(machine)
                yield made

    def advance(self) -> None:
        """Let the next timer fire that may fire early."""
        due = min(
            (entry for entry in self.timers if _is_urgent(entry[1])), key=lambda entry: entry[0]
        )
        self.timers.remove(due)
        self.now = max(self.now, due[0])
        self.happen(due[1])

    # The quiet time

    def settle(self, seconds: float) -> None:
        """Let all happen in the order in which it began, for some time."""
        until = self.now + seconds
        while True:
            while self.pending:
                self.now += 0.0001
                self.happen(self.pending.pop(0))
            due = min(self.timers, key=lambda entry: entry[0], default=None)
            if due is None or due[0] > until:
                break
            self.timers.remove(due)
            self.now = max(self.now, due[0])
            self.happen(due[1])
        self.now = max(self.now, until)

    def finish(self) -> int:
        """Mend everything, wait, and check what must hold then; return the number of steps."""
        made = self.fork()
        for source, target in sorted(made.cuts):
            made.mend(source, target)
        for machine in made.machines:
            made.start(machine)
        made.settle(45.0)
        made.checks.on_quiet()
        return made.steps - self.steps

    # States that are alike

    def form(self, free: list[str]) -> int:
        """Return a number that is equal for states that are alike, whatever the free names."""
        orders = itertools.permutations(free)
        return min(
            self._form(dict(zip(free, order, strict=True)), index)
            for index, order in enumerate(orders)
        )

    def _form(self, renamed: dict[str, str], index: int) -> int:
        names: dict[str, str] = {}
        for old, new in renamed.items():
            names |= {old: new, f"process {old}": f"process {new}"}
            names |= {f"{old}{life}": f"{new}{life}" for life in range(1, 4)}
        form = Form(names)
        processes = []
        for process in self.running.values():
            known = self.forms.get((process.zid, index))
            if known is None:
                known = hash((form.of(process.zid), _form_of(process, names)))
                self.forms[process.zid, index] = known
            processes.append(known)
        disks = [(form.of(name), _form_of(disk, names)) for name, disk in self._idle_disks()]
        whole = (
            frozenset(processes),
            frozenset(disks),
            frozenset(_counted(self._form_item(item, form) for item in self.pending)),
            frozenset(
                _counted(
                    (round(due - self.now, 3), self._form_item(item, form))
                    for due, item in self.timers
                    if _is_urgent(item)
                )
            ),
            form.of(self.cuts),
            form.of(self.left),
            (self.cuts_left, self.crashes_left, self.losses_left, self.advances_left),
        )
        return hash(whole)

    def _idle_disks(self) -> Iterator[tuple[str, Disk]]:
        for name, disk in self.disks.items():
            if name not in self.running:
                yield name, disk

    def _form_item(self, item: Item, form: Form) -> Any:
        if isinstance(item, Deliver):
            query = getattr(item.event, "query", 0)
            asker = form.of(self._asker(query)) if query else ()
            if query:
                item = Deliver(item.zid, msgspec.structs.replace(item.event, query=0), item.source)
            return asker, form.of(item)
        if isinstance(item, Fire):
            return form.of((item.zid, item.timer.kind, item.timer.number, item.call))
        return form.of(item)


def _form_of(thing: Any, names: dict[str, str]) -> Any:
    return Form(names).of(thing)


def _counted(forms: Iterator[Any]) -> list[tuple[Any, int]]:
    counts: dict[Any, int] = {}
    for form in forms:
        counts[form] = counts.get(form, 0) + 1
    return list(counts.items())


def _is_urgent(item: Item) -> bool:
    return isinstance(item, Expire) or (isinstance(item, Fire) and item.timer.kind in _URGENT)


def explore(script: Script, most: int = 1_000_000) -> Result:
    """Explore all that may happen in a small world, up to a number of states."""
    begun, result = time.monotonic(), Result()
    called = {step.machine for step in script.steps}
    try:
        first = _SmallWorld(script)
        free = [machine for machine in first.machines if machine not in called]
        met = {first.form(free)}
        stack = [first]
        while stack:
            world = stack.pop()
            result.states += 1
            if result.states >= most:
                result.finished = False
                break
            is_end = True
            for successor in world.successors():
                is_end = False
                result.steps += successor.steps - world.steps
                form = successor.form(free)
                if form not in met:
                    met.add(form)
                    stack.append(successor)
            if is_end:
                result.ends += 1
                result.steps += world.finish()
    except Violation as violation:
        result.finding = str(violation)
        result.finished = False
    result.seconds = time.monotonic() - begun
    return result


A, B = ("a",), ("a", "b")
_TWO = Setting(machines=2)
_TWO_STORED = Setting(machines=2, stored=3)
_THREE = Setting(machines=3)
_THREE_STORED = Setting(machines=3, stored=1)
_END = Step("a", ())

SCRIPTS: dict[str, Script] = {
    "two": Script(_TWO, (Step("a", A, 1), Step("b", B, 2))),
    "two, cut": Script(_TWO, (Step("a", A, 1), Step("b", A, 2)), cuts=1),
    "two, crash": Script(_TWO, (Step("a", A, 1), Step("b", B, 2)), crashes=1),
    "two, stored, crash": Script(_TWO_STORED, (Step("a", A, 1), Step("b", B, 2)), crashes=1),
    "two, loss": Script(_TWO, (Step("a", A, 1), Step("b", B, 2)), losses=1, advances=2),
    "two, end": Script(_TWO, (Step("a", A, 1), _END), cuts=1, losses=1),
    "two, four": Script(
        _TWO, (Step("a", A, 1), Step("a", A, DELETED), Step("b", B, 2), Step("b", A, 3)), 1, 1
    ),
    "three": Script(_THREE, (Step("a", A, 1), Step("b", B, 2))),
    "three, one": Script(_THREE, (Step("a", A, 1),), cuts=1, crashes=1),
    "three, cut": Script(_THREE, (Step("a", A, 1), Step("b", B, 2)), cuts=1),
    "three, crash": Script(_THREE, (Step("a", A, 1), Step("a", B, 2)), crashes=1),
    "three, stored": Script(_THREE_STORED, (Step("a", A, 1), Step("b", B, 2)), crashes=1),
    "three, four": Script(
        _THREE, (Step("a", A, 1), Step("a", A, DELETED), Step("b", B, 2), Step("b", A, 3)), 1, 1
    ),
}
