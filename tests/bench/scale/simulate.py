"""What larger fleets would cost: ``python -m tests.bench.scale.simulate``.

A simulation by discrete events of nodes that start at once on machines with a core each, which are
linked to the first one's. It knows their costs, which are fitted to the runs in
``calibration.json`` (``python -m tests.bench.scale --json …``):

- a node's start, on its own;
- what a node does for each other node that it hears of;
- what a core does for each of its clients, and for each node that it tells a client of;
- what a core does for each node of another machine;
- the bytes of a node on its own, for each other node, and for each other machine.

A machine serves its jobs in turn, on so many processors; a core takes all that waits for it as one
job, before nodes that have not started yet.
"""

from __future__ import annotations

import heapq
import math
import statistics
import sys
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import msgspec

from .sight import Sight

__all__ = (
    "CALIBRATION",
    "HOSTS",
    "Costs",
    "Forecast",
    "again",
    "knee",
    "load",
    "measured",
    "simulate",
)

CALIBRATION = Path(__file__).with_name("calibration.json")
_DELAY = 0.0005
"""Seconds that a message takes from one machine to another."""
HOSTS = {"star": 1, "stars": 3}
"""The hosts of the crowds that are simulated again, by their topology."""
_BAR = 50


class Costs(msgspec.Struct, frozen=True):
    """What the parts of a fleet cost, in seconds of a processor and in kilobytes.

    Attributes:
        start: A node's start.
        hears: For a node, each other node.
        serves: For a core, each of its clients.
        routes: For a core, each node that it tells a client of.
        relays: For a core, each node of another machine.
        own: The kilobytes of a node on its machine's loopback.
        other: The same for each other node.
        across: The kilobytes between machines, of a node for each other machine.
    """

    start: float
    hears: float
    serves: float
    routes: float
    relays: float
    own: float
    other: float
    across: float

    @classmethod
    def fit(cls, sights: Sequence[Sight]) -> Costs:
        """Return the costs that fit some measured crowds best."""
        here = [one for one in sights if one.mode == "star"]
        counts = [one.count for one in here]
        start, hears = _line(counts, [one.busy - one.core / one.count for one in here])
        serves, routes = _line(counts, [one.core / one.count for one in here])
        own, other = _line(counts, [one.traffic for one in here])
        hosts = HOSTS["stars"]
        apart = [one for one in sights if one.mode == "stars"]
        # Each core does this for the nodes of all others.
        relays = [
            (one.core / one.count - serves - routes * one.count) / (hosts - 1) for one in apart
        ]
        return cls(
            start=start,
            hears=hears,
            serves=serves,
            routes=routes,
            relays=max(0.0, statistics.median(relays)),
            own=own,
            other=other,
            across=statistics.median(one.traffic for one in apart) / (hosts - 1),
        )


class Forecast(msgspec.Struct):
    """What becomes of a fleet.

    Attributes:
        complete: Seconds until each core has told its clients of all nodes.
        busy: Seconds of a processor for each node, cores included.
        core: Seconds of a processor of the busiest core.
        traffic: Kilobytes for each node, between machines or on the only one.
    """

    complete: float = 0.0
    busy: float = 0.0
    core: float = 0.0
    traffic: float = 0.0


class _Clock:
    """Events in the order of their times."""

    def __init__(self) -> None:
        self.now = 0.0
        self._events: list[tuple[float, int, Callable[[], None]]] = []
        self._number = 0

    def later(self, seconds: float, event: Callable[[], None]) -> None:
        self._number += 1
        heapq.heappush(self._events, (self.now + seconds, self._number, event))

    def run(self) -> None:
        while self._events:
            self.now, _, event = heapq.heappop(self._events)
            event()


class _Machine:
    """A machine with its core, and the nodes that start on it."""

    def __init__(self, clock: _Clock, costs: Costs, processors: float) -> None:
        self._clock = clock
        self._costs = costs
        self._free = max(1, round(processors))
        self._speed = processors / self._free
        self._starts: deque[float] = deque()
        self._urgent: deque[tuple[float, Callable[[], None]]] = deque()
        self._arrived: Counter[_Machine] = Counter()
        self._serving = False
        self.linked: list[_Machine] = []
        self.clients = 0
        self.known = 0
        self.busy = 0.0
        self.core = 0.0

    def start(self, nodes: int) -> None:
        """Start so many nodes now."""
        self._starts.extend([self._costs.start] * nodes)
        self._next()

    def arrive(self, nodes: Counter[_Machine]) -> None:
        """Have the core take note of nodes, so many of each machine."""
        self._arrived.update(nodes)
        self._serve()

    def _serve(self) -> None:
        if self._serving or not self._arrived:
            return
        self._serving = True
        nodes, self._arrived = self._arrived, Counter()
        local, count = nodes[self], nodes.total()
        # Its clients are told of the newcomers, and newcomers among these of all.
        told = self.clients * count + local * (self.known + count)
        self.clients += local
        self.known += count
        costs = self._costs
        work = local * costs.serves + (count - local) * costs.relays + told * costs.routes
        self.core += work

        def served() -> None:
            self._serving = False
            self._pass_on(nodes)
            self._submit(told * costs.hears, lambda: None)
            self._serve()

        self._submit(work, served)

    def _pass_on(self, nodes: Counter[_Machine]) -> None:
        """Tell each linked core of the nodes that it did not tell of itself."""
        for other in self.linked:
            told = Counter(nodes)
            # What came by the first core is known to all that are linked to it.
            for one in [other] if len(self.linked) > 1 else nodes.keys() - {self}:
                del told[one]
            if told:
                self._clock.later(_DELAY, partial(other.arrive, told))

    def _submit(self, work: float, done: Callable[[], None]) -> None:
        self._urgent.append((work, done))
        self._next()

    def _next(self) -> None:
        while self._free and (self._urgent or self._starts):
            self._free -= 1
            if self._urgent:
                work, done = self._urgent.popleft()
            else:
                work, done = self._starts.popleft(), self._started
            self.busy += work
            self._clock.later(work / self._speed, partial(self._finish, done))

    def _started(self) -> None:
        self.arrive(Counter({self: 1}))

    def _finish(self, done: Callable[[], None]) -> None:
        self._free += 1
        done()
        self._next()


def simulate(costs: Costs, nodes: int, machines: int = 1, processors: float = 2.0) -> Forecast:
    """Start a fleet at once, and return what becomes of it.

    Args:
        costs: The costs of its parts.
        nodes: How many nodes, spread evenly over the machines.
        machines: How many machines, each with a core.
        processors: Processors of each machine; a part of one is a slower one.
    """
    clock = _Clock()
    fleet = [_Machine(clock, costs, processors) for _ in range(machines)]
    fleet[0].linked = fleet[1:]
    for number, machine in enumerate(fleet):
        if number:
            machine.linked = [fleet[0]]
        machine.start(nodes // machines + (number < nodes % machines))
    clock.run()
    assert all(machine.known == nodes for machine in fleet)
    return Forecast(
        complete=clock.now,
        busy=sum(machine.busy for machine in fleet) / nodes,
        core=max(machine.core for machine in fleet),
        traffic=costs.across * (machines - 1) if machines > 1 else costs.own + costs.other * nodes,
    )


def measured(sight: Sight) -> Forecast:
    """Return what became of a crowd that was measured."""
    hosts = HOSTS[sight.mode]
    return Forecast(sight.complete, sight.busy, sight.core / hosts, sight.traffic)


def again(costs: Costs, sight: Sight) -> Forecast:
    """Return what the costs make of a crowd, with the processors that it had got."""
    hosts = HOSTS[sight.mode]
    got = sight.busy * sight.count / sight.complete / hosts
    return simulate(costs, sight.count, hosts, got)


def knee(costs: Costs, machines: int) -> int:
    """Return how many nodes there are when hearing of others takes as long as all else of a start.

    Args:
        costs: The costs of its parts.
        machines: How many machines, each with a core.
    """
    alone = costs.start + costs.serves + (machines - 1) * costs.relays
    growing = costs.routes + costs.hears
    return round(alone / growing) if growing else sys.maxsize


def _line(places: Sequence[float], values: Sequence[float]) -> tuple[float, float]:
    """Return the height at zero and the slope of a line; both are not negative.

    Its relative errors are small: the squares of these are added, as few nodes count as many do.
    """
    weights = [1 / value**2 for value in values]
    total = sum(weights)
    place = sum(w * x for w, x in zip(weights, places, strict=True)) / total
    value = sum(w * y for w, y in zip(weights, values, strict=True)) / total
    spread = sum(w * (x - place) ** 2 for w, x in zip(weights, places, strict=True))
    pairs = zip(weights, places, values, strict=True)
    slope = sum(w * (x - place) * (y - value) for w, x, y in pairs) / spread
    if slope < 0:
        return value, 0.0
    if (height := value - slope * place) >= 0:
        return height, slope
    pairs = zip(weights, places, values, strict=True)
    return 0.0, sum(w * x * y for w, x, y in pairs) / sum(
        w * x * x for w, x in zip(weights, places, strict=True)
    )


def load(file: Path = CALIBRATION) -> list[Sight]:
    """Return the measured crowds in a file, those that came about."""
    sights = msgspec.json.decode(file.read_bytes(), type=list[Sight])
    return [one for one in sights if not one.trouble]


def bars(rows: Sequence[tuple[str, float]], unit: str) -> Iterator[str]:
    """Yield a plot of values in text, on a logarithmic scale."""
    low, high = (math.log(most(value for _, value in rows)) for most in (min, max))
    for name, value in rows:
        length = 1 + round(_BAR * (math.log(value) - low) / ((high - low) or 1.0))
        yield f"    {name:<{max(len(one) for one, _ in rows)}}  {'#' * length} {value:.3g} {unit}"


def main() -> None:
    """Print the costs, what they make of the measured crowds, and of larger fleets."""
    sights = load()
    costs = Costs.fit(sights)
    print("costs:", ", ".join(f"{name} {value:.3g}" for name, value in _fields(costs)))
    print("\n| nodes | machines | all heard, s | CPU each, s | busiest core, s | kB each | |")
    print("|---|---|---|---|---|---|---|")
    for one in sights:
        if one.mode in HOSTS:
            print(_row(one.count, HOSTS[one.mode], again(costs, one), "simulated"))
            print(_row(one.count, HOSTS[one.mode], measured(one), "measured"))
    rows = []
    deaf = msgspec.structs.replace(costs, hears=0.0, routes=0.0)
    for machines, counts in ((1, (200, 500, 1000)), (100, (1000, 2000, 5000, 10_000))):
        for count in counts:
            found = simulate(costs, count, machines)
            print(_row(count, machines, found, "simulated, 2 processors"))
            rows.append((f"{count} on {machines}", found.complete))
    for count in (1000, 10_000):
        found = simulate(deaf, count, 100)
        print(_row(count, 100, found, "if a node cost the others nothing"))
        rows.append((f"{count} on 100, if nothing", found.complete))
    print("", *bars(rows, "s"), sep="\n")
    print("\nHearing of others takes as much as all else of a start")
    for machines in (1, 100):
        print(f"- from {knee(costs, machines)} nodes on {machines} machine(s)")
    machines = 1 + round((costs.start + costs.serves) / costs.relays)
    print(f"and that other cores know a node, from {machines} machines")


def _row(count: int, machines: int, found: Forecast, note: str) -> str:
    figures = (found.complete, found.busy, found.core, found.traffic)
    cells = " | ".join(f"{figure:.3g}" for figure in figures)
    return f"| {count} | {machines} | {cells} | {note} |"


def _fields(costs: Costs) -> Iterator[tuple[str, float]]:
    for name in costs.__struct_fields__:
        yield name, getattr(costs, name)


if __name__ == "__main__":
    main()
