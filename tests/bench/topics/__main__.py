"""Compares rosz with rospy and bare zenoh-python: ``python -m tests.bench.topics [FIGURE…]``.

Each round measures all systems in turn, with new processes, since how their threads fall onto the
cores changes from start to start. Printed are the medians, and the median of each round's ratio of
rosz to the other. Where Debian's rospy is not installed it is left out.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from argparse import ArgumentParser
from pathlib import Path

from .figures import FIGURES, Figure
from .processes import Lab

ROUNDS = {"timer": 3, "idle": 2, "memory": 1}


def measure(lab: Lab, name: str, rounds: int) -> dict[str, list[float]]:
    """Return what each system reached in each round."""
    figure = FIGURES[name]
    systems = [system for system in figure.systems if lab.real or not system.startswith("rospy")]
    reached: dict[str, list[float]] = {system: [] for system in systems}
    for turn in range(min(rounds, ROUNDS.get(name, rounds))):
        first = turn % len(systems)
        for system in systems[first:] + systems[:first]:
            lab.renew()
            reached[system].append(figure.measure(lab, system))
    return reached


def rows(figure: Figure, reached: dict[str, list[float]]) -> list[str]:
    """Return the rows of the table that a figure makes."""
    own, *others = figure.systems
    ours = reached[own]
    lines = []
    for other, aim in zip(others, figure.aims, strict=True):
        if other not in reached:
            continue
        theirs = reached[other]
        ratio = statistics.median(a / b for a, b in zip(ours, theirs, strict=True))
        cells = [f"{statistics.median(values):.{figure.digits}f}" for values in (ours, theirs)]
        lines.append(f"| {figure.title} | {cells[0]} | {other}: {cells[1]} | {ratio:.2f} | {aim} |")
    return lines


def main() -> None:
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("figures", nargs="*", metavar="FIGURE", help=f"of {', '.join(FIGURES)}")
    parser.add_argument("--rounds", type=int, default=7, help="how often each is measured")
    parser.add_argument("--all", action="store_true", help="print what each round gave, too")
    options = parser.parse_args()
    unknown = set(options.figures) - set(FIGURES)
    if unknown:
        parser.error(f"no such figure: {', '.join(sorted(unknown))}")
    began = time.monotonic()
    # Short, for there are sockets in it.
    with tempfile.TemporaryDirectory(prefix="rosz-") as folder:
        lab = Lab(Path(folder))
        with lab.master():
            print("| | rosz | other | ratio | aim |\n|---|---|---|---|---|", flush=True)
            for name in options.figures or FIGURES:
                reached = measure(lab, name, options.rounds)
                print("\n".join(rows(FIGURES[name], reached)), flush=True)
                if options.all:
                    for system, values in reached.items():
                        print(f"  {system}: {' '.join(f'{value:.1f}' for value in values)}")
    print(f"\n{time.monotonic() - began:.0f} s, {options.rounds} rounds")


if __name__ == "__main__":
    main()
