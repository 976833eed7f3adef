"""How long pages take to come, to draw and to change, in a browser."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from network import Network, Program, eventually
from web.robot import open_browser

from ..figures import Figure  # noqa: TID252  # tests is no package
from .serving import TIMEOUT, percent_used, serve

__all__ = ("graph", "plot", "start")

NODES, TOPICS, FIELDS, RATE = 100, 300, 20, 100.0
_PAINT = """
const paint = performance.getEntriesByType('paint')
  .find((one) => one.name === 'first-contentful-paint');
return paint ? (performance.timeOrigin + paint.startTime) / 1000 : null;
"""
# Waits in the browser: one that is asked all the time has none left to draw.
_BOXES = """
const [count, done] = arguments;
const look = () => document.querySelectorAll('.rosz-graph [data-key]').length === count;
const paint = () => requestAnimationFrame(() => setTimeout(() => done(true)));
if (look()) return paint();
new MutationObserver((_, observer) => {
  if (!look()) return;
  observer.disconnect();
  paint();
}).observe(document, {childList: true, subtree: true});
"""
_NEWEST = """
const chart = Object.values(mounted_app.$refs).find((one) => one && one.chart)?.chart;
const newest = chart ? chart.getOption().series.map((one) => one.data.at(-1)?.at(-1) ?? 0) : [];
return [newest.length, Date.now() / 1000 - Math.min(...newest)];
"""
# Each node publishes three topics, and subscribes to three that it chooses.
SYSTEM = """
import random, sys
from contextlib import ExitStack
from rosz.node import Context, Node
from rosz.msgs.std_msgs.msg import String
nodes, topics = int(sys.argv[1]), int(sys.argv[2])
random.seed(1)
with ExitStack() as stack:
    context = stack.enter_context(Context())
    made = [stack.enter_context(Node(f"node{n}", context=context)) for n in range(nodes)]
    for n in range(topics):
        made[n % nodes].publisher(f"/topic{n}", String)
        made[random.randrange(nodes)].subscription(f"/topic{n}", String, print)
    print("ready", flush=True)
    for number, _ in enumerate(sys.stdin):
        made[0].publisher(f"/topic0/added{number}", String)
        made[1].subscription(f"/topic0/added{number}", String, print)
"""
WAVES = """
import sys, time
from rosz.node import Node
from rosz.msgs.std_msgs.msg import Float64
with Node("waves") as node:
    publishers = [node.publisher(f"/wave{n}", Float64) for n in range(int(sys.argv[1]))]
    print("ready", flush=True)
    for _ in node.rate(float(sys.argv[2])):
        for publisher in publishers:
            publisher.publish(Float64(time.time()))
"""


@contextmanager
def _pages(script: str, *argv: str) -> Iterator[tuple[Any, Program, Program, str]]:
    """Give a browser, a program, a server of pages that show it, and the server's address."""
    network = Network()
    try:
        with open_browser() as browser:
            program = network.program(script, *argv)
            program.wait_for("ready", TIMEOUT)
            server, address = serve(network)
            yield browser, program, server, address
    finally:
        network.close()


def start(rounds: int) -> list[Figure]:
    """Measure the time from starting the server until the browser has painted something."""
    figure = Figure("start until the first paint", "s", {"-": "3 at most"})
    with open_browser() as browser:
        for _ in range(rounds):
            network = Network()
            try:
                begun = time.time()
                browser.get(serve(network)[1])
                eventually(lambda: browser.execute_script(_PAINT), "a paint", TIMEOUT)
                figure.add(figure.own, browser.execute_script(_PAINT) - begun)
            finally:
                network.close()
    return [figure]


def graph(rounds: int) -> list[Figure]:
    """Measure until a large graph is drawn, and until what is added to it is seen."""
    name = f"graph of {NODES} nodes and {TOPICS} topics"
    drawn = Figure(f"{name}: drawn", "s", {"-": "2 at most"})
    changed = Figure(f"{name}: what is added is seen", "s", {"-": "0.5 at most"})
    cost = Figure(f"{name}: open, unchanged", "percent of a processor", {"-": ""})
    with _pages(SYSTEM, str(NODES), str(TOPICS)) as (browser, program, server, address):
        for _ in range(rounds):
            browser.get("about:blank")
            begun, boxes = time.monotonic(), NODES + TOPICS
            browser.get(f"{address}/graph?content=all")
            boxes += len(changed.found.get(changed.own, ()))  # those that were added
            _wait_for_boxes(browser, boxes)
            drawn.add(drawn.own, time.monotonic() - begun)
            time.sleep(2.0)  # what follows the opening is no refresh
            begun = time.monotonic()
            program.say("add")
            _wait_for_boxes(browser, boxes + 1)
            changed.add(changed.own, time.monotonic() - begun)
            cost.add(cost.own, percent_used(server, 5.0))
    return [drawn, changed, cost]


def _wait_for_boxes(browser: Any, count: int) -> None:
    """Wait until the graph has boxes, and is painted."""
    browser.set_script_timeout(TIMEOUT)
    browser.execute_async_script(_BOXES, count)


def plot(rounds: int) -> list[Figure]:
    """Measure how old the newest values of plotted fields are in the browser, and the cost."""
    name = f"{FIELDS} fields at {RATE:g} Hz plotted"
    age = Figure(f"{name}: oldest of the newest values", "s", {"-": "not growing"})
    cost = Figure(f"{name}: the server", "percent of a processor", {"-": ""})
    fields = ",".join(f"/wave{number}/data" for number in range(FIELDS))
    with _pages(WAVES, str(FIELDS), str(RATE)) as (browser, _, server, address):
        browser.get(f"{address}/plot?fields={fields}")

        def complete() -> bool:
            count, oldest = browser.execute_script(_NEWEST)
            return bool(count == FIELDS and oldest < TIMEOUT)

        eventually(complete, "all series", TIMEOUT)
        for _ in range(rounds):
            cost.add(cost.own, percent_used(server, 10.0))
            age.add(age.own, browser.execute_script(_NEWEST)[1])
    return [age, cost]
