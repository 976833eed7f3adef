"""One node of a crowd: ``worker.py NUMBER COUNT [hail]``.

Tells when it sees so many of its kind and when it is first hailed, sets a parameter when told to,
and ends with its standard input. A newcomer, which hails, tells nothing but the former.
"""

from __future__ import annotations

import os
import statistics
import sys
import threading
import time

import rosz
from rosz.msgs.std_msgs.msg import String
from rosz.wire import Kind, Token

SPACE = "/crowd/"
HAIL = "/hail"
PERIOD = 0.02
SETS = 20


def tell(word: str, value: float) -> None:
    """Say something on the pipe that all write to: whole lines, which do not mix."""
    os.write(1, f"{word} {value}\n".encode())


class Census:
    """Tells when it has seen enough.

    Args:
        count: How many.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._seen: set[str] = set()

    def take(self, token: Token, alive: bool) -> None:
        """Count a node by the topic that it publishes."""
        if alive and token.kind is Kind.PUBLISHER and token.name.startswith(SPACE):
            known = len(self._seen)
            self._seen.add(token.name)
            if known < len(self._seen) == self._count:
                tell("complete", time.monotonic())


def median_set(node: rosz.Node, others: int) -> float:
    """Return the seconds that a set takes which so many others acknowledge."""
    while len(node.context.params.members()) < others:
        time.sleep(0.01)
    taken = []
    for value in range(SETS):
        began = time.perf_counter()
        node.params.set("/scale/value", value)
        taken.append(time.perf_counter() - began)
    return statistics.median(taken)


def main() -> None:
    number, count = sys.argv[1], int(sys.argv[2])
    hailed = threading.Event()

    def hear(_message: String) -> None:
        if not hailed.is_set():
            hailed.set()
            tell("heard", time.monotonic())

    with rosz.Node(f"s{number}") as node:
        node.context.graph.listen(Census(count).take)
        node.publisher(f"{SPACE}t{number}", String)
        if "hail" in sys.argv[3:]:
            hail = node.publisher(HAIL, String)
            node.timer(PERIOD, lambda _: hail.publish(String("here")))
        else:
            node.subscription(HAIL, String, hear)
        for line in sys.stdin:
            if line.strip() == "set":
                tell("set", median_set(node, count - 1))


if __name__ == "__main__":
    main()
