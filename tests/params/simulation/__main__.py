"""The command: plays random histories, or explores small worlds, for as long as is asked for."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from msgspec import structs

sys.path.insert(0, str(Path(__file__).parents[2]))

from params.simulation.histories import play_seed
from params.simulation.scripts import SCRIPTS
from params.simulation.search import Result  # found by the line above
from params.simulation.sweep import sweep
from params.simulation.violation import Violation


def play(steps: int, seed: int, length: int, rounds: int) -> int:
    """Play histories from one seed on, until they have taken a number of steps."""
    made = findings = 0
    first, begun, told = seed, time.monotonic(), time.monotonic()
    while made < steps:
        try:
            made += play_seed(seed, length, rounds).steps
        except Violation as violation:
            findings += 1
            print(f"seed {seed}: {violation}\n", flush=True)
        seed += 1
        if time.monotonic() - told > 10:
            told = time.monotonic()
            print(f"seed {seed}, {made} steps, {findings} findings", file=sys.stderr, flush=True)
    print(
        f"{seed - first} histories (seeds {first} to {seed - 1}), {made} steps,"
        f" {findings} findings, {time.monotonic() - begun:.0f} s"
    )
    return findings


def tell(result: Result, waiting: int) -> None:
    """Print how far an exploration is."""
    print(
        f"{result.states} states, {waiting} wait, {result.seconds:.0f} s",
        file=sys.stderr,
        flush=True,
    )


def main() -> int:
    """Read the arguments and do what they say."""
    parser = argparse.ArgumentParser(prog="python -m tests.params.simulation")
    parser.add_argument("--steps", type=int, default=1_000_000, help="steps of cores to take")
    parser.add_argument("--seed", type=int, default=0, help="first seed")
    parser.add_argument("--length", type=int, default=60, help="actions before a quiet time")
    parser.add_argument("--rounds", type=int, default=1, help="quiet times in a history")
    parser.add_argument(
        "--explore", nargs="+", choices=sorted(SCRIPTS), help="explore small worlds instead"
    )
    parser.add_argument("--states", type=int, default=1 << 32, help="states to explore at most")
    parser.add_argument("--calls", type=int, help="explore only the first calls of a world")
    parser.add_argument("--cuts", type=int, help="cuts of links in a world")
    parser.add_argument("--crashes", type=int, help="crashes in a world")
    parser.add_argument("--timers", type=int, help="timers that may fire early in a world")
    arguments = parser.parse_args()
    if arguments.explore:
        findings = 0
        for name in arguments.explore:
            script = SCRIPTS[name]
            steps = script.steps[: arguments.calls]
            given = {
                "cuts": arguments.cuts,
                "crashes": arguments.crashes,
                "advances": arguments.timers,
            }
            changes = {name: count for name, count in given.items() if count is not None}
            script = structs.replace(script, steps=steps, **changes)
            result = sweep(script, arguments.states, tell)
            print(f"{name}: {result}", flush=True)
            findings += bool(result.finding)
        return int(findings > 0)
    findings = play(arguments.steps, arguments.seed, arguments.length, arguments.rounds)
    return int(findings > 0)


if __name__ == "__main__":
    sys.exit(main())
