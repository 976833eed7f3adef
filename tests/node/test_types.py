"""Types by name, and types that only another node knows."""

from __future__ import annotations

from pathlib import Path
from queue import SimpleQueue
from typing import Any

import msgspec
import pytest
from network import TIMEOUT, Network, eventually

from rosz.errors import TypeNotFound, WaitTimeout
from rosz.msgs.example_interfaces.srv import AddTwoInts
from rosz.msgs.std_msgs.msg import String
from rosz.msgs.turtlesim.action import RotateAbsolute
from rosz.msgs.type_description_interfaces.msg import IndividualTypeDescription, TypeDescription
from rosz.msgs.type_description_interfaces.srv import GetTypeDescriptionResponse
from rosz.node import MessageInfo, Node
from rosz.node.ros2.types import request_action, request_definition, request_type
from rosz.wire import Token

PART = "float64 weight\ngeometry_msgs/Point[] corners\n"
GRIP = "uint8 SOFT=1\nPart part\nstring label\n"


@pytest.fixture
def packages(tmp_path: Path) -> Path:
    folder = tmp_path / "src" / "gripper_msgs"
    (folder / "msg").mkdir(parents=True)
    (folder / "srv").mkdir()
    (folder / "package.xml").write_text("<package><name>gripper_msgs</name></package>")
    (folder / "msg" / "Part.msg").write_text(PART)
    (folder / "msg" / "Grip.msg").write_text(GRIP)
    (folder / "srv" / "Close.srv").write_text("Part part\n---\nbool success\n")
    return tmp_path / "src"


@pytest.fixture
def knowing(network: Network, packages: Path) -> Node:
    """A node that knows a package which others do not."""
    return network.node("knowing", context=network.context(package_roots=(packages,)))


def publisher_token(node: Node, topic: str) -> Token:
    view = node.context.graph.wait_for_topic(topic, TIMEOUT)
    return view.publishers(topic)[0]


@pytest.mark.parametrize("name", ["std_msgs/String", "std_msgs/msg/String"])
def test_publisher_and_subscription_by_name(network: Network, name: str) -> None:
    node = network.node()
    subscription = node.subscription("chatter", name)
    publisher = node.publisher("chatter", name)
    assert publisher.message_type is String
    assert subscription.message_type is String
    publisher.publish("hello")
    assert subscription.get(TIMEOUT).data == "hello"


def test_compiled_type_by_name(knowing: Node) -> None:
    received: SimpleQueue[Any] = SimpleQueue()
    knowing.subscription("grips", "gripper_msgs/Grip", received.put)
    knowing.publisher("grips", "gripper_msgs/Grip").publish(label="soft")
    assert received.get(timeout=TIMEOUT).label == "soft"


def test_unknown_name(network: Network) -> None:
    node = network.node()
    for make in (node.publisher, node.subscription):
        with pytest.raises(TypeNotFound, match="there is no package 'gripper_msgs'"):
            make("grips", "gripper_msgs/Grip")


@pytest.mark.parametrize("message_type", [String, None])
def test_info_tells_the_type_and_its_hash(
    network: Network, message_type: type[String] | None
) -> None:
    node = network.node()
    infos: SimpleQueue[MessageInfo] = SimpleQueue()
    node.subscription("chatter", message_type, lambda _, info: infos.put(info), with_info=True)
    node.publisher("chatter", String).publish("x")
    info = infos.get(timeout=TIMEOUT)
    assert (info.type_name, info.type_hash) == ("std_msgs/msg/String", String._type_hash)


def test_definition_from_another_node(network: Network, knowing: Node) -> None:
    knowing.publisher("grips", "gripper_msgs/Grip")
    node = network.node("bag")
    definition = request_definition(node, publisher_token(node, "/grips"))
    assert definition.name == "gripper_msgs/msg/Grip"
    assert definition.text == GRIP
    assert definition.others["gripper_msgs/msg/Part"] == PART
    assert "geometry_msgs/msg/Point" in definition.others


def test_type_from_another_node(network: Network, knowing: Node) -> None:
    """A type that is not known here is compiled, and then good to subscribe with."""
    publisher = knowing.publisher("grips", "gripper_msgs/Grip", latch=True)
    publisher.publish(label="firm")
    node = network.node("bag")
    token = publisher_token(node, "/grips")
    made = request_type(node, token)
    assert made._type_hash == token.type_hash
    received = node.subscription("grips", made).get(TIMEOUT)
    assert (received.label, received.part.corners) == ("firm", [])
    parts = len(node._lifecycle._parts)
    request_type(node, token)
    eventually(lambda: len(node._lifecycle._parts) <= parts, "no client is left")


def test_subscription_by_a_name_that_the_publisher_knows(network: Network, knowing: Node) -> None:
    knowing.publisher("grips", "gripper_msgs/Grip", latch=True).publish(label="firm")
    node = network.node("other")
    publisher_token(node, "/grips")
    for name in ("gripper_msgs/Grip", "gripper_msgs/msg/Grip"):
        assert node.subscription("grips", name).get(TIMEOUT).label == "firm"
    with pytest.raises(TypeNotFound, match="there is no package 'gripper_msgs'"):
        node.subscription("grips", "gripper_msgs/Part")


def test_service_type_from_another_node(network: Network, knowing: Node) -> None:
    knowing.service("close", knowing.context.types.service("gripper_msgs/Close"), lambda _: [True])
    node = network.node("bridge")
    view = node.context.graph.wait_for_service("/close", TIMEOUT)
    made = request_type(node, view.servers("/close")[0])
    assert node.client("close", made)().success is True


def test_known_type_is_not_requested(network: Network) -> None:
    node = network.node()
    node.publisher("chatter", String)
    node.service("add", AddTwoInts, lambda _: [0])
    token = publisher_token(node, "/chatter")
    assert request_type(node, msgspec.structs.replace(token, node="gone"), 0) is String
    server = node.context.graph.wait_for_service("/add", TIMEOUT).servers("/add")[0]
    assert request_type(node, msgspec.structs.replace(server, node="gone"), 0) is AddTwoInts


def test_type_that_the_other_node_does_not_know(network: Network) -> None:
    network.node("talker").publisher("chatter", String)
    node = network.node("bag")
    token = publisher_token(node, "/chatter")
    with pytest.raises(TypeNotFound, match=r"node '/talker': .*there is no package 'odd'"):
        request_type(node, msgspec.structs.replace(token, type_name="odd/msg/Thing"))
    other = msgspec.structs.replace(token, type_hash=f"RIHS01_{'0' * 64}")
    with pytest.raises(TypeNotFound, match="the version of 'std_msgs/msg/String' here has the"):
        request_type(node, other)


def test_node_without_the_service(network: Network) -> None:
    node = network.node()
    node.publisher("chatter", String)
    token = publisher_token(node, "/chatter")
    with pytest.raises(WaitTimeout, match="/gone/get_type_description"):
        request_definition(node, msgspec.structs.replace(token, node="gone"), 0.05)


@pytest.mark.parametrize("foreign", [False, True])
def test_an_action_beside_services_of_another(
    network: Network, monkeypatch: pytest.MonkeyPatch, foreign: bool
) -> None:
    """The other action has the same name, or types whose names are not those of ROS 2."""
    network.node("turtle").action_server("/turn", RotateAbsolute, lambda _: None)
    node, service = network.node(), "/turn/_action/send_goal"
    name = "actionlib_tutorials/action/Fibonacci"
    tokens = node.context.graph.wait_for_service(service, TIMEOUT).servers(service)
    if foreign:
        thing = TypeDescription(IndividualTypeDescription("Thing", []), [])
        response = GetTypeDescriptionResponse(successful=True, type_description=thing)
        name = "unknown_msgs/action/Turn"
        monkeypatch.setattr("rosz.node.ros2.types._request", lambda *_, **__: response)
    with pytest.raises(TypeNotFound, match="another hash than the server uses"):
        request_action(node, name, tokens)
