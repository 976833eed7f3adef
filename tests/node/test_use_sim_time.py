"""Nodes live in simulated time where /use_sim_time says so: /clock is their only clock."""

from __future__ import annotations

import time
from queue import SimpleQueue

import pytest
from network import TIMEOUT, Network, eventually

from rosz.errors import TimeMovedBackwards
from rosz.introspect import ParameterTree
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.rosgraph_msgs.msg import Clock
from rosz.node import Node, Publisher
from rosz.node.clock import TimeJump
from rosz.params import split

SECOND = 1_000_000_000


class Simulator:
    """Who publishes /clock."""

    def __init__(self, node: Node) -> None:
        node.params["/use_sim_time"] = True
        self._clock: Publisher[Clock] = node.publisher("/clock", Clock)

    def tick(self, seconds: float) -> None:
        self._clock.publish(Clock(clock=Time(*divmod(round(seconds * SECOND), SECOND))))

    def set(self, node: Node, seconds: float) -> None:
        """Have it that time for a node, which may not be reached at once."""

        def there() -> bool:
            self.tick(seconds)
            return node.now() == seconds * SECOND

        eventually(there, f"it is {seconds:g} s")


@pytest.fixture
def simulator(network: Network) -> Simulator:
    return Simulator(network.node("simulator"))


@pytest.fixture
def node(network: Network, simulator: Simulator) -> Node:  # noqa: ARG001  # there before it
    return network.node("inside")


def test_time_is_that_of_the_clock(simulator: Simulator, node: Node) -> None:
    assert node.now() == 0
    simulator.set(node, 100.5)
    simulator.set(node, 100.75)


def test_who_started_before_stays_outside(network: Network) -> None:
    """The parameter is read at the start, as in ROS 1."""
    early = network.node("early")
    simulator = Simulator(network.node("simulator"))
    inside = network.node("inside")
    simulator.set(inside, 5)
    assert abs(early.now() - time.time_ns()) < 60 * SECOND


def test_sleep_timer_and_rate(network: Network, simulator: Simulator, node: Node) -> None:
    simulator.set(node, 1)
    ticks: SimpleQueue[int] = SimpleQueue()
    node.timer(10, lambda event: ticks.put(event.current_real))
    woke: SimpleQueue[tuple[str, int]] = SimpleQueue()

    def sleep() -> None:
        assert node.sleep(5)
        woke.put(("sleep", node.now()))

    def keep_pace() -> None:
        rate = node.rate(0.25)
        rate.sleep()
        woke.put(("rate", node.now()))

    for wait in (sleep, keep_pace):
        network.thread(wait)
    eventually(lambda: len(node.clock._source.sleepers) == 3, "all sleep")
    simulator.set(node, 4.5)
    assert woke.empty()
    simulator.set(node, 5)
    assert woke.get(timeout=TIMEOUT) == ("rate", 5 * SECOND)
    simulator.set(node, 6)
    assert woke.get(timeout=TIMEOUT) == ("sleep", 6 * SECOND)
    assert ticks.empty()
    simulator.set(node, 11)
    assert ticks.get(timeout=TIMEOUT) == 11 * SECOND


def test_jump_back(network: Network, simulator: Simulator, node: Node) -> None:
    simulator.set(node, 100)
    raised: SimpleQueue[str] = SimpleQueue()

    def sleep() -> None:
        try:
            node.sleep(50)
        except TimeMovedBackwards as error:
            raised.put(str(error))

    network.thread(sleep)
    eventually(lambda: len(node.clock._source.sleepers) == 1, "it sleeps")
    simulator.set(node, 3)
    assert raised.get(timeout=TIMEOUT)
    assert node.now() == 3 * SECOND


def test_nodes_of_one_process_do_not_set_time_back(network: Network, simulator: Simulator) -> None:
    context = network.context()
    nodes = [network.node(f"part{number}", context=context) for number in range(4)]
    jumps: list[TimeJump] = []
    for node in nodes:
        node.clock.on_jump(jumps.append)
    for number in range(3000):
        simulator.tick(100 + number / 1000)
    simulator.set(nodes[0], 200)
    nodes[0].close()
    simulator.set(nodes[1], 300)
    assert jumps == []


def test_end_without_a_tick(network: Network, node: Node) -> None:
    """Who waits for a clock that never comes can still be ended."""
    ended: SimpleQueue[bool] = SimpleQueue()
    network.thread(lambda: ended.put(node.sleep(1)))
    eventually(lambda: len(node.clock._source.sleepers) == 1, "it sleeps")
    node.close()
    assert ended.get(timeout=TIMEOUT) is False


def test_one_node_alone_while_it_runs(network: Network, simulator: Simulator) -> None:
    """Its timers and rates go on, in either time; other nodes of the process keep theirs."""
    simulator_node = network.node("other")
    del simulator_node.params["/use_sim_time"]
    context = network.context()
    node, neighbour = (network.node(name, context=context) for name in ("switched", "neighbour"))
    ticks: SimpleQueue[bool] = SimpleQueue()
    node.timer(0.01, lambda _: ticks.put(node.clock.simulated))
    turns: SimpleQueue[bool] = SimpleQueue()

    def turn() -> None:
        for _ in node.rate(100):
            turns.put(node.clock.simulated)

    network.thread(turn)
    session = network.session()

    def switch(value: object) -> None:
        tree = ParameterTree(session, network.domain, pytest.fail)
        tree.write([(split("/switched/use_sim_time"), value)])

    def both_reach(simulated: bool) -> None:
        for queue in (ticks, turns):
            while queue.get(timeout=TIMEOUT) is not simulated:
                pass

    both_reach(False)
    switch(True)
    assert node.clock.simulated
    assert not neighbour.clock.simulated
    for number in range(500):
        simulator.tick(100 + number / 10)
    simulator.set(node, 150)
    both_reach(True)
    switch(False)
    both_reach(False)
    assert abs(node.now() - time.time_ns()) < 60 * SECOND
    switch(True)
    assert node.now() == 0
    ParameterTree(session, network.domain, pytest.fail).delete("/switched/use_sim_time")
    both_reach(False)
    node.close()


def test_a_private_parameter_comes_before_the_global_one(
    network: Network, simulator: Simulator
) -> None:
    outside = network.node("outside", argv=["_use_sim_time:=false"])
    assert not outside.clock.simulated
    simulator.set(network.node("inside"), 5)
