"""Compares lookups of transforms with Debian's tf2: ``python -m tests.bench.transforms``.

Both sides run in turn, each under its own Python; the best round of each counts, in processor time.
"""

from __future__ import annotations

import json
import subprocess
import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path

SIDE = Path(__file__).with_name("side.py")
SIDES = {"rosz": sys.executable, "tf2": "/usr/bin/python3"}


def main(argv: Sequence[str]) -> int:
    """Print a table of microseconds, or megabytes, for both sides."""
    parser = ArgumentParser(prog="python -m tests.bench.transforms")
    parser.add_argument("--rounds", type=int, default=3)
    rounds = parser.parse_args(argv).rounds
    best: dict[str, dict[str, float]] = {side: {} for side in SIDES}
    for _ in range(rounds):
        for side, python in SIDES.items():
            output = subprocess.run([python, str(SIDE)], check=True, capture_output=True).stdout
            for name, value in json.loads(output).items():
                best[side][name] = min(best[side].get(name, value), value)
    for name, ours in best["rosz"].items():
        theirs = best["tf2"][name]
        unit, scale = ("MB", 1.0) if name in {"memory", "growth"} else ("µs", 1e6)
        ratio = f"{ours / theirs:.1f} times" if theirs else ""
        print(f"{name:22} {ours * scale:8.1f} {theirs * scale:8.1f} {unit}  {ratio}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
