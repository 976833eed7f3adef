"""What happens to a world: actions, drawn at random, and a quiet time after them."""

from __future__ import annotations

import random
from collections.abc import Iterable
from typing import Any, Final

import msgspec

from rosz.params.paths import Path
from rosz.params.replica.core import events as said
from rosz.params.writes import DELETED, Change, condense

from .world import CLOSE_LIMIT, Setting, World

PATHS: Final[tuple[Path, ...]] = (
    ("a",),
    ("a", "b"),
    ("a", "b", "c"),
    ("a", "d"),
    ("d",),
    ("e", "f"),
    ("g",),
    (),
)
TIMEOUTS: Final = (2.0, 0.5, 2.0, 0.0)
DELAYS: Final = (0.0, 0.001, 0.05, 0.3, 1.1, 4.5, 12.0)
KINDS: Final = {
    "set": 12,
    "put": 2,
    "batch": 2,
    "delete": 5,
    "client": 2,
    "wrong": 1,
    "compare": 1,
    "follow": 1,
    "cut": 2,
    "cut_one_way": 2,
    "isolate": 1,
    "mend": 4,
    "stop": 2,
    "wake": 3,
    "crash": 2,
    "wipe": 1,
    "close": 2,
    "start": 4,
    "hand_over": 1,
    "fill": 1,
    "empty": 2,
    "lie": 1,
    "slow": 1,
    "skew": 2,
    "drift": 1,
    "many": 1,
}
QUIET: Final = 150.0
_HOUR: Final = 3600 * 10**9


class Action(msgspec.Struct, frozen=True):
    """One thing that happens; numbers choose among what there is.

    Attributes:
        kind: What happens, a key of `KINDS`.
        machine: Machine that it happens to.
        other: Another machine, a path or a number.
        delay: Time that passes after it, an index of `DELAYS`.
    """

    kind: str
    machine: int
    other: int
    delay: int


def draw(chance: random.Random, machines: int) -> Action:
    """Draw an action."""
    (kind,) = chance.choices(list(KINDS), list(KINDS.values()))
    delay = chance.choices(range(len(DELAYS)), (8, 8, 6, 4, 3, 1, 1))[0]
    return Action(kind, chance.randrange(machines), chance.randrange(64), delay)


def draw_setting(chance: random.Random) -> Setting:
    """Draw a setting."""
    machines = chance.choice([2, 3, 3, 3, 4, 5])
    return Setting(
        machines,
        stored=chance.choice([0, 1, chance.getrandbits(machines), (1 << machines) - 1]),
        keep=chance.choice([10_000, 10_000, 2, 4]),
        loss=chance.choice([0.0, 0.0, 0.02, 0.2]),
        repeats=chance.choice([0.0, 0.1]),
        slow=chance.choice([0.0, 0.0, 0.05]),
        scoped=chance.random() < 0.1,
    )


class Player:
    """A world that actions happen to.

    Args:
        setting: What the world is made of.
        seed: Its seed.

    Attributes:
        world: The world.
    """

    def __init__(self, setting: Setting, seed: int) -> None:
        self.world = World(setting, seed)
        self._value = 0
        for machine in self.world.machines:
            self.world.start(machine)
            self.world.run(0.0 if seed % 3 == 0 else 2.0)
        if seed % 3 == 1:
            self.world.run(20.0)

    def play(self, actions: Iterable[Action]) -> None:
        """Let actions happen."""
        for action in actions:
            self.act(action)

    def act(self, action: Action) -> None:
        """Let an action happen, and time pass."""
        machines = self.world.machines
        machine = machines[action.machine % len(machines)]
        other = machines[action.other % len(machines)]
        getattr(self, f"_{action.kind}")(machine, other, action.other)
        self.world.run(DELAYS[action.delay])

    def quiet(self) -> None:
        """Mend everything, wait until all is quiet, and check what must hold then."""
        world = self.world
        world.loss = 0.0
        for disk in world.disks.values():
            disk.full = disk.lies = False
            disk.slow = 0.0
        for source, target in sorted(world.cuts):
            world.mend(source, target)
        for machine in world.machines:
            world.wake(machine)
            world.start(machine)
        world.run(QUIET)
        world.checks.on_quiet()
        world.loss = world.setting.loss
        world.lossless = world.loss == 0

    def _next(self) -> int:
        self._value += 1
        return self._value

    def _set(self, machine: str, _: str, number: int) -> None:
        path = PATHS[number % (len(PATHS) - 1)]
        self.world.write(machine, [(path, self._next())], TIMEOUTS[number // 8 % 4])

    def _put(self, machine: str, _: str, number: int) -> None:
        path = PATHS[number % len(PATHS)]
        value: dict[str, Any] = {"b": {"c": self._next()}, "d": self._next()}
        self.world.write(machine, [(path, value)], TIMEOUTS[number // 8 % 4])

    def _batch(self, machine: str, _: str, number: int) -> None:
        changes: list[Change] = [
            (path, self._next() if index % 3 else DELETED)
            for index, path in enumerate(PATHS[:-1])
            if number >> index & 1
        ]
        self.world.write(machine, condense(changes))

    def _delete(self, machine: str, _: str, number: int) -> None:
        path = PATHS[number % (len(PATHS) - 1)]
        process = self.world.running.get(machine)
        # Who deletes a parameter has seen it.
        if process is not None and any(True for _ in process.core.history.below(path[:1])):
            self.world.write(machine, [(path, DELETED)], TIMEOUTS[number // 8 % 4])

    def _client(self, machine: str, _: str, number: int) -> None:
        process = self.world.running.get(machine)
        if process is not None:
            late = (number % 3 - 1) * _HOUR // 3600
            stamp = process.wall(self.world.now) + late, f"client{self._next()}"
            self.world.write(machine, [(PATHS[number % 7], self._next())], 1.0, stamp)

    def _wrong(self, machine: str, _: str, number: int) -> None:
        process = self.world.running.get(machine)
        if process is None:
            return
        far = process.wall(self.world.now) + 11 * 365 * 24 * _HOUR, "client"
        changes: list[Change] = [(("a",), self._next())]
        if number % 2:
            self.world.write(machine, changes, 1.0, far)
        else:
            self.world.write(machine, [*changes, ((), 5)])

    def _compare(self, machine: str, _: str, number: int) -> None:
        process = self.world.running.get(machine)
        if process is not None and self.world.serves(process):
            limit = 2.0 + number % 4
            event = said.CompareCalled(self.world.number(), limit)
            self.world.call(process, event, limit)

    def _follow(self, machine: str, _: str, __: int) -> None:
        process = self.world.running.get(machine)
        if process is not None and self.world.serves(process):
            self.world.call(process, said.FollowCalled(self.world.number(), 2.0), 2.0)

    def _cut(self, machine: str, other: str, _: int) -> None:
        self.world.cut(machine, other)
        self.world.cut(other, machine)

    def _cut_one_way(self, machine: str, other: str, _: int) -> None:
        self.world.cut(machine, other)

    def _isolate(self, machine: str, _: str, __: int) -> None:
        for other in self.world.machines:
            self._cut(machine, other, 0)

    def _mend(self, _: str, __: str, number: int) -> None:
        for index, (source, target) in enumerate(sorted(self.world.cuts)):
            if number >> index & 1:
                self.world.mend(source, target)

    def _stop(self, machine: str, _: str, __: int) -> None:
        self.world.stop(machine)

    def _wake(self, machine: str, _: str, __: int) -> None:
        self.world.wake(machine)

    def _crash(self, machine: str, _: str, __: int) -> None:
        self.world.crash(machine)

    def _wipe(self, machine: str, _: str, __: int) -> None:
        self.world.crash(machine)
        if machine in self.world.disks:
            self.world.disks[machine].wipe()

    def _close(self, machine: str, _: str, __: int) -> None:
        process = self.world.running.get(machine)
        if process is not None and self.world.serves(process):
            self.world.call(process, said.CloseCalled(self.world.number()), CLOSE_LIMIT)

    def _start(self, machine: str, _: str, __: int) -> None:
        self.world.start(machine)

    def _hand_over(self, machine: str, _: str, __: int) -> None:
        self.world.hand_over(machine)

    def _fill(self, machine: str, _: str, __: int) -> None:
        if machine in self.world.disks:
            self.world.disks[machine].full = True

    def _empty(self, machine: str, _: str, __: int) -> None:
        if machine in self.world.disks:
            disk = self.world.disks[machine]
            disk.full = disk.lies = False
            disk.slow = 0.0

    def _lie(self, machine: str, _: str, __: int) -> None:
        if machine in self.world.disks:
            self.world.disks[machine].lies = True

    def _slow(self, machine: str, _: str, number: int) -> None:
        if machine in self.world.disks:
            self.world.disks[machine].slow = (0.1, 1.0, 3.0)[number % 3]

    def _skew(self, machine: str, _: str, number: int) -> None:
        skew = (-5, -1, 0, 1, 3, 24 * 365)[number % 6] * _HOUR
        self.world.skews[machine] = skew
        if machine in self.world.running:
            self.world.running[machine].skew = skew

    def _drift(self, machine: str, _: str, number: int) -> None:
        if machine in self.world.running:
            self.world.running[machine].drift = (number % 5 - 2) * 0.01

    def _many(self, machine: str, _: str, number: int) -> None:
        """Set and delete many parameters, so that deletions are forgotten."""
        changes: list[Change] = [(("m", str(index)), number) for index in range(12)]
        self.world.write(machine, changes, 0.5)
        self.world.write(machine, [(path, DELETED) for path, _ in changes], 0.5)


def play(setting: Setting, seed: int, actions: Iterable[Action]) -> World:
    """Play actions, then a quiet time; raise a `Violation` if something does not hold."""
    player = Player(setting, seed)
    player.play(actions)
    player.quiet()
    return player.world


def play_seed(seed: int, length: int = 60, rounds: int = 1) -> World:
    """Play a history that follows from its seed alone."""
    chance = random.Random(seed)
    setting = draw_setting(chance)
    player = Player(setting, seed)
    for _ in range(rounds):
        player.play(draw(chance, setting.machines) for _ in range(length))
        player.quiet()
    return player.world
