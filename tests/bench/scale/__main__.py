"""Mesh against star from 10 to 200 nodes: ``python -m tests.bench.scale [--counts 10,50]``.

A mesh is peers, each linked to each, as nodes are by themselves; a star is clients of one core
(``ROSZ_MODE=client``, as a launch of many nodes sets it). Each node is a process, and all start at
once.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from pathlib import Path

from .crowd import Crowd, Sight
from .plot import plot

HEAD = "| nodes | | graph complete, s | MB each | idle, % | traffic each, kB | set, ms |"


def row(sight: Sight) -> str:
    cells = (sight.complete, sight.memory, sight.cpu, sight.traffic, sight.set_ms)
    return f"| {sight.count} | {sight.mode} | {' | '.join(f'{cell:.3g}' for cell in cells)} |"


def main() -> None:
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--counts", default="10,20,40,80,140,200")
    parser.add_argument("--timeout", type=float, default=120.0, help="seconds to be complete in")
    parser.add_argument("--plot", type=Path, help="write a picture there (SVG)")
    options = parser.parse_args()
    sights: list[Sight] = []
    late: set[str] = set()
    print(HEAD, "|---|---|---|---|---|---|---|", sep="\n", flush=True)
    for count in map(int, options.counts.split(",")):
        for mode in ("mesh", "star"):
            if mode in late:
                continue
            with Crowd(mode, count) as crowd:
                sight = crowd.measure(options.timeout)
            if sight is None:
                late.add(mode)
                print(f"| {count} | {mode} | over {options.timeout:g} | | | | |", flush=True)
                continue
            sights.append(sight)
            print(row(sight), flush=True)
    if options.plot and sights:
        options.plot.write_text(plot(sights))
        print(f"wrote {options.plot}", file=sys.stderr)


if __name__ == "__main__":
    main()
