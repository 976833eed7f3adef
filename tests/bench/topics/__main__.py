"""Compares rosz with rospy and bare zenoh-python: ``python -m tests.bench.topics [FIGURE…]``.

Each round measures all systems in turn, with new processes, since how their threads fall onto the
cores changes from start to start. Printed are the medians, and the median of each round's ratio of
rosz to the other. rospy has a queue of 10, as its documentation advises; without one it sends in
the caller's thread, and a slow subscriber blocks it: that is printed, too, where it matters. Where
Debian's rospy is not installed it is left out.
"""

from __future__ import annotations

import sys
import tempfile
import time
from argparse import ArgumentParser
from pathlib import Path

from ..figures import busy, table  # noqa: TID252  # tests is no package
from .measures import MEASURES, ROSPY, Measure
from .processes import Lab


def run(lab: Lab, measure: Measure, rounds: int) -> None:
    """Measure one thing for each system in turn, so many rounds."""
    figure = measure.figure
    systems = [one for one in figure.systems if lab.real or not one.startswith(ROSPY)]
    for turn in range(min(rounds, measure.rounds)):
        first = turn % len(systems)
        for system in systems[first:] + systems[:first]:
            lab.renew()
            figure.add(system, measure.take(lab, system))


def main() -> None:
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("figures", nargs="*", metavar="FIGURE", help=f"of {', '.join(MEASURES)}")
    parser.add_argument("--rounds", type=int, default=7, help="how often each is measured")
    parser.add_argument("--all", action="store_true", help="print what each round gave, too")
    options = parser.parse_args()
    unknown = set(options.figures) - set(MEASURES)
    if unknown:
        parser.error(f"no such figure: {', '.join(sorted(unknown))}")
    chosen = [MEASURES[name] for name in options.figures or MEASURES]
    began = time.monotonic()
    # Short, for there are sockets in it.
    with tempfile.TemporaryDirectory(prefix="rosz-") as folder:
        lab = Lab(Path(folder))
        with lab.master():
            for measure in chosen:
                run(lab, measure, options.rounds)
                for row in measure.figure.rows():
                    print("; ".join(filter(None, row)), file=sys.stderr, flush=True)
    print(table(measure.figure for measure in chosen))
    if options.all:
        for measure in chosen:
            for system, values in measure.figure.found.items():
                shown = " ".join(f"{value:.3g}" for value in values)
                print(f"{measure.figure.name}, {system}: {shown}")
    print(f"\n{options.rounds} rounds in {time.monotonic() - began:.0f} s, {busy()}")


if __name__ == "__main__":
    main()
