"""Many nodes, each a process, that start at once on one machine or on several hosts."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

import msgspec

from .reports import Late, Reports, Trouble
from .sight import STEPS, Sight
from .site import Site, sites

__all__ = ("TOPOLOGIES", "Topology", "measure")

_FOLDER = Path(__file__).parent
_IDLE_SECONDS = 4.0
_DEATH_SECONDS = 3.0
_SET_OF_MOST = 200
"""A set is measured with so many nodes at most."""
_FIRST = "tcp/h0:7447"


class Topology(msgspec.Struct, frozen=True):
    """How the nodes are joined.

    Attributes:
        cores: Where cores are; those of other hosts are linked to that of the first.
        mode: What the nodes are, by ``ROSZ_MODE``.
        worker: The program of the nodes.
        nodes: How many nodes share a process.
    """

    cores: Literal["none", "first", "each"]
    mode: Literal["peer", "client"]
    worker: str = "worker.py"
    nodes: int = 1

    @property
    def bare(self) -> bool:
        """Whether there is nothing of rosz in it."""
        return self.worker == "bare.py"

    def core(self, site: int, count: int) -> Sequence[str] | None:
        """Return the arguments of the core of a host out of so many, if it has one."""
        if self.cores == "none" or (site and self.cores == "first"):
            return None
        if site:
            return ("--connect", _FIRST)
        return ("--listen", "tcp/0.0.0.0:7447") if count > 1 else ()

    def variables(self, site: int, count: int) -> dict[str, str]:
        """Return the environment of the nodes of a host out of so many."""
        found: dict[str, str] = {"ROSZ_MODE": self.mode}
        if count > 1 and self.cores == "none":
            found["ROSZ_MULTICAST"] = "1"
        if site and self.cores == "first":
            found["ROSZ_CONNECT"] = _FIRST
        return found


TOPOLOGIES = {
    "mesh": Topology("none", "peer"),
    "star": Topology("first", "client"),
    "bare": Topology("first", "client", "bare.py"),
    "shared": Topology("first", "client", nodes=20),
    "cores": Topology("each", "peer"),
    "stars": Topology("each", "client"),
}


def measure(mode: str, count: int, hosts: int, timeout: float, rate: float = math.inf) -> Sight:
    """Start a crowd on a network of its own, measure it and end it.

    Args:
        mode: One of `TOPOLOGIES`.
        count: How many nodes.
        hosts: Hosts that they are spread over; 0 for this machine as it is.
        timeout: Seconds that each step may take.
        rate: Nodes that start in a second.
    """
    sight = Sight(mode, count)
    with (
        TemporaryDirectory(prefix="rosz-scale-") as folder,
        closing(Reports(Path(folder))) as reports,
        sites(hosts, Path(folder)) as places,
    ):
        crowd = _Crowd(TOPOLOGIES[mode], places, reports, timeout, rate)
        try:
            crowd.measure(sight)
        except Trouble as trouble:
            sight.trouble, sight.late = str(trouble), isinstance(trouble, Late)
    return sight


class _Crowd:
    """The processes of a crowd; what its cores take is shared out among the nodes."""

    def __init__(
        self,
        topology: Topology,
        places: Sequence[Site],
        reports: Reports,
        timeout: float,
        rate: float,
    ) -> None:
        self._topology = topology
        self._sites = places
        self._reports = reports
        self._timeout = timeout
        self._pause = topology.nodes / rate
        self._cores: list[tuple[Site, str]] = []

    def measure(self, sight: Sight) -> None:
        """Start all and measure, as far as that goes.

        Raises:
            Trouble: It does not go on.
        """
        self._start_cores()
        self._measure_start(sight)
        if not self._topology.bare:
            self._measure_rest(sight)
            self._measure_newcomer(sight)
            self._measure_death(sight)

    def _start_cores(self) -> None:
        for number, site in enumerate(self._sites):
            words = self._topology.core(number, len(self._sites))
            if words is not None:
                command = ("-m", "rosz", "core", *words)
                if self._topology.bare:
                    command = (str(_FOLDER / self._topology.worker), "router")
                self._start(f"core{number}", site, command, {})
                self._cores.append((site, f"core{number}"))
                self._wait("started", 1)

    def _measure_start(self, sight: Sight) -> None:
        sent, busy, core = self._total(Site.sent), self._total(Site.cpu), self._core_cpu()
        began = time.monotonic()
        for turn, number in enumerate(range(0, sight.count, self._topology.nodes)):
            time.sleep(max(0.0, began + turn * self._pause - time.monotonic()))
            self._start_nodes(number, sight.count, min(self._topology.nodes, sight.count - number))
        sight.complete = max(self._wait("complete", sight.count)) - began
        sight.busy = (self._total(Site.cpu) - busy) / sight.count
        sight.core = self._core_cpu() - core
        sight.traffic = (self._total(Site.sent) - sent) / sight.count / 1e3
        processes = math.ceil(sight.count / self._topology.nodes)
        for step in STEPS:
            sight.steps[step] = statistics.median(self._wait(step, processes)) * 1e3

    def _measure_rest(self, sight: Sight) -> None:
        sight.memory = self._total(Site.memory) / sight.count / 1e6
        busy = self._total(Site.cpu)
        time.sleep(_IDLE_SECONDS)
        sight.idle = (self._total(Site.cpu) - busy) / _IDLE_SECONDS / sight.count * 100
        if sight.count <= _SET_OF_MOST:
            self._reports.say("s0", "set")
            (seconds,) = self._wait("set", 1)
            sight.set_ms = seconds * 1e3

    def _measure_newcomer(self, sight: Sight) -> None:
        began = time.monotonic()
        self._start_nodes(sight.count, sight.count + 1, 1, "hail")
        seen = [*self._wait("complete", 1), *self._wait("heard", sight.count)]
        sight.newcomer = max(seen) - began
        process = self._reports.forget(f"s{sight.count}")
        self._site(sight.count).kill(process)
        process.wait()
        self._wait("gone", 1)

    def _measure_death(self, sight: Sight) -> None:
        """Kill the process of some nodes, which others hear and are heard by."""
        first = sight.count // 2 // self._topology.nodes * self._topology.nodes
        if not first:  # it is the only process
            return
        site, process = self._site(first), self._reports.forget(f"s{first}")
        busy = self._total(Site.cpu) - site.cpu(process)
        began = time.monotonic()
        site.kill(process)
        while (gone := max(self._wait("gone", 1))) < began:
            pass  # it was told of another one, before
        sight.death = gone - began
        time.sleep(max(0.0, began + _DEATH_SECONDS - time.monotonic()))
        after = self._total(Site.cpu)
        time.sleep(_DEATH_SECONDS)
        idle = self._total(Site.cpu) - after
        others = sight.count - self._topology.nodes
        sight.death_cpu = (after - busy - idle) / others * 1e3

    def _site(self, number: int) -> Site:
        return self._sites[number // self._topology.nodes % len(self._sites)]

    def _start_nodes(self, number: int, count: int, nodes: int, *words: str) -> None:
        site = self._site(number)
        place = self._sites.index(site)
        variables = self._topology.variables(place, len(self._sites))
        program = str(_FOLDER / self._topology.worker)
        command = [program, str(number), str(count), str(nodes), *words]
        self._start(f"s{number}", site, command, variables)

    def _start(
        self, name: str, site: Site, words: Sequence[str], variables: Mapping[str, str]
    ) -> None:
        with self._reports.errors(name).open("w") as errors:
            self._reports.add(name, site.start(words, variables, self._reports.inlet, errors))

    def _wait(self, word: str, count: int) -> list[float]:
        return self._reports.wait_for(word, count, self._timeout)

    def _total(self, figure: Callable[[Site], float]) -> float:
        return sum(map(figure, self._sites))

    def _core_cpu(self) -> float:
        return sum(site.cpu(self._reports.process(name)) for site, name in self._cores)
