"""The parameter store beside ROS 1's: ``python -m tests.bench.params [ROUNDS] [MOST]``.

Starts a roscore on a port of its own, and replicas as processes that meet at a port of their own.
Every figure is measured for both in turn, round by round; the medians are printed with their ratio
and with what is asked for. Where ROS 1 is not installed, only rosz is measured. ``MOST`` replicas
are started at most.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..figures import OWN, Figure, busy, percentile, table  # noqa: TID252  # tests is no package
from .ros1 import Roscore, available

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT / "tests"))

from params.fleet import Fleet, Process, until_known  # noqa: E402  # found by the line above

WRITES = 300
READS = 20_000
PARAMS = 5_000
MESH = 50
"""Replicas that form a mesh; more are clients of a router."""

START_SECONDS = 250.0
ROS1 = "ROS 1"
ROSZ = (sys.executable, "-P", "-m", "rosz", "param")


class Bench:
    """One run.

    Args:
        folder: For files.
        roscore: ROS 1, if there is.
        rounds: How often each figure is measured.
    """

    def __init__(self, folder: Path, roscore: Roscore | None, rounds: int) -> None:
        self._folder = folder
        self._roscore = roscore
        self._rounds = rounds
        self._file = folder / "many.yaml"
        lines = (f"ns{number % 50}_{number}: {{a: {number}}}\n" for number in range(PARAMS))
        self._file.write_text("".join(lines))

    def alone(self) -> list[Figure]:
        """Measure what needs one other replica."""
        figures = [
            Figure("read in a node", "µs", {ROS1: "1 µs, and 1/200 of ROS 1"}),
            Figure("set returned, then seen by a watcher elsewhere: p95", "ms", {"": "1 ms"}),
            Figure(f"command: load {PARAMS} parameters", "s", {ROS1: "1/5 of ROS 1"}),
            Figure("command: get one parameter", "s", {ROS1: ""}),
            Figure(f"from nothing to a replica of {PARAMS} parameters", "ms", {"": "100 ms"}),
        ]
        with tempfile.TemporaryDirectory(prefix="rosz") as folder:
            fleet = Fleet(Path(folder))
            writer, watcher = fleet.start_many(2)
            watcher.do("watch", name="/bench/watched")
            for _ in range(self._rounds):
                self._round(fleet, writer, watcher, figures)
            fleet.close()
        return figures

    def sets(self, count: int, limit: float) -> list[Figure]:
        """Measure sets that so many other replicas acknowledge, and bare Zenoh doing as much."""
        figure = Figure(f"set, acknowledged by {count} other", "ms", {ROS1: f"{limit:g} x ROS 1"})
        bare = Figure(f"a put of bare Zenoh, answered by {count} other", "ms", {ROS1: ""})
        with tempfile.TemporaryDirectory(prefix="rosz") as folder:
            fleet = Fleet(Path(folder))
            if count > MESH:
                router = fleet.start(mode="router")
                clients = [fleet.start(mode="client", wait=False) for _ in range(count)]
                for client in clients:
                    client.answer(START_SECONDS)
                writer, others = clients[0], [router, *clients[1:]]
                until_known([writer], count)
            else:
                writer, *others = fleet.start_many(count + 1)
            for other in others:
                other.do("echo", key="bench/bare")
            writer.do("writes", name="/bench/value", count=20)
            for _ in range(self._rounds):
                taken = writer.do("writes", name="/bench/value", count=WRITES)
                figure.add(OWN, statistics.median(taken))
                taken = writer.do("bare", key="bench/bare", count=WRITES, echoes=count)
                bare.add(OWN, statistics.median(taken))
                if self._roscore is not None:
                    theirs = statistics.median(self._roscore.times("set", WRITES))
                    figure.add(ROS1, theirs)
                    bare.add(ROS1, theirs)
            fleet.close()
        return [figure, bare]

    def _round(
        self, fleet: Fleet, writer: Process, watcher: Process, figures: Sequence[Figure]
    ) -> None:
        read, seen, load, get, join = figures
        mine = {**os.environ, "ROSZ_RENDEZVOUS": fleet.rendezvous, "PYTHONPATH": str(ROOT)}
        read.add(OWN, writer.do("reads", count=READS))
        writer.do("writes", name="/bench/watched", count=WRITES)
        seen.add(OWN, percentile(watcher.do("delays"), 95))
        load.add(OWN, run([*ROSZ, "load", str(self._file), "/many"], mine))
        get.add(OWN, run([*ROSZ, "get", "/bench/watched"], mine))
        late = fleet.start()
        until_known([writer, watcher, late])
        join.add(OWN, late.do("joined"))
        late.kill()
        if self._roscore is not None:
            theirs = self._roscore.env
            read.add(ROS1, statistics.median(self._roscore.times("get", WRITES)))
            load.add(ROS1, run(["rosparam", "load", str(self._file), "/many"], theirs))
            get.add(ROS1, run(["rosparam", "get", "/bench/value"], theirs))


def run(words: Sequence[str], env: Mapping[str, str]) -> float:
    """Return the seconds that a command takes."""
    begun = time.perf_counter()
    subprocess.run(words, env=env, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - begun


def main() -> None:
    """Measure all, and print the table."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    most = int(sys.argv[2]) if len(sys.argv) > 2 else 50  # the second argument
    with tempfile.TemporaryDirectory(prefix="rosz") as folder:
        roscore = Roscore(Path(folder)) if available() else None
        try:
            bench = Bench(Path(folder), roscore, rounds)
            figures = bench.alone()
            for count, limit in ((1, 1.0), (10, 2.0), (50, 5.0), (200, 20.0)):
                if count <= most:
                    figures += bench.sets(count, limit)
        finally:
            if roscore is not None:
                roscore.close()
    sys.stdout.write(f"{table(figures)}\n\n{busy()}\n")


if __name__ == "__main__":
    main()
