"""zenoh-ros2-sdk, which is not ours, as the other side of topics and services, over a router.

It departs from the reference here and there: it counts from 0, draws its GIDs at random, sets an
encoding, and publishes with other congestion control. All of that has to be put up with.
"""

from __future__ import annotations

import importlib.util
import itertools
import json
import math
from array import array
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, Program, eventually, free_port

from rosz.errors import ServiceError, WaitTimeout
from rosz.message import Message
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.example_interfaces.srv import AddTwoInts
from rosz.msgs.geometry_msgs.msg import Point, Pose, PoseWithCovariance, Quaternion, Twist, Vector3
from rosz.msgs.nav_msgs.msg import Odometry
from rosz.msgs.rcl_interfaces.msg import ParameterEvent
from rosz.msgs.sensor_msgs.msg import Image, JointState
from rosz.msgs.std_msgs.msg import Header, String
from rosz.node import MessageInfo, Node, Publisher
from rosz.session import Session, SessionConfig

INTERFACES = Path(__file__).parents[2] / "interfaces"

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("zenoh_ros2_sdk") is None, reason="zenoh-ros2-sdk is not installed"
)

STAMP = Time(sec=1_700_000_000, nanosec=999_999_999)
MESSAGES: list[Message] = [
    String("hello, wörld €"),
    String(""),
    Twist(Vector3(0.5, -0.0, math.inf), Vector3(1e-300, 2.0, -3.0)),
    Image(Header(stamp=STAMP, frame_id="lens"), 2, 3, "rgb8", 0, 9, bytes(range(18))),
    Image(Header(), 0, 0, "", 1, 0, b""),
    Image(Header(), 480, 640, "mono8", 0, 640, bytes(480 * 640)),
    JointState(
        Header(stamp=STAMP), ["a", "bc", "def"], array("d", [1, 2, 3]), array("d"), array("d", [4])
    ),
    Odometry(
        Header(stamp=STAMP, frame_id="odom"),
        "base",
        PoseWithCovariance(
            Pose(Point(1, 2, 3), Quaternion(0, 0, 0, 1)), array("d", map(float, range(36)))
        ),
    ),
]


class Partner:
    """The SDK in its own process."""

    def __init__(self, program: Program) -> None:
        self._program = program

    def __call__(self, name: str, *arguments: object) -> dict[str, Any]:
        seen = len(self._program.lines)
        self._program.say(json.dumps([name, *arguments]))
        answer: dict[str, Any] = json.loads(self._program.wait_for("{", after=seen))
        return answer


@pytest.fixture
def city(network: Network) -> Iterator[Network]:
    """A network around a router, as ROS 2 has one."""
    network.rendezvous = f"tcp/127.0.0.1:{free_port()}"
    with Session.open(SessionConfig(mode="router", rendezvous=network.rendezvous)):
        yield network
        network.close()


@pytest.fixture
def sdk(city: Network) -> Partner:
    script = Path(__file__).with_name("sdk_partner.py")
    port = city.rendezvous.rpartition(":")[2]
    program = city.run(
        str(script), port, str(city.domain), str(INTERFACES), PYTHONWARNINGS="ignore"
    )
    partner = Partner(program)
    program.wait_for("ready")
    return partner


@pytest.fixture
def node(city: Network) -> Node:
    return city.node("rosz_side")


def wait_for_echo(sdk: Partner, there: Publisher[Any]) -> None:
    """Wait until the SDK hears us, and we it: it announces both before they work."""
    there.wait_for_subscribers(timeout=TIMEOUT)
    eventually(lambda: there._raw.matched, "a route to the SDK's subscriber")
    eventually(lambda: sdk("matched", "/back")["matched"], "a route to our subscription")


@pytest.mark.parametrize("kind", dict.fromkeys(type(message) for message in MESSAGES))
def test_topics_both_ways(sdk: Partner, node: Node, kind: type[Message]) -> None:
    """There, decoded, encoded, and back again: nothing has changed."""
    back = node.subscription("back", kind)
    there = node.publisher("there", kind)
    sdk("echo", "/there", "/back", kind._type_name)
    wait_for_echo(sdk, there)
    for message in MESSAGES:
        if type(message) is kind:
            there.publish(message)
            # A sequence that was never set is a list, a received one an array.
            assert back.get(TIMEOUT).to_cdr() == message.to_cdr()


def test_generic_and_info(sdk: Partner, node: Node) -> None:
    """A subscription of any type, and where the SDK's samples come from."""
    got: SimpleQueue[MessageInfo] = SimpleQueue()
    generic = node.subscription("back")
    node.subscription("back", String, lambda _, info: got.put(info), with_info=True)
    there = node.publisher("there", String)
    sdk("echo", "/there", "/back", "std_msgs/msg/String")
    wait_for_echo(sdk, there)
    for number in range(3):
        there.publish(str(number))
        assert generic.get(TIMEOUT).data == str(number)
    infos = [got.get(timeout=TIMEOUT) for _ in range(3)]
    assert [info.sequence for info in infos] == [0, 1, 2]
    assert [info.lost for info in infos] == [0, 0, 0]
    assert len({info.gid for info in infos}) == 1


def test_calling_its_service(sdk: Partner, node: Node) -> None:
    sdk("serve", "/add")
    client = node.client("add", AddTwoInts, timeout=TIMEOUT)
    client.wait_for_service(TIMEOUT)
    assert client(20, 22).sum == 42
    assert client(-0, 1).sum == 1
    with pytest.raises(ServiceError, match="Service callback error: nothing below zero"):
        client(-1, 0)


def test_serving_its_client(sdk: Partner, node: Node) -> None:
    def add(request: Any) -> int:
        if request.a < 0:
            raise ValueError("nothing below zero")
        return int(request.a + request.b)

    node.service("add", AddTwoInts, add)
    eventually(lambda: "/add" in sdk("see")["services"], "the service")
    assert sdk("call", "/add", 20, 22) == {"sum": 42}
    assert sdk("call", "/add", -1, 0) == {"sum": None}


def test_its_view_of_us(sdk: Partner, node: Node) -> None:
    node.publisher("scan", Image)
    node.subscription("cmd", Twist, print)
    node.service("add", AddTwoInts, lambda _: 0)
    expected = {
        "topics": {
            "/scan": ["sensor_msgs/msg/Image"],
            "/cmd": ["geometry_msgs/msg/Twist"],
            "/rosout": ["rcl_interfaces/msg/Log"],
        },
        "services": {"/add": ["example_interfaces/srv/AddTwoInts"]},
    }

    def is_whole() -> bool:
        seen = sdk("see")
        return all(of_us.items() <= seen[kind].items() for kind, of_us in expected.items())

    # Each look asks anew, and while the two link directly it may find only a part.
    eventually(is_whole, "all of us in its view")
    publisher = ["/", "rosz_side", "sensor_msgs/msg/Image"]
    eventually(lambda: sdk("inspect", "/scan")["publishers"] == [publisher], "our publisher")


def test_our_view_of_it(sdk: Partner, node: Node) -> None:
    sdk("echo", "there", "back", "std_msgs/msg/String")  # it does not resolve names
    sdk("serve", "/add")
    graph = node.context.graph
    graph.wait_for_service("/add", TIMEOUT)
    graph.wait_for_topic("/back", TIMEOUT)
    view = graph.view()
    assert {"/sdk_echo", "/sdk_server", "/rosz_side"} <= set(view.nodes())
    (publisher,) = view.publishers("/back")
    assert publisher.type_name == "std_msgs/msg/String"
    assert publisher.type_hash == String._type_hash
    assert [token.node_name for token in view.subscriptions("/there")] == ["/sdk_echo"]
    assert view.services()["/add"] == ["example_interfaces/srv/AddTwoInts"]


def test_parameters(sdk: Partner, node: Node) -> None:
    """The parameter services are there as soon as a node is that is not of rosz."""
    node.params["~gains"] = {"p": 0.5, "names": ["a"]}
    assert "/rosz_side/get_parameter_types" not in sdk("see")["services"]
    sdk("serve", "/add")
    eventually(
        lambda: "/rosz_side/set_parameters_atomically" in sdk("see")["services"], "the services"
    )
    names = ["gains.p", "gains.names", "use_sim_time", "none"]
    assert sdk("types", "/rosz_side", names) == {"types": [3, 9, 1, 0]}


def test_events_of_parameters(sdk: Partner, node: Node) -> None:
    """The SDK sees their publisher, receives and decodes the events, and sends them back."""
    node.params["~gains"] = {"p": 0.5, "names": ["a"]}
    back = node.subscription("back", ParameterEvent)
    sdk("echo", "/parameter_events", "/back", "rcl_interfaces/msg/ParameterEvent")
    node.context.graph.wait_for_topic("/back", TIMEOUT)
    publisher = ["/", "rosz_side", "rcl_interfaces/msg/ParameterEvent"]
    eventually(
        lambda: sdk("inspect", "/parameter_events")["publishers"] == [publisher], "our publisher"
    )
    eventually(lambda: sdk("matched", "/back")["matched"], "a route to our subscription")
    numbers = itertools.count()

    def comes() -> bool:
        node.params["~number"] = next(numbers)
        with suppress(WaitTimeout):
            return bool(back.get(1.0))
        return False

    eventually(comes, "an event, when there is a route to the SDK's subscriber")
    node.params["~number"] = -1
    while [row.value.integer_value for row in back.get(TIMEOUT).changed_parameters] != [-1]:
        pass
    for number in range(3):
        node.params["~gains"] = {"p": 0.5, "n": number}
        event = back.get(TIMEOUT)
        assert event.node == "/rosz_side"
        changed = event.changed_parameters if number else event.new_parameters
        assert [(row.name, row.value.integer_value) for row in changed] == [("gains.n", number)]
        gone = [] if number else ["gains.names"]
        assert [row.name for row in event.deleted_parameters] == gone
