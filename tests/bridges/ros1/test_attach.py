"""A bridge to a real master of ROS 1, which runs already."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, Program, eventually, free_port

from rosz.bridges.ros1 import AttachedBridge, CrossingNames
from rosz.errors import WaitTimeout
from rosz.msgs.std_msgs.msg import String
from rosz.msgs.std_srvs.srv import SetBool
from rosz.node import Node

from .world import LISTENER, SERVER, TALKER, World

pytestmark = [pytest.mark.ros1, pytest.mark.system]


class Robot(World):
    """A robot with a master, and a network that joins it."""

    def __init__(self) -> None:
        self.network = Network()
        self.port = free_port()
        self.master = self.start_master()

    def start_master(self) -> Program:
        """Start the master, or start it again."""
        self.master = self.start("rosmaster", "--core", "-p", str(self.port))
        eventually(lambda: not self.run("rosparam", "list").startswith("ERROR"))
        return self.master

    def join(self, **options: Any) -> AttachedBridge:
        """Return a bridge to the master."""
        uri = f"http://127.0.0.1:{self.port}"
        return AttachedBridge(uri, self.network.environment(), **options)

    def close(self) -> None:
        """End everything."""
        self.network.close()


@pytest.fixture(scope="module")
def robot() -> Iterator[Robot]:
    made = Robot()
    yield made
    made.close()


@pytest.fixture
def node(robot: Robot) -> Iterator[Node]:
    with Node("neighbour", context=robot.network.context()) as made:
        yield made


def _heard(node: Node, topic: str) -> SimpleQueue[Any]:
    found: SimpleQueue[Any] = SimpleQueue()
    node.subscription(topic, String, found.put)
    return found


def test_a_robot_joins_and_is_left_alone(robot: Robot, node: Node) -> None:
    robot.run("rosparam", "set", "/of_robot", "1")
    robot.run("rosparam", "set", "/both", "robot")
    node.params["/both"] = "rosz"
    node.params["/of_rosz"] = "x"
    talker = robot.rospy(TALKER, "talker", "/of_robot_topic")
    server = robot.rospy(SERVER)
    listener = robot.rospy(LISTENER, "listener", "/of_rosz_topic")
    publisher = node.publisher("/of_rosz_topic", String, latch=True)
    publisher.publish("from rosz")
    node.service("/of_rosz_service", SetBool, lambda _request: [True, "from rosz"])
    with robot.join():
        assert _heard(node, "/of_robot_topic").get(timeout=TIMEOUT).data.startswith("rospy ")
        listener.wait_for("heard from rosz")
        client = node.client("/of_rospy", SetBool, timeout=TIMEOUT)
        client.wait_for_service(TIMEOUT)
        assert client(True).message == "from rospy"
        eventually(lambda: "/of_rosz_service" in robot.run("rosservice", "list"))
        assert "from rosz" in robot.run("rosservice", "call", "/of_rosz_service", "true")

        eventually(lambda: node.params.get("/both") == "robot")
        eventually(lambda: node.params.get("/of_robot", None) == 1)
        eventually(lambda: robot.run("rosparam", "get", "/of_rosz").strip() == "x")
        robot.run("rosparam", "set", "/both", "later")
        eventually(lambda: node.params["/both"] == "later")
        node.params["/both"] = "last"
        eventually(lambda: robot.run("rosparam", "get", "/both").strip() == "last")
        robot.run("rosparam", "delete", "/both")
        eventually(lambda: "/both" not in node.params)

        # A second bridge waits, and nothing comes twice.
        with robot.join():
            publisher.publish("once")
            listener.wait_for("heard once")
            publisher.publish("end")
            listener.wait_for("heard end")
            assert sum(line == "heard once" for line in listener.lines) == 1
    assert "ros1_bridge" not in robot.run("rosnode", "list")
    eventually(lambda: "/talker" not in node.context.graph.view().nodes())
    for program in (talker, server, listener):
        program.send(signal.SIGINT)
        program.exit_code()


def test_names_are_chosen_and_moved(robot: Robot, node: Node) -> None:
    talkers = [robot.rospy(TALKER, f"talker_{name}", f"/{name}") for name in ("scan", "image")]
    robot.run("rosparam", "set", "/speed", "1")
    robot.run("rosparam", "set", "/secret", "1")
    names = CrossingNames(topics=("/sc*",), services=("*/get_loggers",), params=("/sp*",))
    with robot.join(names=names, namespace="/robot1"):
        assert _heard(node, "/robot1/scan").get(timeout=TIMEOUT).data.startswith("rospy ")
        view = node.context.graph.view
        eventually(lambda: "/robot1/talker_scan" in view().nodes())  # may come after its message
        eventually(lambda: view().servers("/robot1/talker_scan/get_loggers"))
        eventually(lambda: node.params.get("/robot1/speed", None) == 1)
        node.params["/robot1/speed"] = 2
        eventually(lambda: robot.run("rosparam", "get", "/speed").strip() == "2")
        assert "/robot1/image" not in view().topics()
        assert "/robot1/talker_scan/set_logger_level" not in view().services()
        assert not node.params.has("/robot1/secret")
    robot.run("rosparam", "delete", "/speed")
    for talker in talkers:
        talker.send(signal.SIGINT)
        talker.exit_code()


def test_a_killed_node_goes_from_the_network(robot: Robot, node: Node) -> None:
    """The master itself never forgets it."""
    view = node.context.graph.view
    with robot.join():
        for _ in range(2):
            server = robot.rospy(SERVER)
            server.wait_for("ready")
            eventually(lambda: view().servers("/of_rospy"))
            server.send(signal.SIGSTOP)
            with (
                node.client("/of_rospy", SetBool, timeout=0.2) as client,
                pytest.raises(WaitTimeout),
            ):
                client(True)
            server.send(signal.SIGCONT)
            with node.client("/of_rospy", SetBool, timeout=TIMEOUT) as client:
                assert client(True).message == "from rospy"
            server.kill()
            eventually(lambda: not view().servers("/of_rospy"))
            assert "/rospy_server" in robot.run("rosnode", "list").split()


def test_what_a_killed_bridge_served_is_served_again(robot: Robot, node: Node) -> None:
    """By another bridge that has waited, or by the next one; the master would keep the old."""
    node.service("/of_rosz_service", SetBool, lambda _request: [True, "from rosz"])
    node.publisher("/of_rosz_topic", String)

    def start() -> Program:
        uri = f"http://127.0.0.1:{robot.port}"
        program = robot.network.run("-m", "rosz", "bridge", "ros1", "--master", uri)
        program.wait_for("started the bridge")
        return program

    def served() -> bool:
        return "from rosz" in robot.run("rosservice", "call", "/of_rosz_service", "true")

    bridges = [start(), start()]
    eventually(served)
    for bridge in bridges:
        bridge.kill()
    assert not served()
    bridges = [start(), start()]
    eventually(served)
    bridges[0].kill()
    eventually(served)
    eventually(lambda: robot.run("rostopic", "info", "/of_rosz_topic").count("/ros1_bridge") == 1)
    bridges[1].send(signal.SIGINT)
    bridges[1].exit_code()


def test_the_bridge_is_back_after_the_master(robot: Robot, node: Node) -> None:
    publisher = node.publisher("/staying", String, latch=True)
    publisher.publish("back")
    with robot.join():
        eventually(lambda: "/staying" in robot.run("rostopic", "list"))
        robot.master.kill()
        robot.start_master()
        listener = robot.rospy(LISTENER, "listener", "/staying")
        listener.wait_for("heard back")
        listener.send(signal.SIGINT)
