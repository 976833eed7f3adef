"""Crowds of 10 to 500 nodes, joined in several ways: ``python -m tests.bench.scale``.

Each node is a process, all start at once, and nothing else is on their network. On one host:
``mesh``, peers that link to each other, as nodes are by themselves, ``star``, clients of one core,
as a launch of many nodes makes them, ``shared``, the same with twenty nodes in each process, and
``bare``, clients with nothing but Zenoh. Over several hosts (``--hosts``, needs privileges):

- ``mesh``: peers that find each other by multicast, linked across hosts;
- ``star``: clients of the core of the first host;
- ``cores``: a core on each host, linked to the first one's, and peers around each;
- ``stars``: the same with clients.
"""

from __future__ import annotations

import json
import math
import signal
import sys
from argparse import ArgumentParser, Namespace, RawDescriptionHelpFormatter
from collections.abc import Iterable, Iterator
from pathlib import Path

import msgspec

from ..figures import busy  # noqa: TID252  # tests is no package

sys.path.insert(0, str(Path(__file__).parents[2]))

from hosts.world import why_not  # found by the line above

from .crowd import TOPOLOGIES, measure
from .plot import plot
from .sight import STEPS, Sight

HEAD = (
    "nodes",
    "",
    "all heard, s",
    "CPU each, s",
    "of the core, s",
    "discovery each, kB",
    "MB each",
    "idle each, %",
    "set, ms",
    "newcomer, s",
    "death known, s",
    "CPU each for it, ms",
)


def row(sight: Sight) -> str:
    """Return what was measured of a crowd as a row in Markdown."""
    figures = (
        *(sight.complete, sight.busy, sight.core, sight.traffic, sight.memory, sight.idle),
        *(sight.set_ms, sight.newcomer, sight.death, sight.death_cpu),
    )
    cells = ("-" if math.isnan(figure) else f"{figure:.3g}" for figure in figures)
    return f"| {sight.count} | {sight.mode} | {' | '.join(cells)} | {sight.trouble}".rstrip()


def split(sights: Iterable[Sight]) -> Iterator[str]:
    """Yield a table of the processor time of each step of a start."""
    yield f"\n| CPU of a process, ms | | {' | '.join(STEPS)} |"
    yield "|---" * (2 + len(STEPS)) + "|"
    for sight in sights:
        if sight.steps:
            cells = (f"{sight.steps[step]:.3g}" for step in STEPS)
            yield f"| {sight.count} | {sight.mode} | {' | '.join(cells)} |"


def known(sight: Sight) -> dict[str, object]:
    """Return what was measured of a crowd, for JSON, which has no number for what was not."""
    fields = msgspec.to_builtins(sight).items()
    return {name: value for name, value in fields if not isinstance(value, float) or value >= 0}


def options() -> Namespace:
    """Read the command line."""
    parser = ArgumentParser(description=__doc__, formatter_class=RawDescriptionHelpFormatter)
    parser.add_argument("--counts", default="10,20,40,80,140,200")
    parser.add_argument("--hosts", type=int, default=1, choices=range(1, 5), help="1 to 4")
    parser.add_argument("--modes", help=f"of {','.join(TOPOLOGIES)}; all that differ by default")
    parser.add_argument("--timeout", type=float, default=300.0, help="seconds for each step")
    parser.add_argument("--rate", type=float, default=math.inf, help="nodes that start per second")
    parser.add_argument("--json", type=Path, help="write the figures there")
    parser.add_argument("--plot", type=Path, help="write a picture there (SVG)")
    given = parser.parse_args()
    given.counts = [int(word) for word in given.counts.split(",")]
    several = given.hosts > 1
    given.modes = (
        given.modes.split(",")
        if given.modes
        else [mode for mode, one in TOPOLOGIES.items() if several or one.cores != "each"]
    )
    for mode in given.modes:
        if mode not in TOPOLOGIES:
            parser.error(f"'{mode}' is none of {', '.join(TOPOLOGIES)}")
    reason = why_not()
    if reason and several:
        parser.error(f"several hosts: {reason}")
    if reason:
        print(f"{reason}: traffic of others over this machine's loopback counts", file=sys.stderr)
        given.hosts = 0
    return given


def main() -> None:
    """Measure each crowd, the small ones first."""
    given = options()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.default_int_handler)
    print(f"{max(1, given.hosts)} host(s), {busy()}\n", file=sys.stderr)
    print(f"| {' | '.join(HEAD)} |", f"|{'---|' * len(HEAD)}", sep="\n", flush=True)
    sights: list[Sight] = []
    late: set[str] = set()
    for count in given.counts:
        for mode in given.modes:
            if mode in late:
                print(f"| {count} | {mode} |{' - |' * 10} left out", flush=True)
                continue
            sight = measure(mode, count, given.hosts, given.timeout, given.rate)
            print(row(sight), flush=True)
            sights.append(sight)
            if sight.late:
                late.add(mode)
    print(*split(sights), sep="\n")
    if given.json:
        given.json.write_text(json.dumps([*map(known, sights)], indent=1) + "\n")
    if given.plot:
        given.plot.write_text(plot(sights))
        print(f"wrote {given.plot}", file=sys.stderr)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
