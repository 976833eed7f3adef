"""Crowds of 10 to 200 nodes, joined in several ways: ``python -m tests.bench.scale``.

Each node is a process, all start at once, and nothing else is on their network. On one host:
``mesh``, peers that link to each other, as nodes are by themselves, ``star``, clients of one core,
as a launch of many nodes makes them, and ``bare``, the same with nothing but Zenoh. Over several
hosts (``--hosts``, needs privileges):

- ``mesh``: peers that find each other by multicast, linked across hosts;
- ``star``: clients of the core of the first host;
- ``cores``: a core on each host, linked to the first one's, and peers around each;
- ``stars``: the same with clients.
"""

from __future__ import annotations

import math
import signal
import sys
from argparse import ArgumentParser, Namespace, RawDescriptionHelpFormatter
from pathlib import Path

from ..figures import busy  # noqa: TID252  # tests is no package

sys.path.insert(0, str(Path(__file__).parents[2]))

from hosts.world import why_not  # found by the line above

from .crowd import TOPOLOGIES, Sight, measure
from .plot import plot

HEAD = (
    "nodes",
    "",
    "all heard, s",
    "core seconds each",
    "traffic each, kB",
    "MB each",
    "idle each, %",
    "set, ms",
    "newcomer, s",
)


def row(sight: Sight) -> str:
    """Return what was measured of a crowd as a row in Markdown."""
    figures = (
        *(sight.complete, sight.busy, sight.traffic, sight.memory),
        *(sight.idle, sight.set_ms, sight.newcomer),
    )
    cells = ("-" if math.isnan(figure) else f"{figure:.3g}" for figure in figures)
    return f"| {sight.count} | {sight.mode} | {' | '.join(cells)} | {sight.trouble}".rstrip()


def options() -> Namespace:
    """Read the command line."""
    parser = ArgumentParser(description=__doc__, formatter_class=RawDescriptionHelpFormatter)
    parser.add_argument("--counts", default="10,20,40,80,140,200")
    parser.add_argument("--hosts", type=int, default=1, choices=range(1, 5), help="1 to 4")
    parser.add_argument("--modes", help=f"of {','.join(TOPOLOGIES)}; all that differ by default")
    parser.add_argument("--timeout", type=float, default=120.0, help="seconds for each step")
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
                print(f"| {count} | {mode} |{' - |' * 7} left out", flush=True)
                continue
            sight = measure(mode, count, given.hosts, given.timeout)
            print(row(sight), flush=True)
            sights.append(sight)
            if sight.late:
                late.add(mode)
    if given.plot:
        given.plot.write_text(plot(sights))
        print(f"wrote {given.plot}", file=sys.stderr)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
