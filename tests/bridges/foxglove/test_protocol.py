"""The messages of the protocol, by hand."""

from __future__ import annotations

import base64
import re
import struct
import threading
from collections.abc import Iterator
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from rosz.access import AccessPolicy, ServerAccess
from rosz.bridges.foxglove import FoxgloveLimits, Offer
from rosz.msgs.rosgraph_msgs.msg import Clock
from rosz.msgs.sensor_msgs.msg import Image
from rosz.msgs.std_msgs.msg import Header, String
from rosz.msgs.std_srvs.srv import SetBool
from rosz.node import simulate
from rosz.security import read_rules

from .bridge import SUBPROTOCOLS, Bridge, Client, bridge_on, package_in

pytestmark = pytest.mark.system


@pytest.fixture
def bridge(network: Network) -> Iterator[Bridge]:
    with bridge_on(network) as made:
        yield made


@pytest.fixture
def client(bridge: Bridge) -> Iterator[Client]:
    with bridge.client() as made:
        yield made


def test_nothing_is_subscribed_while_nobody_watches(bridge: Bridge) -> None:
    publisher = bridge.network.node("other").publisher("chatter", String, latch=True)
    publisher.publish("kept")
    with bridge.client() as first:
        first.channel("/chatter")
        first.sync()
        assert not publisher.subscribers()
        first.subscribe("/chatter", 7)
        assert first.wait_data()[::2] == (7, String("kept").to_cdr())
        with bridge.client() as second:
            second.subscribe("/chatter", 8)
            assert second.wait_data()[::2] == (8, String("kept").to_cdr())
        publisher.publish("for the first")
        assert first.wait_data()[::2] == (7, String("for the first").to_cdr())
        first.send("unsubscribe", subscriptionIds=[7])
        eventually(lambda: not publisher.subscribers(), "the end of the subscription")
        first.subscribe("/chatter", 7)
        first.wait_data()
    eventually(lambda: not publisher.subscribers(), "the end of the subscription")
    eventually(lambda: bridge.server.clients == 0, "the end of the client")


def test_channels_come_and_go(bridge: Bridge, client: Client) -> None:
    node = bridge.network.node("other")
    publisher = node.publisher("chatter", String)
    service = node.service("flip", SetBool, lambda _: (True, ""))
    channel, flip = client.channel("/chatter"), client.service("/flip")
    assert (channel["encoding"], channel["schemaEncoding"]) == ("cdr", "ros2msg")
    assert channel["schemaName"] == "std_msgs/msg/String"
    assert channel["schema"] == String._full_text
    assert flip["request"]["schemaName"] == "std_srvs/srv/SetBool_Request"
    assert flip["response"]["schema"] == SetBool.Response._full_text
    client.subscribe("/chatter")
    client.sync()
    publisher.close()
    service.close()
    assert client.wait_op("unadvertise")["channelIds"] == [channel["id"]]
    assert client.wait_op("unadvertiseServices")["serviceIds"] == [flip["id"]]
    client.send("unsubscribe", subscriptionIds=[1])
    assert client.wait_status() == "unsubscribe: unknown subscription 1"
    client.channels.clear()
    node.subscription("chatter", String, print)
    assert client.channel("/chatter")["id"] != channel["id"]


def test_hidden_topics(network: Network) -> None:
    node = network.node("other")
    node.publisher("inner/_own", String)
    node.publisher("outer", String)
    with bridge_on(network) as bridge, bridge.client() as client:
        client.channel("/outer")
        assert "/inner/_own" not in client.channels
    with bridge_on(network, offer=Offer(hidden=True)) as bridge, bridge.client() as client:
        client.channel("/inner/_own")


def test_types_that_other_nodes_describe(bridge: Bridge, client: Client) -> None:
    packages = package_in(bridge.network.folder)
    (packages / "arm" / "msg").mkdir()
    (packages / "arm" / "msg" / "Pair.msg").write_text("int32 a\nstd_msgs/Header header\n")
    context = bridge.network.context(package_roots=(packages,))
    node = bridge.network.node("other", context=context)
    cls = node.context.types.message("arm/Pair")
    publisher = node.publisher("pair", cls, latch=True)
    publisher.publish(cls(7))
    channel = client.channel("/pair")
    assert channel["schemaName"] == "arm/msg/Pair"
    assert "MSG: std_msgs/Header" in channel["schema"]
    client.subscribe("/pair")
    assert client.wait_data()[2] == cls(7).to_cdr()


@pytest.mark.parametrize(
    "members",
    [
        {"topic": "/" + "x" * 66_000, "schemaName": "std_msgs/String"},
        {
            "topic": "/own",
            "schemaName": f"mine/msg/N{'x' * 66_000}",
            "schema": "int32 number\n",
            "schemaEncoding": "ros2msg",
        },
    ],
)
def test_names_that_are_too_long(bridge: Bridge, client: Client, members: dict[str, str]) -> None:
    """Zenoh would panic, and with it end the bridge for all."""
    client.send("advertise", channels=[{"id": 1, "encoding": "cdr", **members}])
    assert "the limit is 1024" in client.wait_status()
    bridge.network.node("other").publisher("chatter", String, latch=True).publish(String("on"))
    client.subscribe("/chatter")
    assert client.wait_data()[2] == String("on").to_cdr()


def test_what_one_client_may_have(network: Network) -> None:
    node = network.node("other")
    for number in (1, 2, 3):
        node.publisher(f"x{number}", String)
    limits = FoxgloveLimits(subscriptions=2, advertisements=2)
    with bridge_on(network, limits=limits) as bridge, bridge.client() as client:
        for number in (1, 2, 3):
            client.subscribe(f"/x{number}", number)
        text = "subscribe: this client has 2 subscriptions, which is the limit"
        assert client.wait_status() == text
        client.send("unsubscribe", subscriptionIds=[1])
        client.subscribe("/x3", 3)
        mine = {"encoding": "json", "schemaName": "std_msgs/String"}
        channels = [{"id": number, "topic": f"/y{number}", **mine} for number in (1, 2, 3)]
        client.send("advertise", channels=channels)
        text = "advertise: this client has 2 advertisements, which is the limit"
        assert client.wait_status() == text
        client.sync()


def test_clients_publish(bridge: Bridge, client: Client) -> None:
    heard: SimpleQueue[Any] = SimpleQueue()
    node = bridge.network.node("other")
    node.subscription("up", String, heard.put)
    bridge.wait_for_subscription("/up")
    mine = {"id": 3, "topic": "/own", "encoding": "cdr", "schemaName": "mine/msg/Number"}
    given = {**mine, "schema": "int32 number\n", "schemaEncoding": "ros2msg"}
    client.send(
        "advertise",
        channels=[
            {"id": 1, "topic": "/up", "encoding": "cdr", "schemaName": "std_msgs/msg/String"},
            {"id": 2, "topic": "up", "encoding": "json", "schemaName": "std_msgs/String"},
            given,
        ],
    )
    client.send_binary("BI", 1, 1, data=String("cdr").to_cdr())
    assert heard.get(timeout=TIMEOUT).data == "cdr"
    client.send_binary("BI", 1, 2, data=b'{"data": "json"}')
    assert heard.get(timeout=TIMEOUT).data == "json"
    client.subscribe("/own")
    client.sync()
    client.send_binary("BI", 1, 3, data=b"\0\1\0\0\7\0\0\0")
    assert client.wait_data()[2] == b"\0\1\0\0\7\0\0\0"
    client.send("unadvertise", channelIds=[1])
    for number, data, reason in (
        (2, b'{"no": 1}', "no"),
        (2, b"{", "is not JSON"),
        (3, b"\0\1\0\0", "mine/Number"),
        (1, b"", "channel 1 is not advertised"),
    ):
        client.send_binary("BI", 1, number, data=data)
        assert reason in client.wait_status()
    for channel, reason in (
        ({**given, "id": 4, "encoding": "protobuf"}, "expected cdr or json"),
        ({**mine, "id": 5, "topic": "/x", "schemaName": "no/Type"}, "no/Type"),
        ({**mine, "id": 6, "topic": "/up"}, "has the type std_msgs/String"),
        (given, "channel 3 is advertised already"),
    ):
        client.send("advertise", channels=[channel])
        assert reason in client.wait_status()
    client.send("unadvertise", channelIds=[2])
    eventually(lambda: not node.context.graph.refresh().publishers("/up"), "the end")


def test_services(bridge: Bridge, client: Client) -> None:
    def flip(request: Any) -> Any:
        if not request.data:
            raise ValueError("never false")
        return True, "flipped"

    bridge.network.node("other").service("flip", SetBool, flip)
    service = client.service("/flip")["id"]

    def call(number: int, encoding: bytes, data: bytes, called: int = service) -> Any:
        client.send_binary("BIII", 2, called, number, len(encoding), data=encoding + data)
        return client.wait(
            lambda one: one[0] == 3 if isinstance(one, bytes) else one.get("callId") == number
        )

    response = call(1, b"cdr", SetBool.Request(data=True).to_cdr())
    assert struct.unpack_from("<III", response, 1) == (service, 1, 3)
    assert response[13:16] == b"cdr"
    assert SetBool.Response.from_cdr(response[16:]).message == "flipped"
    failure = call(2, b"cdr", SetBool.Request(data=False).to_cdr())
    assert (failure["op"], failure["serviceId"]) == ("serviceCallFailure", service)
    assert "never false" in failure["message"]
    assert "SetBool" in call(3, b"cdr", b"")["message"]
    assert "expected cdr" in call(4, b"json", b"{}")["message"]
    assert call(5, b"cdr", b"", service + 1)["message"] == f"there is no service {service + 1}"


def test_too_many_calls(network: Network) -> None:
    go_on = threading.Event()

    def wait(_request: Any) -> Any:
        go_on.wait(TIMEOUT)
        return True, "waited"

    network.node("other").service("wait", SetBool, wait)
    with bridge_on(network, limits=FoxgloveLimits(calls=2)) as bridge, bridge.client() as client:
        service = client.service("/wait")["id"]
        for number in range(3):
            data = b"cdr" + SetBool.Request(data=True).to_cdr()
            client.send_binary("BIII", 2, service, number, 3, data=data)
        failure = client.wait(lambda one: not isinstance(one, bytes) and "callId" in one)
        assert failure["callId"] == 2
        assert failure["message"] == "this client has 2 calls, which is the limit"
        go_on.set()
        for _ in range(2):
            client.wait(lambda one: isinstance(one, bytes) and one[0] == 3)
        client.sync()


def test_parameters(bridge: Bridge, client: Client) -> None:
    params = bridge.network.node("other").params
    values = {"rate": 2.0, "hz": [1.0, 2.5], "raw": b"abc", "on": True, "who": "x", "n": [1, 2]}
    params["/robot"] = values
    typed = {"rate": "float64", "hz": "float64_array", "raw": "byte_array"}
    shown: dict[str, Any] = {**values, "raw": base64.b64encode(b"abc").decode()}

    def values_of(message: Any) -> dict[str, Any]:
        return {one["name"]: one.get("value") for one in message["parameters"]}

    eventually(lambda: bridge.node.params.has("/robot/n"), "the parameters")
    client.send("getParameters", parameterNames=[], id="all")
    got = client.wait_op("parameterValues")
    assert got["id"] == "all"
    assert values_of(got) == {f"/robot/{name}": value for name, value in shown.items()}
    kinds = {one["name"]: one["type"] for one in got["parameters"] if "type" in one}
    assert kinds == {f"/robot/{name}": kind for name, kind in typed.items()}
    client.send("getParameters", parameterNames=["/robot/on", "/none"])
    assert values_of(client.wait_op("parameterValues")) == {"/robot/on": True}

    client.send("subscribeParameterUpdates", parameterNames=["/robot/rate"])
    client.send(
        "setParameters",
        id="set",
        parameters=[
            {"name": "/robot/rate", "value": 3, "type": "float64"},
            {"name": "/robot/raw", "value": "eHl6", "type": "byte_array"},
            {"name": "/robot/hz", "value": [1, 2], "type": "float64_array"},
            {"name": "/robot/on"},
        ],
    )
    answer = client.wait(lambda one: isinstance(one, dict) and one.get("id") == "set")
    assert values_of(answer)["/robot/rate"] == 3
    assert values_of(client.wait_op("parameterValues")) == {"/robot/rate": 3}
    eventually(lambda: not params.has("/robot/on"), "the deletion")
    assert (params["/robot/rate"], params["/robot/raw"]) == (3.0, b"xyz")
    assert isinstance(params["/robot/rate"], float)
    assert all(isinstance(one, float) for one in params["/robot/hz"])

    params.delete("/robot")
    assert values_of(client.wait_op("parameterValues")) == {"/robot/rate": None}
    client.send("subscribeParameterUpdates", parameterNames=[])
    client.sync()
    params["/new"] = {"a": 1, "b": {"c": 2}}
    assert values_of(client.wait_op("parameterValues")) == {"/new/a": 1, "/new/b/c": 2}
    client.send("unsubscribeParameterUpdates", parameterNames=[])
    client.sync()
    params["/new/a"] = 2
    client.sync()
    assert not [one for one in client.waiting if "parameters" in one]
    for one, reason in (
        ({"name": "/a", "value": "%", "type": "byte_array"}, "expected a byte_array"),
        ({"name": "/a", "value": "x", "type": "float64"}, "expected a float64"),
        ({"name": "/a", "value": 1, "type": "float64_array"}, "expected a float64_array"),
        ({"name": "/a", "value": 1, "type": "int"}, "expected byte_array"),
    ):
        client.send("setParameters", parameters=[one])
        assert reason in client.wait_status()


def test_the_connection_graph(bridge: Bridge, client: Client) -> None:
    node = bridge.network.node("other")
    publisher = node.publisher("chatter", String)
    service = node.service("flip", SetBool, lambda _: (True, ""))
    client.service("/flip")
    client.channel("/chatter")
    client.send("subscribeConnectionGraph")
    graph = client.wait_op("connectionGraphUpdate")
    assert {"name": "/chatter", "publisherIds": ["/other"]} in graph["publishedTopics"]
    assert {"name": "/flip", "providerIds": ["/other"]} in graph["advertisedServices"]
    subscription = node.subscription("chatter", String, print)
    change = client.wait_op("connectionGraphUpdate")
    assert change["subscribedTopics"] == [{"name": "/chatter", "subscriberIds": ["/other"]}]
    publisher.close()
    change = client.wait_op("connectionGraphUpdate")
    assert change["publishedTopics"] == [{"name": "/chatter", "publisherIds": []}]
    assert change["removedTopics"] == []
    subscription.close()
    assert client.wait_op("connectionGraphUpdate")["removedTopics"] == ["/chatter"]
    service.close()
    assert client.wait_op("connectionGraphUpdate")["removedServices"] == ["/flip"]
    client.send("unsubscribeConnectionGraph")
    client.sync()
    node.publisher("more", String)
    client.channel("/more")
    client.sync()
    assert not [one for one in client.waiting if "publishedTopics" in one]


def test_simulated_time(network: Network) -> None:
    other = network.node("other")
    clock = other.publisher("/clock", Clock, latch=True)
    chatter = other.publisher("chatter", String)
    with bridge_on(network) as bridge:
        simulate(bridge.node)
        with bridge.client() as client:
            assert "time" in client.wait_op("serverInfo")["capabilities"]
            for second in (5, 6):
                tick = Clock()
                tick.clock.sec = second
                clock.publish(tick)
                frame = client.wait(lambda one: isinstance(one, bytes) and one[0] == 2)
                assert struct.unpack_from("<Q", frame, 1) == (second * 10**9,)
            client.subscribe("/chatter")
            chatter.wait_for_subscribers(1, TIMEOUT)
            eventually(lambda: bridge.node.now() == 6 * 10**9, "the time")
            chatter.publish("x")
            assert client.wait_data()[1] == 6 * 10**9
    with bridge_on(network) as bridge, bridge.client() as client:
        assert "time" not in client.wait_op("serverInfo")["capabilities"]


def test_assets(network: Network) -> None:
    """Links are followed that the package has itself, as an installation with links has them."""
    packages = package_in(network.folder)
    (packages / "arm" / "linked.stl").symlink_to(packages / "other.stl")
    (packages / "arm" / "folder").symlink_to(packages)
    with bridge_on(network, packages) as bridge, bridge.client() as client:

        def fetch(uri: str) -> bytes | str:
            client.send("fetchAsset", uri=uri, requestId=9)
            frame: bytes = client.wait(lambda one: isinstance(one, bytes) and one[0] == 4)
            number, status, length = struct.unpack_from("<IBI", frame, 1)
            assert number == 9
            return frame[10 + length :] if status == 0 else frame[10 : 10 + length].decode()

        assert fetch("package://arm/meshes/base%20link.stl") == b"solid"
        assert fetch("package://arm/linked.stl") == b"secret"
        for uri, reason in (
            ("package://arm/secret.txt", "the patterns of this bridge leave it out"),
            ("file:///etc/passwd", "leave it out"),
            ("package://arm/../other.stl", "leave it out"),
            ("package://arm/%2e%2e/other.stl", "leads out of package 'arm'"),
            ("package://arm/meshes/%2e%2e/%2e%2e/other.stl", "leads out of package 'arm'"),
            ("package://%2e%2e/other.stl", "'..'"),
            ("package://arm/folder/%2e%2e/%2e%2e/other.stl", "leads out of package 'arm'"),
            ("package://arm/none.stl", "has no file 'none.stl'"),
            ("package://arm/meshes%00.stl", "has no file"),
            (f"package://arm/{'x' * 1000}.stl", "cannot read"),
            ("package://none/x.stl", "none"),
        ):
            assert reason in str(fetch(uri)), uri


def test_messages_that_are_none(bridge: Bridge, client: Client) -> None:
    for message in (
        "",
        "{",
        '{"op": "fly"}',
        '{"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 1}]}',
        '{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 1e300}]}',
        "[" * 10_000,
        b"",
        b"\x01",
        b"\x02\0\0\0\0\0\0\0\0\xff\xff\xff\xffcdr",
        b"\x02\0\0\0\0\0\0\0\0\x02\0\0\0\xff\xff",
        b"\xff" * 100,
    ):
        client.connection.send(message)
        assert client.wait_status().startswith("message: ")
    for op, members, reason in (
        ("subscribe", {"subscriptions": [{"id": 1, "channelId": 999}]}, "no channel 999"),
        ("unsubscribe", {"subscriptionIds": [5]}, "unknown subscription 5"),
        ("unadvertise", {"channelIds": [5]}, "channel 5 is not advertised"),
    ):
        client.send(op, **members)
        assert reason in client.wait_status()
    bridge.network.node("other").publisher("chatter", String)
    client.subscribe("/chatter", 1)
    client.subscribe("/chatter", 1)
    assert "subscription 1 exists already" in client.wait_status()
    client.subscribe("/chatter", 2)
    assert "is subscribed already" in client.wait_status()


def test_a_client_that_never_reads(network: Network) -> None:
    with bridge_on(network, limits=FoxgloveLimits(waiting=1 << 20)) as bridge:
        publisher = network.node("other").publisher("image", Image, queue_size=1000)
        with bridge.client(max_queue=1) as lazy, bridge.client() as quick:
            for client in (lazy, quick):
                client.subscribe("/image")
                client.sync()
            publisher.wait_for_subscribers(1, TIMEOUT)
            for number in range(100):
                publisher.publish(Image(Header(), number, 1, data=bytes(200_000)))
                assert Image.from_cdr(quick.wait_data()[2]).height == number
            seen = [Image.from_cdr(lazy.wait_data()[2]).height]
            while seen[-1] != 99:
                seen.append(Image.from_cdr(lazy.wait_data()[2]).height)
            assert seen == sorted(seen)
            assert len(seen) < 100


def test_a_client_that_never_reads_answers(network: Network) -> None:
    limits = FoxgloveLimits(waiting=1 << 20)
    with bridge_on(network, limits=limits) as bridge, bridge.client(max_queue=1) as client:
        network.node("other").params["/text"] = "x" * 1_000_000
        eventually(lambda: bridge.node.params.has("/text"), "the parameter")
        for _ in range(100):  # more than what sockets hold
            client.send("getParameters", parameterNames=["/text"])
        client.send("setParameters", parameters=[{"name": "/asked", "value": True}])
        eventually(lambda: bridge.node.params.has("/asked"), "the answers")
        with pytest.raises(ConnectionClosed, match="answers wait that the client does not read"):
            client.wait(lambda _: False)


def test_too_much_at_once(network: Network) -> None:
    with bridge_on(network, limits=FoxgloveLimits(clients=2, message=1000)) as bridge:
        with bridge.client() as client:
            client.send("getParameters", parameterNames=["x" * 2000])
            with pytest.raises(ConnectionClosed, match="1009"):
                client.wait_status()
        with bridge.client() as client:
            client.sync()
            frame = b"\x82\xff" + (1 << 30).to_bytes(8, "big") + bytes(4)  # and none of its bytes
            client.connection.socket.sendall(frame)
            with pytest.raises(ConnectionClosed, match="1009"):
                client.wait_status()
        eventually(lambda: bridge.server.clients == 0, "the end of the clients")
        with bridge.client() as first, bridge.client():
            with pytest.raises(InvalidStatus, match="503") as third, bridge.client():
                pass
            assert b"there are 2 clients, which is the limit" in third.value.response.body
            first.sync()
        eventually(lambda: bridge.server.clients == 0, "the end of the clients")
        with bridge.client() as client:
            client.sync()


@pytest.mark.parametrize(
    ("options", "path", "status"),
    [
        ({}, "", 403),
        ({}, "?token=wrong", 401),
        ({"origin": "http://evil.example"}, "", 403),
        ({}, "?token=secret", None),
        ({"origin": "http://evil.example"}, "?token=secret", None),
        ({"additional_headers": {"Authorization": "Bearer secret"}}, "", None),
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
        assert refused.value.response.body


def test_other_pages_and_protocols(bridge: Bridge) -> None:
    with bridge.client(origin="http://localhost:8080") as client:
        client.sync()
    with pytest.raises(InvalidStatus) as refused, bridge.client(origin="http://robot.example"):
        pass
    assert b"--origin 'http://robot.example'" in refused.value.response.body
    for origin in ("file://", "file://localhost"):
        with pytest.raises(InvalidStatus) as refused, bridge.client(origin=origin):
            pass
        assert f"--origin '{origin}'".encode() in refused.value.response.body
    with pytest.raises(InvalidStatus, match="400"), bridge.client(subprotocols=None):
        pass


def test_a_read_only_bridge(network: Network) -> None:
    network.node("other").publisher("name", String, latch=True).publish("x")
    with (
        bridge_on(network, access=ServerAccess(policy=AccessPolicy(read_only=True))) as bridge,
        bridge.client() as client,
    ):
        capabilities = client.wait_op("serverInfo")["capabilities"]
        assert capabilities == ["parameters", "parametersSubscribe", "connectionGraph", "assets"]
        client.subscribe("/name")
        assert client.wait_data()[2] == String("x").to_cdr()
        client.send("advertise", channels=[])
        assert client.wait_status() == "advertise: this bridge does not offer 'clientPublish'"
        client.send_binary("BIII", 2, 1, 1, 0)
        assert "does not offer 'services'" in client.wait_status()
        client.send("setParameters", parameters=[{"name": "/x", "value": 1}])
        assert "read-only" in client.wait_status()


def test_rules_and_patterns(network: Network) -> None:
    node = network.node("other")
    for name in ("odom", "secret"):
        node.publisher(name, String)
        node.service(f"{name}/flip", SetBool, lambda _: (True, ""))
        node.params[f"/{name}/rate"] = 1
    rules = read_rules("foxglove: {subscribe: [/odom], call: [/odom/flip]}", "rules.yaml")
    up = {"id": 1, "topic": "/x", "encoding": "cdr", "schemaName": "std_msgs/String"}
    for policy in (
        AccessPolicy(rules.permit_at_bridge("foxglove")),
        AccessPolicy(topics=("/odom",), services=("/odom/*",), params=("/odom/*",)),
        AccessPolicy(
            topics=(re.compile("/odom|/x"),),
            services=(re.compile("/od.*"),),
            params=(re.compile("/odom/.*"),),
            published=(re.compile("/cmd"),),
        ),
    ):
        with (
            bridge_on(network, access=ServerAccess(policy=policy)) as bridge,
            bridge.client() as client,
        ):
            client.channel("/odom")
            client.service("/odom/flip")
            assert set(client.channels) == {"/odom"}
            assert set(client.services) == {"/odom/flip"}
            client.send("getParameters", parameterNames=["/secret/rate"])
            assert "clients get '/secret/rate'" in client.wait_status().replace("may not ", "")
            client.send("advertise", channels=[up])
            assert "clients publish '/x'" in client.wait_status().replace("may not ", "")


def test_the_end_of_a_bridge(network: Network) -> None:
    with bridge_on(network) as bridge:
        connection = connect(f"ws://127.0.0.1:{bridge.server.port}", subprotocols=SUBPROTOCOLS)
    with connection, pytest.raises(ConnectionClosed, match="1001"):
        Client(connection).wait(lambda _: False)


def test_a_file_that_is_too_large(network: Network) -> None:
    packages: Path = package_in(network.folder)
    with (packages / "arm" / "large.stl").open("wb") as file:
        file.truncate((64 << 20) + 1)
    with bridge_on(network, packages) as bridge, bridge.client() as client:
        client.send("fetchAsset", uri="package://arm/large.stl", requestId=1)
        frame = client.wait(lambda one: isinstance(one, bytes))
        assert b"larger than 64 MB" in frame


def test_the_launch_file(network: Network) -> None:
    secret = network.folder / "password"
    secret.write_text("secret\n")
    launch = network.run(
        *("-m", "rosz", "launch", "foxglove_bridge", "foxglove_bridge.launch", "port:=0"),
        *("topic_whitelist:=['/o.*']", f"password_file:={secret}", "output:=screen"),
    )
    launch.wait_for("Foxglove connects to ws://127.0.0.1:", timeout=60)
    port = int(re.search(r"ws://127.0.0.1:(\d+)", launch.output)[1])  # type: ignore[index]
    for name in ("odom", "hidden"):
        network.node(name).publisher(name, String)
    url = f"ws://127.0.0.1:{port}/?token=secret"
    with connect(url, subprotocols=SUBPROTOCOLS) as connection:
        client = Client(connection)
        client.channel("/odom")
        client.sync()
        assert "/hidden" not in client.channels
