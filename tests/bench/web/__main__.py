"""The page in Debian's Chromium: ``python -m tests.bench.web``.

How long the page takes to start, to draw and to change a graph of 100 nodes and 300 topics; how old
the newest of 20 plotted fields at 100 Hz are; the processor time of the server; and how long a node
takes to publish clouds of 10 MB that ten pages show, beside one node, in turn.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from ..figures import Figure, busy, table  # found by the line above  # noqa: TID252  # tests is no package
from . import cost, drawing


def main() -> None:
    """Measure, and print the figures."""
    parts: dict[str, Callable[[int], list[Figure]]] = {
        "start": drawing.start,
        "graph": drawing.graph,
        "plot": drawing.plot,
        "idle": cost.idle,
        "clouds": cost.clouds,
        "many": cost.many,
    }
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3, help="how often each is measured")
    parser.add_argument("--only", choices=parts, help="one part")
    options = parser.parse_args()
    figures: list[Figure] = []
    for name, measure in parts.items():
        if options.only in (None, name):
            figures += measure(options.rounds)
    print(table(figures))
    print(busy())


if __name__ == "__main__":
    main()
