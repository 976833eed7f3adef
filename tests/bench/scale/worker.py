"""One of many nodes: tells when it sees all others, then does what it is told."""

from __future__ import annotations

import statistics
import sys
import time

import rosz
from rosz.msgs.std_msgs.msg import String

PATIENCE = 300.0
SETS = 20


def main() -> None:
    number, count = int(sys.argv[1]), int(sys.argv[2])
    with rosz.Node(f"s{number}") as node:
        node.publisher(f"t{number}", String)
        node.context.graph.wait_for(
            lambda view: len(view.topics()) >= count and len(view.nodes()) >= count,
            PATIENCE,
            "all others",
        )
        sys.stdout.write(f"complete {time.monotonic()}\n")
        sys.stdout.flush()
        for line in sys.stdin:
            if line.strip() == "set":
                sys.stdout.write(f"set {_set(node)}\n")
                sys.stdout.flush()


def _set(node: rosz.Node) -> float:
    """Return the seconds that an acknowledged set takes."""
    taken = []
    for value in range(SETS):
        began = time.perf_counter()
        node.params.set("/scale/value", value)
        taken.append(time.perf_counter() - began)
    return statistics.median(taken)


if __name__ == "__main__":
    main()
