"""The bridges for other programs' clients: ``python -m tests.bench.doors [--library FOLDER]``.

Rates of conversions stand beside those of rosbridge_library, in both directions. Then a node
publishes clouds of 10 MB, to one node and to eight clients of a bridge in turn: publishing should
take no longer. Images of 6 MB go to a Foxglove client, beside Foxglove's own library if it is
installed. The last figures are the processor time of bridges whose client is silent.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from ..figures import busy, table  # found by the line above  # noqa: TID252  # tests is no package
from . import foxglove
from .conversions import measure
from .websocket import clouds, idle


def main() -> None:
    """Measure, and print the figures."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--library", type=Path, help="rosbridge_library/src of a ROS 1 checkout")
    parser.add_argument("--rounds", type=int, default=3, help="how often each is measured")
    parser.add_argument(
        "--only", choices=("conversions", "clouds", "images", "idle"), help="one part"
    )
    options = parser.parse_args()
    figures = []
    if options.only in (None, "conversions"):
        figures += measure(options.library, options.rounds, 1.0)
    if options.only in (None, "clouds"):
        figures += clouds(options.rounds)
    if options.only in (None, "images"):
        figures += foxglove.images(options.rounds)
    if options.only in (None, "idle"):
        figures += [idle(10.0), foxglove.idle(10.0)]
    print(table(figures))
    print(busy())


if __name__ == "__main__":
    main()
