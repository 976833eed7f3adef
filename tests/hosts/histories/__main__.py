"""The command; see the package."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from hosts.histories.history import History  # found by the line above
from hosts.histories.play import play

WITHIN = 30.0


def seeds(words: list[str]) -> Iterator[int]:
    """Yield the seeds that the command line names."""
    for word in words:
        first, _, last = word.partition("-")
        yield from range(int(first), int(last or first) + 1)


def main() -> None:
    """Play histories, and print what became of them."""
    late = lost = written = count = 0
    ends = "--ends" in sys.argv
    for seed in seeds([word for word in sys.argv[1:] if word != "--ends"]):
        history = History.of(seed, "abcd", ends=True) if ends else History.of(seed)
        result = play(history)
        count += 1
        written += result.written
        lost += len(result.lost)
        late += result.seconds is None or result.seconds > WITHIN
        took = "NEVER" if result.seconds is None else f"{result.seconds:.1f} s"
        print(f"{seed}: together after {took}, {result.written} writes, ", end="")
        print(f"{len(result.lost)} lost {result.lost[:5] or ''}; {history}", flush=True)
        for restart in result.restarts:
            print(f"  {restart}", flush=True)
        if result.views:
            print(json.dumps(result.views), flush=True)
    print(f"{count} histories, {late} not together within {WITHIN:g} s,", end=" ")
    print(f"{written} acknowledged writes, {lost} of them lost")
    sys.exit(bool(late or lost))


if __name__ == "__main__":
    main()
