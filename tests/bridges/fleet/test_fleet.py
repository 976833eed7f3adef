"""Two robots with equal names and a laptop: what crosses, in both directions."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack
from itertools import count

import pytest
from network import TIMEOUT, Network, eventually, free_port

from rosz.bridges.fleet import Fleet, FleetPlan, SharedNames
from rosz.errors import TransportError
from rosz.msgs.geometry_msgs.msg import TransformStamped
from rosz.msgs.std_msgs.msg import Header, String
from rosz.msgs.std_srvs.srv import Trigger
from rosz.msgs.tf2_msgs.msg import TFMessage
from rosz.node import Node
from rosz.params.replica import Replica
from rosz.session.router import Router
from rosz.wire import format_token, gid

PLANS = (
    FleetPlan(prefix="/robot1", frames=True),
    FleetPlan(
        prefix="/robot2",
        share=(SharedNames("/chatter"), SharedNames("/fast", 4.0), SharedNames("/tf*")),
        common=("/news",),
    ),
)


class Robots:
    """Robots and a laptop, which all have the same domain and nodes of the same names.

    Attributes:
        robots: A node of each robot.
        laptop: A node of the laptop.
        place: The endpoint of the laptop.
        networks: The networks of the robots.
        replicas: The parameters of the robots.
        routers: The routers of the robots.
    """

    def __init__(self, stack: ExitStack) -> None:
        self.place = f"tcp/127.0.0.1:{free_port()}"
        outside = self._network(stack)
        stack.enter_context(Router(outside.environment(), [self.place]))
        self.networks = [self._network(stack) for _ in PLANS]
        self.routers = [
            stack.enter_context(Router(network.environment())) for network in self.networks
        ]
        self.replicas = [
            stack.enter_context(Replica(router.session, 42)) for router in self.routers
        ]
        for number, plan in enumerate(PLANS):
            stack.enter_context(self.fleet(number, plan))
        self.robots = [network.node("base") for network in self.networks]
        self.laptop = outside.node("laptop")

    @staticmethod
    def _network(stack: ExitStack) -> Network:
        network = Network()
        stack.callback(network.close)
        return network

    def fleet(self, number: int, plan: FleetPlan) -> Fleet:
        """Return what crosses for a robot."""
        session, replica = self.routers[number].session, self.replicas[number]
        environment = self.networks[number].environment()
        return Fleet(environment, plan, session, replica, connect=[self.place])


@pytest.fixture(scope="module")
def fleet() -> Iterator[Robots]:
    """The robots of all tests here."""
    with ExitStack() as stack:
        yield Robots(stack)


def eventually_set(node: Node, name: str, value: object) -> None:
    eventually(lambda: node.params.has(name) and node.params.get(name) == value, name)


def test_topics_cross_both_ways(fleet: Robots) -> None:
    heard = [fleet.laptop.subscription(f"{plan.prefix}/chatter", String) for plan in PLANS]
    orders = [robot.subscription("/orders", String) for robot in fleet.robots]
    for number, robot in enumerate(fleet.robots):
        publisher = robot.publisher("/chatter", String)
        publisher.wait_for_subscribers(1)
        publisher.publish(String(data=f"from {number}"))
        order = fleet.laptop.publisher(f"{PLANS[number].prefix}/orders", String)
        order.wait_for_subscribers(1)
        order.publish(String(data=f"to {number}"))
    assert [one.get().data for one in heard] == ["from 0", "from 1"]
    assert [one.get().data for one in orders] == ["to 0", "to 1"]
    eventually(lambda: len(heard[0].publishers()) == 1, "its token")  # may come after it
    (seen,) = heard[0].publishers()
    assert (seen.node_name, seen.type_hash) == ("/robot1/base", String._type_hash)


def test_the_id_of_a_publisher_is_that_of_its_token(fleet: Robots) -> None:
    infos: list[bytes] = []
    fleet.laptop.subscription(
        "/robot1/ids", String, lambda _, info: infos.append(info.gid), with_info=True
    )
    publisher = fleet.robots[0].publisher("/ids", String)
    publisher.wait_for_subscribers(1)
    publisher.publish(String())
    eventually(lambda: bool(infos), "the message")
    view = fleet.laptop.context.graph.wait_for_topic("/robot1/ids", TIMEOUT)
    (seen,) = view.publishers("/robot1/ids")
    assert infos == [gid(format_token(seen))]


def test_late_subscriptions_get_latched_messages(fleet: Robots) -> None:
    latched = [robot.publisher("/news", String, latch=True) for robot in fleet.robots]
    for number, publisher in enumerate(latched):
        publisher.publish(String(data=f"news of {number}"))
    fleet.robots[1].publisher("/tf_after", String)  # crosses after all that was there before
    graph = fleet.laptop.context.graph
    graph.wait_for_topic("/robot2/tf_after", TIMEOUT)
    assert len(graph.wait_for_topic("/robot1/news", TIMEOUT).publishers("/robot1/news")) == 1
    assert not graph.refresh().publishers("/robot2/news")
    assert fleet.laptop.subscription("/robot1/news", String).get().data == "news of 0"


def test_services_cross_both_ways(fleet: Robots) -> None:
    robot, laptop = fleet.robots[0], fleet.laptop
    robot.service("/reset", Trigger, lambda _: Trigger.Response(success=True, message="robot"))
    laptop.service(
        "/robot1/plan", Trigger, lambda _: Trigger.Response(success=True, message="laptop")
    )
    for node, name, answer in ((laptop, "/robot1/reset", "robot"), (robot, "/plan", "laptop")):
        client = node.client(name, Trigger)
        client.wait_for_service(TIMEOUT)
        assert client.call(Trigger.Request(), timeout=TIMEOUT).message == answer


def test_only_what_is_shared_leaves(fleet: Robots) -> None:
    robot = fleet.robots[1]
    robot.publisher("/secret", String)
    robot.publisher("/fast", String)
    graph = fleet.laptop.context.graph
    graph.wait_for_topic("/robot2/fast", TIMEOUT)
    names = {name for name in graph.refresh().topics() if name.startswith("/robot2/")}
    assert "/robot2/secret" not in names
    assert "/robot2/rosout" not in names


def test_a_rate_is_kept_and_leaves_no_gap(fleet: Robots) -> None:
    arrived: list[tuple[str, float]] = []
    heard = fleet.laptop.subscription(
        "/robot2/fast",
        String,
        lambda message: arrived.append((message.data, time.monotonic())),
        queue_size=100,
    )
    robot = fleet.robots[1]
    publisher = robot.publisher("/fast", String, queue_size=100)
    publisher.wait_for_subscribers(1)
    ticks = count()
    began = time.monotonic()

    def publish() -> bool:
        publisher.publish(String(data=str(next(ticks))))
        robot.sleep(0.025)
        return len(arrived) >= 4

    eventually(publish, "four messages")
    assert arrived[0][0] == "0"
    for number, (_, when) in enumerate(arrived):
        assert when - began >= number / 4  # whatever delays a message, none comes too early
    assert heard.dropped == 0


def test_parameters_cross_both_ways(fleet: Robots) -> None:
    robot, laptop = fleet.robots[0], fleet.laptop
    robot.params.set("/gains", {"p": 1, "i": {"max": 2}})
    eventually_set(laptop, "/robot1/gains", {"p": 1, "i": {"max": 2}})
    laptop.params.set("/robot1/gains/p", 7)
    eventually_set(robot, "/gains/p", 7)
    laptop.params.delete("/robot1/gains/i")
    eventually(lambda: not robot.params.has("/gains/i/max"), "the deletion")
    assert not fleet.robots[1].params.has("/gains")


def test_frames_get_the_prefix(fleet: Robots) -> None:
    heard = fleet.laptop.subscription("/robot1/tf", TFMessage)
    publisher = fleet.robots[0].publisher("/tf", TFMessage)
    publisher.wait_for_subscribers(1)
    transform = TransformStamped(header=Header(frame_id="odom"), child_frame_id="base")
    publisher.publish(TFMessage(transforms=[transform]))
    (found,) = heard.get().transforms
    assert (found.header.frame_id, found.child_frame_id) == ("robot1/odom", "robot1/base")


def test_a_prefix_belongs_to_one_robot(fleet: Robots, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("socket.gethostname", lambda: "other")
    with pytest.raises(TransportError, match="'/robot1' is the name of another robot"):
        fleet.fleet(1, PLANS[0])
