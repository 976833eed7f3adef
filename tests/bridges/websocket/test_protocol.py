"""The operations of the protocol, by hand."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import math
import time
from array import array
from collections.abc import Iterator
from queue import SimpleQueue
from typing import Any

import cbor2
import pytest
from network import TIMEOUT, Network, eventually
from PIL import Image as Picture
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from rosz.access import AccessPolicy, PasswordGuesses, ServerAccess
from rosz.actions import ActionClient, GoalState
from rosz.bridges.rosbridge import RosbridgeLimits
from rosz.errors import ActionError
from rosz.msgs.example_interfaces.action import Fibonacci
from rosz.msgs.geometry_msgs.msg import PoseStamped
from rosz.msgs.rcl_interfaces.msg import Log
from rosz.msgs.sensor_msgs.msg import CameraInfo, Image, LaserScan
from rosz.msgs.std_msgs.msg import Float64, Header, Int32, String
from rosz.msgs.std_srvs.srv import SetBool
from rosz.security import read_rules

from .bridge import Bridge, Client, bridge_on

pytestmark = pytest.mark.system


@pytest.fixture
def bridge(network: Network) -> Iterator[Bridge]:
    with bridge_on(network) as made:
        yield made


@pytest.fixture
def client(bridge: Bridge) -> Iterator[Client]:
    with bridge.client() as made:
        yield made


def test_fields_have_the_names_of_the_clients_ros(bridge: Bridge, client: Client) -> None:
    node = bridge.network.node("other")
    info = CameraInfo(Header(), 4, 5)
    info.header.stamp.sec, info.d = 7, array("d", [0.5])
    node.publisher("info", CameraInfo, latch=True).publish(info)
    client.send("subscribe", topic="/info", type="sensor_msgs/CameraInfo")
    old = client.receive()["msg"]
    assert (old["header"]["stamp"], old["D"]) == ({"secs": 7, "nsecs": 0}, [0.5])
    assert old["header"]["seq"] == 0
    client.send("unsubscribe", topic="/info")
    client.send("subscribe", topic="/info", type="sensor_msgs/msg/CameraInfo")
    new = client.receive()["msg"]
    assert (new["header"]["stamp"], new["d"]) == ({"sec": 7, "nanosec": 0}, [0.5])
    assert "seq" not in new["header"]


def test_numbers_and_octets(bridge: Bridge, client: Client) -> None:
    node = bridge.network.node("other")
    scan = LaserScan(Header(), ranges=array("f", [1.5, math.inf, math.nan]))
    node.publisher("scan", LaserScan, latch=True).publish(scan)
    image = Image(Header(), 1, 2, "mono8", 0, 2, b"\x01\xff")
    node.publisher("image", Image, latch=True).publish(image)
    client.send("subscribe", topic="/scan", type="sensor_msgs/LaserScan")
    assert client.receive()["msg"]["ranges"] == [1.5, None, None]
    client.send("subscribe", topic="/image", type="sensor_msgs/Image")
    assert client.receive()["msg"]["data"] == base64.b64encode(b"\x01\xff").decode()
    scans: SimpleQueue[LaserScan] = SimpleQueue()
    images: SimpleQueue[Image] = SimpleQueue()
    node.subscription("scan_back", LaserScan, scans.put)
    node.subscription("image_back", Image, images.put)
    for name in ("/scan_back", "/image_back"):
        bridge.wait_for_subscription(name)
    client.send("advertise", topic="/scan_back", type="sensor_msgs/LaserScan")
    client.send("publish", topic="/scan_back", msg={"ranges": [1, None], "angle_min": None})
    got = scans.get(timeout=TIMEOUT)
    assert got.ranges[0] == 1
    assert math.isnan(got.ranges[1])
    assert math.isnan(got.angle_min)
    client.send("advertise", topic="/image_back", type="sensor_msgs/Image")
    for data in ([1, 255], "Af8="):
        client.send("publish", topic="/image_back", msg={"data": data})
        assert bytes(images.get(timeout=TIMEOUT).data) == b"\x01\xff"


def test_encodings(bridge: Bridge, client: Client) -> None:
    scan = LaserScan(Header(), ranges=array("f", [1.5, 2.5]), intensities=array("f", range(3000)))
    bridge.network.node("other").publisher("scan", LaserScan, latch=True).publish(scan)
    subscribe = {"topic": "/scan", "type": "sensor_msgs/LaserScan"}
    client.send("subscribe", **subscribe, compression="cbor")
    got = cbor2.loads(client.receive())
    assert (got["op"], got["topic"]) == ("publish", "/scan")
    tagged = got["msg"]["ranges"]
    assert (tagged.tag, array("f", tagged.value).tolist()) == (85, [1.5, 2.5])
    for type_name, data in (
        ("sensor_msgs/LaserScan", scan.to_ros1()),
        ("sensor_msgs/msg/LaserScan", scan.to_cdr()),
    ):
        client.send("unsubscribe", topic="/scan")
        client.send("subscribe", topic="/scan", type=type_name, compression="cbor-raw")
        raw = cbor2.loads(client.receive())["msg"]
        assert raw["bytes"] == data
        assert abs(raw["secs"] - time.time()) < 600
    client.send("unsubscribe", topic="/scan")
    client.send("subscribe", **subscribe, compression="png")
    png = client.receive()
    assert png["op"] == "png"
    pixels = Picture.open(io.BytesIO(base64.b64decode(png["data"]))).tobytes()
    assert json.loads(pixels)["msg"]["ranges"] == [1.5, 2.5]
    client.send("unsubscribe", topic="/scan")
    client.send("subscribe", **subscribe, fragment_size=1000)
    parts = [client.receive()]
    parts += [client.receive() for _ in range(parts[0]["total"] - 1)]
    assert {part["op"] for part in parts} == {"fragment"}
    assert all(len(part["data"]) <= 1000 for part in parts)
    whole = json.loads("".join(part["data"] for part in parts))
    assert whole["msg"]["ranges"] == [1.5, 2.5]


def test_parts_of_an_operation(bridge: Bridge, client: Client) -> None:
    heard: SimpleQueue[String] = SimpleQueue()
    bridge.network.node("other").subscription("up", String, heard.put)
    bridge.wait_for_subscription("/up")
    text = json.dumps(
        {"op": "publish", "topic": "/up", "type": "std_msgs/String", "msg": {"data": "x" * 50}}
    )
    middle = len(text) // 2
    for number, data in ((1, text[middle:]), (0, text[:middle])):
        client.send("fragment", id="a", data=data, num=number, total=2)
    assert heard.get(timeout=TIMEOUT).data == "x" * 50
    client.send("fragment", id="b", data="{", num=2, total=2)
    assert "num 2 of 2" in client.receive_op("status")["msg"]


def test_a_late_client_gets_what_is_latched(bridge: Bridge, client: Client) -> None:
    for name in ("a", "b"):
        node = bridge.network.node(f"latching_{name}")
        node.publisher("name", String, latch=True).publish(name)
    subscribe = {"topic": "/name", "type": "std_msgs/String"}
    client.send("subscribe", **subscribe)
    assert {client.receive()["msg"]["data"] for _ in "ab"} == {"a", "b"}
    with bridge.client() as late:
        late.send("subscribe", **subscribe)
        assert {late.receive()["msg"]["data"] for _ in "ab"} == {"a", "b"}


def test_a_rate_keeps_the_newest(bridge: Bridge, client: Client) -> None:
    publisher = bridge.network.node("other").publisher("count", Int32, queue_size=100)
    client.send("subscribe", topic="/count", type="std_msgs/Int32", throttle_rate=1000)
    client.sync()
    publisher.wait_for_subscribers(1, TIMEOUT)
    began = time.monotonic()
    publisher.publish(0)
    received = [client.receive()["msg"]["data"]]
    for number in range(1, 50):
        publisher.publish(number)
    while received[-1] != 49:
        received.append(client.receive()["msg"]["data"])
    assert received[0] == 0
    assert time.monotonic() - began > len(received) - 1.5  # one in each second


def test_several_subscriptions_of_a_topic(bridge: Bridge, client: Client) -> None:
    """Each message comes once; what all subscriptions need holds."""
    node = bridge.network.node("other")
    publisher = node.publisher("count", Int32, latch=True)
    publisher.publish(0)
    subscribe = {"topic": "/count", "type": "std_msgs/Int32"}
    client.send("subscribe", **subscribe, id="a", throttle_rate=100_000, queue_length=2)
    assert client.receive()["msg"]["data"] == 0
    client.send("subscribe", **subscribe, id="b", compression="cbor")
    assert cbor2.loads(client.receive())["msg"]["data"] == 0  # the latched one, for the second
    publisher.publish(1)
    assert cbor2.loads(client.receive())["msg"]["data"] == 1
    client.send("unsubscribe", topic="/count", id="a")
    client.sync()
    publisher.publish(2)
    assert cbor2.loads(client.receive())["msg"]["data"] == 2
    client.send("unsubscribe", topic="/count", id="b")
    eventually(lambda: not publisher.subscribers(), "the end of the subscription")


def test_logs(bridge: Bridge, client: Client) -> None:
    """``/rosout`` has the type of the client's ROS, in both directions."""
    node = bridge.network.node("talker")
    heard: SimpleQueue[Log] = SimpleQueue()
    node.subscription("/rosout", Log, heard.put)

    def wait_for_listeners(count: int) -> None:
        found = node.context.graph.view
        eventually(lambda: len(found().subscriptions("/rosout")) == count, f"{count} listeners")

    for topic in ("/rosout", "/rosout_agg"):
        client.send("subscribe", topic=topic, type="rosgraph_msgs/Log")
        wait_for_listeners(2)
        node.log.warning("look out %s", topic)
        got = client.receive()
        while "look out" not in got["msg"]["msg"]:
            got = client.receive()
        assert (got["topic"], got["msg"]["level"], got["msg"]["name"]) == (topic, 4, "/talker")
        assert got["msg"]["header"]["stamp"]["secs"] > 0
        client.send("unsubscribe", topic=topic)
        wait_for_listeners(1)
    client.send("call_service", service="/rosapi/topic_type", args={"topic": "/rosout"})
    assert client.receive_op("service_response")["values"]["type"] == "rosgraph_msgs/Log"
    bridge.wait_for_subscription("/rosout")
    client.send("advertise", topic="/rosout", type="rosgraph_msgs/Log")
    client.send("publish", topic="/rosout", msg={"level": 8, "msg": "from a page", "name": "/page"})
    log = heard.get(timeout=TIMEOUT)
    while log.name != "/page":
        log = heard.get(timeout=TIMEOUT)
    assert (log.level, log.msg) == (Log.ERROR, "from a page")
    client.send("subscribe", topic="/rosout", type="rcl_interfaces/msg/Log")
    wait_for_listeners(2)
    node.log.error("again")
    got = client.receive()
    while got["msg"]["msg"] != "again":
        got = client.receive()
    assert (got["msg"]["level"], "stamp" in got["msg"]) == (40, True)


def test_several_advertisements_of_a_topic(bridge: Bridge, client: Client) -> None:
    heard: SimpleQueue[String] = SimpleQueue()
    node = bridge.network.node("other")
    node.subscription("up", String, heard.put)
    bridge.wait_for_subscription("/up")
    for number in ("a", "b"):
        client.send("advertise", topic="/up", type="std_msgs/String", id=number)
    client.send("unadvertise", topic="/up", id="a")
    client.send("publish", topic="/up", msg={"data": "still there"})
    assert heard.get(timeout=TIMEOUT).data == "still there"
    client.send("unadvertise", topic="/up", id="b")
    graph = node.context.graph
    eventually(lambda: not graph.refresh().publishers("/up"), "the end of the publisher")


def test_types(bridge: Bridge, client: Client) -> None:
    node = bridge.network.node("other")
    node.publisher("name", String, latch=True).publish("x")
    bridge.node.context.graph.wait_for_topic("/name", TIMEOUT)
    for op in ("subscribe", "advertise"):
        client.send(op, topic="/name", type="std_msgs/Int32", id=op)
        status = client.receive()
        assert status["id"] == op
        assert status["msg"] == (
            f"{op}: topic '/name' has the type std_msgs/String, not std_msgs/Int32"
        )
    client.send("subscribe", topic="/name")
    assert client.receive()["msg"] == {"data": "x"}
    client.send("advertise", topic="/other", type="no_such/Type")
    assert "no_such" in client.receive()["msg"]
    client.send("publish", topic="/nowhere", msg={})
    assert "topic '/nowhere' does not exist" in client.receive()["msg"]
    client.send("publish", topic="/name", msg={"dada": 1})
    assert "it has no field 'dada'; did you mean 'data'?" in client.receive()["msg"]


def test_levels(client: Client) -> None:
    client.send("unadvertise", topic="/x")
    client.send("set_level", level="info")
    assert client.receive() == {"op": "status", "level": "info", "msg": "set_level: done"}
    client.send("unadvertise", topic="/x", id="7")
    warning = client.receive()
    assert (warning["level"], warning["id"]) == ("warning", "7")
    assert client.receive()["msg"] == "unadvertise: done"
    client.send("set_level", level="loud")
    assert "'loud'" in client.receive()["msg"]


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"op": 1}', '{"op": "publish"}', "{" * 10000, "\ud7ff", "[" * 200000]
)
def test_garbage_is_named(client: Client, text: str) -> None:
    client.connection.send(text)
    assert client.receive()["level"] == "error"
    client.sync()


def test_binary_garbage_is_named(client: Client) -> None:
    client.connection.send(b"\xff\x00")
    assert client.receive()["level"] == "error"


def test_services_of_clients(bridge: Bridge, client: Client) -> None:
    node = bridge.network.node("other")
    client.send("advertise_service", service="/served", type="std_srvs/SetBool")
    client.sync()
    flip = node.client("served", SetBool)
    flip.wait_for_service(TIMEOUT)
    answers: SimpleQueue[Any] = SimpleQueue()

    def call() -> None:
        try:
            answers.put(flip(data=True, timeout=TIMEOUT))
        except Exception as error:  # noqa: BLE001
            answers.put(error)

    bridge.network.thread(call)
    request = client.receive_op("call_service")
    assert request["args"] == {"data": True}
    response = {"service": "/served", "id": request["id"]}
    client.send("service_response", **response, values={"success": True}, result=True)
    assert answers.get(timeout=TIMEOUT).success
    bridge.network.thread(call)
    response["id"] = client.receive_op("call_service")["id"]
    client.send("service_response", **response, values="too late", result=False)
    assert "too late" in str(answers.get(timeout=TIMEOUT))
    bridge.network.thread(call)
    response["id"] = client.receive_op("call_service")["id"]
    client.send("service_response", **response, values={"message": "no"}, result=False)
    assert answers.get(timeout=TIMEOUT).message == "no"
    client.send("service_response", **response, result=True)
    assert "no call with the id" in client.receive_op("status")["msg"]
    bridge.network.thread(call)
    client.receive_op("call_service")
    client.connection.close()
    assert "has left" in str(answers.get(timeout=TIMEOUT))


def test_calls_of_services(bridge: Bridge, client: Client) -> None:
    client.send("call_service", service="/flip", args={"data": True}, id=4)
    failed = client.receive_op("service_response")
    assert (failed["id"], failed["result"]) == (4, False)
    assert failed["values"] == "service '/flip' does not exist"
    bridge.network.node("other").service("flip", SetBool, lambda one: (one.data, "ok"))
    bridge.wait_for_service("/flip")
    for args in ({"data": True}, [True]):
        client.send("call_service", service="/flip", args=args)
        got = client.receive_op("service_response")
        assert got["values"] == {"success": True, "message": "ok"}
    client.send("call_service", service="/flip", args={"date": True})
    assert "did you mean 'data'" in client.receive_op("service_response")["values"]


def test_actions_of_clients(bridge: Bridge, client: Client) -> None:
    client.send("advertise_action", action="/fib", type="example_interfaces/Fibonacci")
    client.sync()
    actions: ActionClient = bridge.network.node("other").action_client("fib", Fibonacci)
    actions.wait_for_server(TIMEOUT)
    handle = actions.send(Fibonacci.Goal(4), timeout=TIMEOUT)
    goal = client.receive_op("send_action_goal")
    assert goal["args"] == {"order": 4}
    about = {"action": "/fib", "id": goal["id"]}
    client.send("action_feedback", **about, values={"sequence": [0]})
    assert list(next(iter(handle)).sequence) == [0]
    client.send("action_result", **about, values={"sequence": [0, 1]}, status=4, result=True)
    assert list(handle.result(TIMEOUT).sequence) == [0, 1]
    second = actions.send(Fibonacci.Goal(5), timeout=TIMEOUT)
    about["id"] = client.receive_op("send_action_goal")["id"]
    assert second.cancel(TIMEOUT)
    assert client.receive_op("cancel_action_goal")["id"] == about["id"]
    client.send("action_result", **about, status=5, result=True)
    assert second.wait(TIMEOUT) is GoalState.CANCELED
    third = actions.send(Fibonacci.Goal(6), timeout=TIMEOUT)
    client.receive_op("send_action_goal")
    client.connection.close()
    try:
        assert third.wait(TIMEOUT) is GoalState.ABORTED
    except ActionError as error:  # the server was gone before it was asked for the result
        assert "the server" in str(error)  # noqa: PT017


def test_goals_of_clients(bridge: Bridge, client: Client) -> None:
    def execute(goal: Any) -> None:
        goal.wait_for_cancel(TIMEOUT)
        goal.canceled(Fibonacci.Result([9]))

    send = {"action": "/fib", "action_type": "example_interfaces/Fibonacci", "args": {"order": 2}}
    client.send("send_action_goal", **send, id="0")
    failed = client.receive_op("action_result")
    assert (failed["id"], failed["result"]) == ("0", False)
    bridge.network.node("server").action_server("fib", Fibonacci, execute)
    bridge.wait_for_service("/fib/_action/send_goal")
    client.send("send_action_goal", **send, id="1")
    client.send("cancel_action_goal", action="/fib", id="1")
    result = client.receive_op("action_result")
    assert (result["id"], result["status"]) == ("1", 5), result["values"]
    assert result["values"] == {"sequence": [9]}


def test_a_client_that_leaves(bridge: Bridge) -> None:
    node = bridge.network.node("other")
    publisher = node.publisher("count", Int32)
    with bridge.client() as client:
        client.send("subscribe", topic="/count", type="std_msgs/Int32")
        client.send("advertise", topic="/up", type="std_msgs/String")
        client.send("advertise_service", service="/served", type="std_srvs/SetBool")
        client.sync()
        publisher.wait_for_subscribers(1, TIMEOUT)
    eventually(lambda: not publisher.subscribers(), "the end of the subscription")
    graph = node.context.graph
    eventually(lambda: not graph.refresh().publishers("/up"), "the end of the publisher")
    eventually(lambda: not graph.refresh().servers("/served"), "the end of the service")
    eventually(lambda: bridge.server.clients == 0, "the end of the client")


def test_a_client_that_never_reads(network: Network) -> None:
    with bridge_on(network, limits=RosbridgeLimits(waiting=1 << 20)) as bridge:
        publisher = network.node("other").publisher("image", Image, queue_size=1000)
        subscribe = {"topic": "/image", "type": "sensor_msgs/Image"}
        with bridge.client(max_queue=1) as lazy, bridge.client() as quick:
            for client in (lazy, quick):
                client.send("subscribe", **subscribe)
                client.sync()
            publisher.wait_for_subscribers(1, TIMEOUT)
            for number in range(100):
                publisher.publish(Image(Header(), number, 1, data=bytes(200_000)))
                assert quick.receive()["msg"]["height"] == number
            seen = [lazy.receive()["msg"]["height"]]
            while seen[-1] != 99:
                seen.append(lazy.receive()["msg"]["height"])
            assert seen == sorted(seen)
            assert len(seen) < 100


def test_too_much_at_once(network: Network) -> None:
    with bridge_on(network, limits=RosbridgeLimits(clients=2, operation=1000)) as bridge:
        with bridge.client() as client:
            client.send("publish", topic="/x", msg={"data": "x" * 2000})
            with pytest.raises(ConnectionClosed, match="1009"):
                client.receive()
        eventually(lambda: bridge.server.clients == 0, "the end of the client")
        with (
            bridge.client(),
            bridge.client(),
            pytest.raises(InvalidStatus, match="503") as third,
            bridge.client(),
        ):
            pass
        assert b"there are 2 clients, which is the limit" in third.value.response.body


@pytest.mark.parametrize(
    ("options", "path", "status"),
    [
        ({}, "?token=wrong", 401),
        ({"additional_headers": {"Authorization": "Bearer wrong"}}, "", 401),
        ({"origin": "http://evil.example"}, "", 403),
        ({"origin": "null"}, "", 403),
        ({}, "?token=secret", None),
        ({"origin": "http://evil.example"}, "?token=secret", None),
        ({"additional_headers": {"Authorization": "Bearer secret"}}, "", None),
        ({"additional_headers": {"Authorization": "Basic dTpzZWNyZXQ="}}, "", None),
    ],
)
def test_passwords(network: Network, options: Any, path: str, status: int | None) -> None:
    with bridge_on(network, access=ServerAccess(policy=AccessPolicy(password="secret"))) as bridge:
        if status is None:
            with bridge.client(path, **options) as client:
                client.sync()
            return
        with pytest.raises(InvalidStatus) as refused, bridge.client(path, **options):
            pass
        assert refused.value.response.status_code == status


def test_guessing_becomes_slow(network: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each wrong password of an address makes the next pause longer, however it is sent."""
    monkeypatch.setattr(PasswordGuesses.__init__, "__defaults__", (lambda: 100.0,))  # no pause ends
    with bridge_on(network, access=ServerAccess(policy=AccessPolicy(password="secret"))) as bridge:
        for status in (401, 401, 401, 401):
            with pytest.raises(InvalidStatus, match=str(status)), bridge.client("?token=wrong"):
                pass
        proof = {"mac": "0" * 128, "t": int(time.time()), "end": int(time.time()) + 600}
        with bridge.client() as client:
            client.send("auth", **proof)
            with pytest.raises(ConnectionClosed, match="password is missing or wrong"):
                client.receive()
        with bridge.client() as client:
            client.send("auth", **proof)
            with pytest.raises(ConnectionClosed, match="wrong too often; try again in 1 s"):
                client.receive()
        with pytest.raises(InvalidStatus, match="429"), bridge.client("?token=secret"):
            pass


@pytest.mark.parametrize(
    ("headers", "path"),
    [
        ({"Origin": "http://["}, ""),
        ([("Origin", "http://a"), ("Origin", "http://b")], ""),
        ({}, "/["),
    ],
)
def test_malformed_requests(network: Network, headers: Any, path: str) -> None:
    with bridge_on(network, access=ServerAccess(policy=AccessPolicy(password="secret"))) as bridge:
        url = f"ws://127.0.0.1:{bridge.server.port}"
        with pytest.raises(InvalidStatus, match="400"):
            connect(f"{url}/{path}", additional_headers=headers)


def test_pages_of_this_machine(bridge: Bridge) -> None:
    for origin in ("http://localhost:8000", "http://127.0.0.1", "https://a.localhost"):
        with bridge.client(origin=origin) as client:
            client.sync()
    with pytest.raises(InvalidStatus) as refused, bridge.client(origin="http://robot.example"):
        pass
    assert b"--origin 'http://robot.example'" in refused.value.response.body


def test_rosauth(network: Network) -> None:
    with bridge_on(network, access=ServerAccess(policy=AccessPolicy(password="secret"))) as bridge:
        with bridge.client() as client:
            now = int(time.time())  # the message is valid for five seconds
            fields: dict[str, Any] = {"client": "c", "dest": "d", "rand": "r"}
            fields |= {"t": now, "level": "l", "end": now + 600}
            text = "".join(map(str, ("secret", *fields.values())))
            mac = hashlib.sha512(text.encode()).hexdigest()
            client.send("auth", mac=mac, **fields)
            client.sync()
        for late in ({"mac": "0" * 128, **fields}, {"mac": mac, **fields, "t": now - 60}):
            with bridge.client() as client:
                client.send("auth", **late)
                with pytest.raises(ConnectionClosed, match="password is missing or wrong"):
                    client.receive()
        with bridge.client() as client:
            client.send("subscribe", topic="/x", type="std_msgs/String")
            with pytest.raises(ConnectionClosed, match="password is missing or wrong"):
                client.receive()


RULES = "websocket: {subscribe: [/odom], publish: [/cmd/**], call: [/go], set: [/gains/**]}"


@pytest.mark.parametrize(
    ("policy", "allowed", "refused"),
    [
        (
            AccessPolicy(read_only=True),
            [("subscribe", "/cmd/a"), ("get", "/x")],
            [("publish", "/cmd/a"), ("call", "/go"), ("serve", "/x"), ("set", "/gains/a")],
        ),
        (
            AccessPolicy(topics=("/cmd/*",), params=("/gains*",)),
            [("publish", "/cmd/a"), ("call", "/go"), ("set", "/gains/a")],
            [("subscribe", "/odom"), ("get", "/x")],
        ),
        (
            AccessPolicy(read_rules(RULES, "rules.yaml").permit_at_bridge("websocket")),
            [("subscribe", "/odom"), ("publish", "/cmd/a"), ("call", "/go"), ("set", "/gains/a")],
            [("publish", "/odom"), ("subscribe", "/x"), ("serve", "/go"), ("get", "/gains/a")],
        ),
        (
            AccessPolicy(read_rules("robot1: all", "rules.yaml").permit_at_bridge("websocket")),
            [],
            [("subscribe", "/odom"), ("publish", "/odom"), ("get", "/x")],
        ),
    ],
)
def test_policies(policy: AccessPolicy, allowed: list[Any], refused: list[Any]) -> None:
    assert [one for one in allowed if policy.objection(*one)] == []
    assert [one for one in refused if not policy.objection(*one)] == []


def test_a_read_only_bridge(network: Network) -> None:
    with (
        bridge_on(network, access=ServerAccess(policy=AccessPolicy(read_only=True))) as bridge,
        bridge.client() as client,
    ):
        network.node("other").publisher("name", String, latch=True).publish("x")
        client.send("subscribe", topic="/name", type="std_msgs/String")
        assert client.receive()["msg"] == {"data": "x"}
        for op, members in (
            ("advertise", {"topic": "/up", "type": "std_msgs/String"}),
            ("advertise_service", {"service": "/up", "type": "std_srvs/Empty"}),
            ("advertise_action", {"action": "/up", "type": "example_interfaces/Fibonacci"}),
        ):
            client.send(op, **members)
            assert "this bridge is read-only" in client.receive()["msg"]
        client.send("call_service", service="/rosapi/set_param", args={"name": "/x", "value": "1"})
        assert "read-only" in client.receive_op("service_response")["values"]
        client.send("call_service", service="/name/get_loggers")
        assert "read-only" in client.receive_op("service_response")["values"]


def test_rosapi(bridge: Bridge, client: Client) -> None:
    node = bridge.network.node("other")
    node.publisher("pose", PoseStamped)
    node.subscription("value", Float64, print)
    node.service("flip", SetBool, lambda one: (one.data, "ok"))
    bridge.wait_for_service("/flip")

    def call(name: str, /, **args: Any) -> Any:
        client.send("call_service", service=f"/rosapi/{name}", args=args)
        got = client.receive_op("service_response")
        assert got["result"], got["values"]
        return got["values"]

    topics = call("topics")
    assert dict(zip(topics["topics"], topics["types"], strict=True))["/pose"] == (
        "geometry_msgs/PoseStamped"
    )
    assert call("topics_for_type", type="std_msgs/Float64") == {"topics": ["/value"]}
    raw = call("topics_and_raw_types")
    texts = dict(zip(raw["topics"], raw["typedefs_full_text"], strict=True))
    assert "MSG: geometry_msgs/Pose" in texts["/pose"]
    assert call("topic_type", topic="/pose") == {"type": "geometry_msgs/PoseStamped"}
    assert call("topic_type", topic="/none") == {"type": ""}
    assert call("publishers", topic="/pose") == {"publishers": ["/other"]}
    assert call("subscribers", topic="/value") == {"subscribers": ["/other"]}
    assert "/other" in call("nodes")["nodes"]
    details = call("node_details", node="/other")
    assert "/value" in details["subscribing"]
    assert "/pose" in details["publishing"]
    assert "/flip" in details["services"]
    assert "/flip" in call("services")["services"]
    assert call("services_for_type", type="std_srvs/SetBool") == {"services": ["/flip"]}
    assert call("service_type", service="/flip") == {"type": "std_srvs/SetBool"}
    assert call("service_providers", service="/flip") == {"providers": ["/other"]}
    assert call("service_node", service="/flip") == {"node": "/other"}
    assert call("service_host", service="/flip")["host"]
    described = call("message_details", type="geometry_msgs/PoseStamped")["typedefs"]
    assert described[0]["fieldnames"] == ["header", "pose"]
    assert described[0]["fieldtypes"] == ["std_msgs/Header", "geometry_msgs/Pose"]
    assert "geometry_msgs/Point" in [one["type"] for one in described]
    request = call("service_request_details", type="std_srvs/SetBool")["typedefs"]
    assert request[0]["fieldnames"] == ["data"]
    response = call("service_response_details", type="std_srvs/SetBool")["typedefs"]
    assert response[0]["fieldnames"] == ["success", "message"]
    call("set_param", name="/gains/p", value="1.5")
    assert call("get_param", name="/gains/p") == {"value": "1.5"}
    assert call("get_param", name="/other:gains.p") == {"value": "null"}
    for default in ("default", "default_value"):
        assert call("get_param", name="/none", **{default: "3"}) == {"value": "3"}
    assert call("has_param", name="/gains") == {"exists": True}
    assert call("search_param", name="gains") == {"global_name": "/gains"}
    assert "/gains/p" in call("get_param_names")["names"]
    call("delete_param", name="/gains")
    assert call("has_param", name="/gains") == {"exists": False}
    assert call("get_ros_version")["version"] == 1
    assert call("action_servers") == {"action_servers": ["/tf2_web_republisher"]}


def test_rosapi_says_nothing_of_names_that_are_not_shown(network: Network) -> None:
    node = network.node("other")
    node.publisher("pose", PoseStamped)
    node.subscription("pose", PoseStamped, print)
    node.service("flip", SetBool, lambda request: (request.data, "ok"))
    policy = AccessPolicy(topics=("/none",), services=("/rosapi/*",))
    with (
        bridge_on(network, access=ServerAccess(policy=policy)) as bridge,
        bridge.client() as client,
    ):
        bridge.wait_for_service("/flip")
        for service, args, answer in (
            ("publishers", {"topic": "/pose"}, {"publishers": []}),
            ("subscribers", {"topic": "/pose"}, {"subscribers": []}),
            ("service_type", {"service": "/flip"}, {"type": ""}),
            ("service_providers", {"service": "/flip"}, {"providers": []}),
            ("service_node", {"service": "/flip"}, {"node": ""}),
            ("service_host", {"service": "/flip"}, {"host": ""}),
        ):
            client.send("call_service", service=f"/rosapi/{service}", args=args)
            assert client.receive_op("service_response")["values"] == answer


def test_a_bridge_that_ends(network: Network) -> None:
    with bridge_on(network) as bridge:
        connection = connect(f"ws://127.0.0.1:{bridge.server.port}")
    with connection, pytest.raises(ConnectionClosed, match="1001"):
        connection.recv(timeout=TIMEOUT)
