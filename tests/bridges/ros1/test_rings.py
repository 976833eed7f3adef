"""Bridges in a ring: nothing crosses a second one, so nothing comes back."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from functools import partial
from queue import SimpleQueue
from typing import Any, cast
from xmlrpc.client import ServerProxy

import pytest
from network import TIMEOUT, Network, eventually

from rosz.bridges.ros1 import AttachedBridge, MasterBridge
from rosz.msgs.std_msgs.msg import String
from rosz.node import Node

pytestmark = [pytest.mark.system]


class Place:
    """A network with a master, and a node that publishes and hears one topic."""

    def __init__(self, name: str, stack: ExitStack) -> None:
        self.name = name
        self.network = Network()
        stack.callback(self.network.close)
        self.master = stack.enter_context(MasterBridge(self.network.environment(), port=0))
        self.node: Node = self.network.node(name)
        self.publisher = self.node.publisher("/said", String, queue_size=100)
        self.heard: SimpleQueue[Any] = SimpleQueue()
        self.node.subscription("/said", String, self.heard.put, queue_size=100)
        self.all: list[str] = []
        self.bridge: Any = None

    def join(self, other: Place) -> AttachedBridge:
        """Return a bridge of this network to the master of another one."""
        return AttachedBridge(f"http://127.0.0.1:{other.master.port}", self.network.environment())

    def wait_for(self, text: str) -> None:
        """Wait until the node has heard a text."""
        while not self.all or self.all[-1] != text:
            self.all.append(self.heard.get(timeout=TIMEOUT).data)


def _reaches(place: Place, other: Place) -> bool:
    """Publish something at a place, and return whether anything of it has come to another one."""
    place.publisher.publish(f"{place.name} begins {time.monotonic_ns()}")
    while not other.heard.empty():
        other.all.append(other.heard.get().data)
    return any(text.startswith(f"{place.name} begins") for text in other.all)


@pytest.fixture(params=[2, 3])
def ring(request: pytest.FixtureRequest) -> Iterator[list[Place]]:
    with ExitStack() as stack:
        places = [Place(f"n{number}", stack) for number in range(request.param)]
        for number, place in enumerate(places):
            place.bridge = stack.enter_context(place.join(places[number - 1]))
        for number, place in enumerate(places):
            eventually(partial(_reaches, place, places[number - 1]))
        yield places


def test_nothing_goes_round(ring: list[Place]) -> None:
    # Each text goes one bridge on; in a ring without an end, the first would be back by then.
    for round_number in range(3):
        for number in range(len(ring), 0, -1):
            place, before = ring[number % len(ring)], ring[number - 1]
            text = f"{place.name} {round_number}"
            place.publisher.publish(text)
            place.wait_for(text)
            before.wait_for(text)
    for place in ring:
        assert sorted(place.all) == sorted(set(place.all)), "nothing comes twice"
    first = ring[0]
    first.node.params["/round"] = 1
    eventually(lambda: all(place.node.params.get("/round", None) == 1 for place in ring))
    # A value that is on its way to a master could overwrite the next one there.
    eventually(lambda: all(place.bridge._params._agreed.get("round") == 1 for place in ring))
    ring[-1].node.params["/round"] = 2
    eventually(lambda: all(place.node.params.get("/round", None) == 2 for place in ring))


@pytest.mark.parametrize("ring", [2], indirect=True)
def test_a_late_bridge_does_not_take_back_a_change(ring: list[Place]) -> None:
    first, second = ring
    release, done = threading.Event(), threading.Event()
    worker = first.bridge._params._worker
    worker.submit(lambda: release.wait(TIMEOUT))
    first.node.params["/late"] = 1
    eventually(lambda: second.node.params.get("/late", None) == 1)  # by the other bridge
    second.node.params["/late"] = 2
    late = first.bridge._params._shared.context.params  # as the bridge itself has them
    eventually(lambda: late.lookup(("late",)) == 2)
    release.set()
    worker.submit(done.set)
    assert done.wait(TIMEOUT)
    assert second.node.params["/late"] == 2


def test_a_bridge_refuses_the_master_of_its_own_network(
    network: Network, caplog: pytest.LogCaptureFixture
) -> None:
    with MasterBridge(network.environment(), port=0) as master:
        uri = f"http://127.0.0.1:{master.port}"
        with AttachedBridge(uri, network.environment()):
            eventually(lambda: "it belongs to this network already" in caplog.text)
            assert not master.nodes()


def test_a_change_that_a_master_tells_late_is_not_taken_back() -> None:
    with ExitStack() as stack:
        place, other = (Place(name, stack) for name in ("here", "there"))
        stack.enter_context(place.join(other))
        eventually(partial(_reaches, place, other))
        master = stack.enter_context(ServerProxy(f"http://127.0.0.1:{other.master.port}"))
        (_, _, (publishers, _, _)) = cast("Any", master.getSystemState("/test"))
        (name,) = {
            node for _, nodes in publishers for node in nodes if node.startswith("/ros1_bridge_")
        }
        (_, _, uri) = cast("Any", master.lookupNode("/test", name))
        place.node.params["/late"] = 1
        eventually(lambda: other.node.params.get("/late", None) == 1)
        place.node.params["/late"] = 2
        eventually(lambda: other.node.params.get("/late", None) == 2)
        stack.enter_context(ServerProxy(uri)).paramUpdate("/master", "/late/", 1)
        other.node.params["/marker"] = True
        eventually(lambda: place.node.params.get("/marker", False))
        assert place.node.params["/late"] == other.node.params["/late"] == 2
