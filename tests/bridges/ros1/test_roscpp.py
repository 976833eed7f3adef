"""A roscpp program and nodes of rosz as neighbours, with rosz as the master."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, eventually

from rosz.errors import ServiceError
from rosz.msgs.std_msgs.msg import String
from rosz.msgs.std_srvs.srv import SetBool
from rosz.node import Node

from .world import World, roscpp

pytestmark = [pytest.mark.ros1, pytest.mark.system]


@pytest.fixture(scope="module")
def world() -> Iterator[World]:
    roscpp()
    made = World()
    yield made
    made.close()


@pytest.fixture
def node(world: World) -> Iterator[Node]:
    with Node("neighbour", context=world.network.context()) as made:
        yield made
    eventually(lambda: not world.bridge.nodes())


def _heard(node: Node, topic: str) -> SimpleQueue[Any]:
    found: SimpleQueue[Any] = SimpleQueue()
    node.subscription(topic, String, found.put)
    return found


def test_a_talker_is_heard(world: World, node: Node) -> None:
    program = world.partner("talker")
    assert _heard(node, "/chatter").get(timeout=TIMEOUT).data.startswith("talker ")
    program.send(signal.SIGINT)
    assert program.exit_code() == 0


def test_a_latched_publisher_is_heard_late(world: World, node: Node) -> None:
    program = world.partner("latched")
    program.wait_for("ready")
    for _ in range(2):
        with Node("late", context=node.context) as late:
            assert _heard(late, "/chatter").get(timeout=TIMEOUT).data == "latched"
    program.send(signal.SIGINT)


def test_a_listener_hears(world: World, node: Node) -> None:
    program = world.partner("listener")
    publisher = node.publisher("/chatter", String, latch=True)
    publisher.publish("from rosz")
    program.wait_for("heard from rosz")
    publisher.publish("again")
    program.wait_for("heard again")
    program.send(signal.SIGINT)


def test_a_listener_misses_nothing_and_hears_nothing_twice(world: World, node: Node) -> None:
    program = world.partner("listener")
    eventually(lambda: node.context.graph.view().subscriptions("/chatter"))
    with Node("another", context=world.network.context()) as another:
        publishers = [one.publisher("/chatter", String, queue_size=99) for one in (node, another)]
        for publisher in publishers:
            publisher.wait_for_subscribers(timeout=TIMEOUT)
        for number in range(5):  # as many as wait until the listener is connected
            for name, publisher in zip("ab", publishers, strict=True):
                publisher.publish(f"{name} {number}")
        program.wait_for("heard a 4")
        program.wait_for("heard b 4")
        for publisher in publishers:
            publisher.publish("end")
        program.wait_for("heard end", times=2)
    heard = [line for line in program.lines if line.startswith("heard")]
    for name in "ab":
        assert [line for line in heard if f" {name} " in line] == [
            f"heard {name} {number}" for number in range(5)
        ]
    assert len(heard) == 12
    program.send(signal.SIGINT)


def test_there_and_back(world: World, node: Node) -> None:
    program = world.partner("echo")
    heard = _heard(node, "/echoed")
    publisher = node.publisher("/chatter", String)
    program.wait_for("ready")
    timer = node.timer(0.05, lambda _: publisher.publish("there"))
    assert heard.get(timeout=TIMEOUT).data == "there"
    timer.close()
    program.send(signal.SIGINT)


def test_a_service_is_called(world: World, node: Node) -> None:
    program = world.partner("server")
    client = node.client("/question", SetBool, timeout=TIMEOUT)
    client.wait_for_service(TIMEOUT)
    assert client(True).message == "from roscpp"
    with pytest.raises(ServiceError):
        client(False)
    program.send(signal.SIGINT)


@pytest.mark.parametrize("role", ["client", "persistent"])
def test_a_client_calls(world: World, node: Node, role: str) -> None:
    def handle(request: Any) -> Any:
        if not request.data:
            raise ServiceError("refused by rosz")
        return [True, "from rosz"]

    node.service("/question", SetBool, handle)
    program = world.partner(role)
    assert program.exit_code() == 0
    said = [line for line in program.lines if line.startswith(("answer", "refused"))]
    assert said[0] == said[2] == "answer from rosz"
    assert "refused by rosz" in program.output


def test_a_parameter_is_followed(world: World, node: Node) -> None:
    program = world.partner("parameter")
    eventually(world.bridge.nodes)
    for value in (1, 2, 3):
        node.params["/followed"] = value
        program.wait_for(f"parameter {value}")
    program.send(signal.SIGINT)
