"""What pages cost: the server that has none, publishers, and others when there are many pages."""

from __future__ import annotations

import time
from contextlib import ExitStack
from pathlib import Path

from network import Network, Program, eventually
from web.visitor import Visitor

from ..clouds import Listener, Sink, publishing_figures  # noqa: TID252  # tests is no package
from ..figures import OWN, Figure  # noqa: TID252  # likewise
from .serving import TIMEOUT, percent_used, serve

__all__ = ("clouds", "idle", "many")

PLAIN = "one node"
PAGES = "/", "/graph", "/topics?topic=/chatter", "/console", "/parameters", "/plot"
TALKER = """
from rosz.node import Node
from rosz.msgs.std_msgs.msg import String
with Node("talker") as node:
    publisher = node.publisher("chatter", String)
    print("ready", flush=True)
    for _ in node.rate(10):
        publisher.publish(String("hello"))
"""


def idle(rounds: int, seconds: float = 5.0) -> list[Figure]:
    """Measure the server without pages, with an overview of an idle system, and after pages."""
    never = Figure("no page yet", "percent of a processor", {"-": "2 at most"})
    watched = Figure("an overview of an idle system", "percent of a processor", {"-": "2 at most"})
    after = Figure(f"after {len(PAGES)} pages were closed", "percent of a processor", {"-": "2"})
    left = Figure("subscriptions after pages were closed", "", {"-": "0"})
    for _ in range(rounds):
        network = Network()
        try:
            server, address = serve(network)
            time.sleep(2.0)  # what follows the start is not idling
            never.add(never.own, percent_used(server, seconds))
            page = Visitor(address)
            time.sleep(2.0)
            watched.add(watched.own, percent_used(server, seconds))
            page.close()
            network.program(TALKER).wait_for("ready", TIMEOUT)
            pages = [Visitor(address, path) for path in PAGES]
            time.sleep(3.0)
            for page in pages:
                page.close()
            view = network.node("watcher").context.graph.view

            def subscriptions() -> int:
                return len(view().subscriptions("/chatter"))  # noqa: B023  # it is used at once

            eventually(lambda: not subscriptions(), "the end of the pages", TIMEOUT)
            after.add(after.own, percent_used(server, seconds))
            left.add(left.own, subscriptions())
        finally:
            network.close()
    return [never, watched, after, left]


class _Pages:
    """Pages that show clouds while they are switched on."""

    def __init__(self, address: str, count: int) -> None:
        self._address = address
        self._count = count
        self._stack = ExitStack()
        self._visitors: list[Visitor] = []

    def switch_on(self) -> None:
        for _ in range(self._count):
            self._visitors.append(Visitor(self._address, "/topics?topic=/cloud"))

    def switch_off(self) -> float:
        came: float = sum(one.count("update") for one in self._visitors) / self._count
        for one in self._visitors:
            one.close()
        self._visitors.clear()
        return came


def clouds(rounds: int, count: int = 10) -> list[Figure]:
    """Measure how long a publisher of clouds takes, for one node and for pages that show them."""
    name = f"10 MB on {count} pages"
    seen = Figure(f"{name}: changes shown on each, of {40 * rounds}", "", {PLAIN: "-"})
    network = Network()
    try:
        pages = _Pages(serve(network)[1], count)
        sinks: dict[str, Sink] = {PLAIN: Listener(network), OWN: pages}
        return publishing_figures(name, seen, network, sinks, 2 * rounds, count=20)
    finally:
        network.close()


def many(_rounds: int, count: int = 100) -> list[Figure]:
    """Measure a hundred pages: until they are open, the server's memory, and a page among them."""
    opened = Figure(f"{count} overviews are open after", "s", {"-": ""})
    memory = Figure("memory of the server for each", "MB", {"-": ""})
    seen = Figure("a node is seen by a page beside them after", "s", {"-": ""})
    network = Network()
    try:
        server, address = serve(network)
        first = Visitor(address, "/graph")
        before, begun = _megabytes(server), time.monotonic()
        visitors = [Visitor(address) for _ in range(count)]
        opened.add(opened.own, time.monotonic() - begun)
        memory.add(memory.own, (_megabytes(server) - before) / count)
        begun = time.monotonic()
        network.node("newcomer")
        first.wait_for("newcomer")
        seen.add(seen.own, time.monotonic() - begun)
        for one in visitors:
            one.close()
        first.close()
    finally:
        network.close()
    return [opened, memory, seen]


def _megabytes(program: Program) -> float:
    pages = int(Path(f"/proc/{program.pid}/statm").read_text().split()[1])
    return pages * 4096 / 1e6
