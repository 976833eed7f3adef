"""One process of a crowd: ``worker.py NUMBER COUNT NODES [hail]``.

Its nodes, from that number on, each publish one topic, once to each subscription, and tell when
they first hear that of their neighbour, when that has gone, and when they are first hailed. It
tells the processor time that each step of its start took, sets a parameter when told to, and ends
with its standard input. A newcomer, which hails, tells nothing but the first.
"""

from __future__ import annotations

import time

python = time.process_time()

# ruff: noqa: E402  # the time of the imports is measured
import os
import sys
import threading
from collections.abc import Callable
from contextlib import ExitStack

import rosz
from rosz import Context, Node
from rosz.msgs.std_msgs.msg import String

imports = time.process_time()

SPACE = "/crowd/"
HAIL = "/hail"
PERIOD = 0.02
SETS = 20


def tell(word: str, value: float) -> None:
    """Say something on the pipe that all write to: whole lines, which do not mix."""
    os.write(1, f"{word} {value}\n".encode())


def median_set(node: rosz.Node, others: int) -> float:
    """Return the seconds that a set takes which so many others acknowledge."""
    import statistics  # which others need not import

    while len(node.context.params.members()) < others:
        time.sleep(0.01)
    taken = []
    for value in range(SETS):
        began = time.perf_counter()
        node.params.set("/scale/value", value)
        taken.append(time.perf_counter() - began)
    return statistics.median(taken)


def once(word: str, then: Callable[[], None] | None = None) -> Callable[[String], None]:
    """Return a callback that tells of its first message."""
    heard = threading.Event()

    def hear(_message: String) -> None:
        if not heard.is_set():
            heard.set()
            tell(word, time.monotonic())
            if then is not None:
                then()

    return hear


class Start:
    """The processor time that each step of the start takes, told when all nodes are complete.

    Args:
        nodes: How many there are.

    Attributes:
        declared: Set when all is declared.
    """

    def __init__(self, nodes: int) -> None:
        self._missing = nodes
        self._lock = threading.Lock()
        self._marks = [0.0, python, imports]
        self.declared = threading.Event()

    def mark(self) -> None:
        """Note that a step is done."""
        self._marks.append(time.process_time())

    def complete(self) -> None:
        """Note that a node has heard its neighbour."""
        with self._lock:
            self._missing -= 1
            if self._missing:
                return
        self.declared.wait()
        self.mark()
        steps = ("python", "imports", "session", "declares", "discovery")
        for step, begin, end in zip(steps, self._marks[:-1], self._marks[1:], strict=True):
            tell(step, end - begin)


def make(context: Context, number: int, count: int, start: Start, *, hails: bool) -> Node:
    """Make one node of the crowd."""
    node = rosz.Node(f"s{number}", context=context)
    node.subscription(f"{SPACE}t{(number + 1) % count}", String, once("complete", start.complete))
    own = node.publisher(f"{SPACE}t{number}", String)
    own.on_connection(
        lambda _: own.publish(String("here")), lambda _: tell("gone", time.monotonic())
    )
    if hails:
        hail = node.publisher(HAIL, String)
        node.timer(PERIOD, lambda _: hail.publish(String("here")))
    else:
        node.subscription(HAIL, String, once("heard"))
    return node


def main() -> None:
    first, count, nodes = map(int, sys.argv[1:4])
    start = Start(nodes)
    with Context() as context, ExitStack() as stack:
        start.mark()
        made = [
            stack.enter_context(make(context, number, count, start, hails="hail" in sys.argv[4:]))
            for number in range(first, first + nodes)
        ]
        start.mark()
        start.declared.set()
        for line in sys.stdin:
            if line.strip() == "set":
                tell("set", median_set(made[0], (count - 1) // nodes))


if __name__ == "__main__":
    main()
