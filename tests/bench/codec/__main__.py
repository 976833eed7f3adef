"""Compares codecs in one interleaved run: ``python -m tests.bench.codec``.

All libraries work in this process, in turn, on the same values; the best of several rounds counts.
What is missing (genpy comes with Debian's ROS 1 packages, rosbags from PyPI) is left out. Printed
is how many times as fast as each of them rosz is, encoding / decoding. Debian builds its Python for
speed: ``PYTHONPATH=<site-packages of the environment> /usr/bin/python3 -m tests.bench.codec``.
"""

from __future__ import annotations

import sys
import time
from argparse import ArgumentParser
from collections.abc import Callable, Iterator
from typing import Any

from .cases import CASES, VARIANTS
from .systems import Genpy, Rosbags, Rosz, RoszInRos1, System


def available() -> Iterator[System]:
    for system in (Rosz, RoszInRos1, Genpy, Rosbags):
        try:
            yield system()
        except ImportError as error:
            sys.stderr.write(f"without {system.name}: {error}\n")


def seconds(work: Callable[[Any], Any], inputs: list[Any], times: int) -> float:
    """Return the seconds that one call takes."""
    rounds = range(max(times // len(inputs), 1))
    begin = time.perf_counter()
    for _ in rounds:
        for one in inputs:
            work(one)
    return (time.perf_counter() - begin) / (len(rounds) * len(inputs))


def measure(systems: list[System], rounds: int) -> dict[tuple[str, str], tuple[float, float]]:
    """Return seconds to encode and to decode, by case and system."""
    result: dict[tuple[str, str], tuple[float, float]] = {}
    for title, type_name, make, times in CASES:
        variants = [make(n) for n in range(VARIANTS)]
        work = []
        for system in systems:
            codec = system.codec(type_name)
            messages = [codec.build(plain) for plain in variants]
            work.append((system.name, codec, messages, [bytes(codec.encode(m)) for m in messages]))
        best = {system.name: (1e9, 1e9) for system in systems}
        for _ in range(rounds):
            for name, codec, messages, encoded in work:
                taken = (
                    seconds(codec.encode, messages, times),
                    seconds(codec.decode, encoded, times),
                )
                best[name] = (min(best[name][0], taken[0]), min(best[name][1], taken[1]))
        result |= {(title, name): pair for name, pair in best.items()}
    return result


def main() -> None:
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=25, help="how often each is measured")
    parser.add_argument("--times", action="store_true", help="print microseconds too")
    options = parser.parse_args()
    systems = list(available())
    figures = measure(systems, options.rounds)
    print(f"Python {sys.version.split()[0]}; times as fast, encode / decode\n")
    titles = [case[0] for case in CASES]
    print("| as | " + " | ".join(titles) + " |")
    print("|---" * (len(titles) + 1) + "|")
    for name, own, other in (
        *((system.name, Rosz.name, system.name) for system in systems[2:]),
        ("genpy, ROS 1's layout", RoszInRos1.name, Genpy.name),
    ):
        if any(system.name == other for system in systems):
            pairs = [(figures[title, own], figures[title, other]) for title in titles]
            cells = [f"{b[0] / a[0]:.1f} / {b[1] / a[1]:.1f}" for a, b in pairs]
            print(f"| {name} | " + " | ".join(cells) + " |")
    if options.times:
        for system in systems:
            cells = [
                "{:.2f} / {:.2f}".format(*(1e6 * s for s in figures[t, system.name]))
                for t in titles
            ]
            print(f"| {system.name} µs | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
