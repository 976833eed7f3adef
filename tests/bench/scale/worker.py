"""One node of a crowd: ``worker.py NUMBER COUNT [hail]``.

Publishes one topic, once to each subscription, and tells when it first hears that of its neighbour
and when it is first hailed. It sets a parameter when told to, and ends with its standard input. A
newcomer, which hails, tells nothing but the former.
"""

from __future__ import annotations

import os
import statistics
import sys
import threading
import time
from collections.abc import Callable

import rosz
from rosz.msgs.std_msgs.msg import String

SPACE = "/crowd/"
HAIL = "/hail"
PERIOD = 0.02
SETS = 20


def tell(word: str, value: float) -> None:
    """Say something on the pipe that all write to: whole lines, which do not mix."""
    os.write(1, f"{word} {value}\n".encode())


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


def once(word: str) -> Callable[[String], None]:
    """Return a callback that tells of its first message."""
    heard = threading.Event()

    def hear(_message: String) -> None:
        if not heard.is_set():
            heard.set()
            tell(word, time.monotonic())

    return hear


def main() -> None:
    number, count = int(sys.argv[1]), int(sys.argv[2])
    with rosz.Node(f"s{number}") as node:
        node.subscription(f"{SPACE}t{(number + 1) % count}", String, once("complete"))
        own = node.publisher(f"{SPACE}t{number}", String)
        own.on_connection(lambda _: own.publish(String("here")))
        if "hail" in sys.argv[3:]:
            hail = node.publisher(HAIL, String)
            node.timer(PERIOD, lambda _: hail.publish(String("here")))
        else:
            node.subscription(HAIL, String, once("heard"))
        for line in sys.stdin:
            if line.strip() == "set":
                tell("set", median_set(node, count - 1))


if __name__ == "__main__":
    main()
