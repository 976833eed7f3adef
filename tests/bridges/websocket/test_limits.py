"""Clients that take too much: they are refused in words, and others go on."""

from __future__ import annotations

import gc
import json
import socket
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import cbor2
import pytest
from network import TIMEOUT, Network, eventually
from websockets.exceptions import ConnectionClosed

from rosz.access import AccessPolicy, ServerAccess
from rosz.bridges.clients import OutgoingQueue
from rosz.bridges.rosbridge import RosbridgeLimits
from rosz.bridges.rosbridge.encoded import EncodedMessage, Encodings, SubscribedQueue
from rosz.bridges.rosbridge.operations import Fragment, Fragments
from rosz.errors import UsageError
from rosz.msgs.sensor_msgs.msg import Image
from rosz.msgs.std_msgs.msg import String
from rosz.msgs.std_srvs.srv import Empty

from .bridge import Bridge, bridge_on

system = pytest.mark.system

HANDSHAKE = (
    b"GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n"
)
"""Request of a client."""


@pytest.fixture
def bridge(network: Network) -> Iterator[Bridge]:
    with bridge_on(network) as made:
        yield made


def response(client: socket.socket) -> bytes:
    """Return the status of the answer to a handshake."""
    client.settimeout(TIMEOUT)
    return client.makefile("rb").readline().split()[1]


@system
def test_all_come_at_once(network: Network) -> None:
    with bridge_on(network, limits=RosbridgeLimits(clients=20)) as bridge, bridge.client() as first:
        clients = [socket.create_connection(("127.0.0.1", bridge.server.port)) for _ in range(60)]
        for client in clients:
            client.sendall(HANDSHAKE)
        answers = [response(client) for client in clients]
        assert (answers.count(b"101"), answers.count(b"503")) == (19, 41)
        first.sync()
        for client in clients:
            client.close()
        eventually(lambda: bridge.server.clients == 1, "the end of the others")
        with bridge.client() as late:
            late.sync()


@pytest.mark.skipif(sys.platform != "linux", reason="it counts threads of the system")
def test_threads_of_many_subscriptions(network: Network) -> None:
    def threads() -> int:
        return sum(1 for _ in Path("/proc/self/task").iterdir())

    count, talker = 500, network.node("talker")
    limits = RosbridgeLimits(subscriptions=count + 1)
    with bridge_on(network, limits=limits) as bridge, bridge.client(ping_interval=None) as client:
        client.send("subscribe", topic="/other", type="std_msgs/String")
        client.sync()
        few = threads()
        for number in range(count):
            client.send("subscribe", topic=f"/topic{number}", type="std_msgs/String")
            if number % 20 == 0:
                client.sync()
        client.sync()
        eventually(lambda: threads() <= few + 30, "few threads without traffic")
        publishers = [talker.publisher(f"topic{number}", String) for number in range(count)]
        for publisher in publishers:
            publisher.wait_for_subscribers()
        for publisher in publishers:
            publisher.publish("hello")
        topics = {client.receive_op("publish")["topic"] for _ in range(count)}
        assert topics == {f"/topic{number}" for number in range(count)}
        eventually(lambda: threads() <= few + 30, "few threads after the traffic")


@system
@pytest.mark.parametrize(
    "data",
    [b"\x00" * 5000, b"GET / HTTP/1.1\r\n\r\n", b"\x16\x03\x01\x02\x00\x01", b"x" * 200_000],
    ids=["zeros", "no upgrade", "TLS", "one long line"],
)
def test_no_websocket(bridge: Bridge, data: bytes) -> None:
    with bridge.client() as other:
        with socket.create_connection(("127.0.0.1", bridge.server.port)) as garbage:
            garbage.settimeout(TIMEOUT)
            try:
                garbage.sendall(data)
                garbage.shutdown(socket.SHUT_WR)
                while garbage.recv(4096):
                    pass
            except ConnectionError:
                pass
        other.sync()


@system
def test_an_enormous_frame(bridge: Bridge) -> None:
    with bridge.client() as other, bridge.client() as client:
        announced = b"\x82\xff" + (1 << 30).to_bytes(8, "big") + bytes(4)
        client.connection.socket.sendall(announced)
        with pytest.raises(ConnectionClosed, match="1009"):
            client.receive()
        other.sync()


@system
@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ({"op": "fragment", "id": "a", "data": "x", "num": 0, "total": 2}, "missing or wrong"),
        ({"op": "subscribe", "topic": "/x"}, "missing or wrong"),
        ({"op": "no such thing"}, "missing or wrong"),
        ({"op": "auth", "mac": "x" * 5000}, "1009"),
        (None, "the password is missing"),
    ],
)
def test_clients_without_the_password(network: Network, text: Any, reason: str) -> None:
    limits = RosbridgeLimits(password_seconds=0.1 if text is None else TIMEOUT)
    options: Any = {
        "access": ServerAccess(policy=AccessPolicy(password="secret")),
        "limits": limits,
    }
    with bridge_on(network, **options) as bridge, bridge.client("?token=secret") as trusted:
        with bridge.client() as client:
            if text is not None:
                client.connection.send(json.dumps(text))
            with pytest.raises(ConnectionClosed, match=reason):
                client.receive()
        trusted.send("advertise", topic="/" + "long" * 2000, type="std_msgs/String")
        trusted.sync()


@system
@pytest.mark.parametrize(
    ("op", "members"),
    [
        ("subscribe", {"topic": "NAME"}),
        ("subscribe", {"topic": "/a", "type": "std_msgs/NAME"}),
        ("advertise", {"topic": "NAME", "type": "std_msgs/String"}),
        ("publish", {"topic": "NAME", "type": "std_msgs/String"}),
        ("advertise_service", {"service": "NAME", "type": "std_srvs/Empty"}),
        ("advertise_action", {"action": "NAME", "type": "actionlib/Test"}),
        ("call_service", {"service": "NAME"}),
        ("send_action_goal", {"action": "NAME", "action_type": "actionlib/Test", "id": "x"}),
    ],
)
def test_names_that_are_too_long(bridge: Bridge, op: str, members: dict[str, str]) -> None:
    """Zenoh would panic, and end the bridge for all."""
    bridge.network.node("other").publisher("chatter", String, latch=True).publish(String("on"))
    with bridge.client() as client, bridge.client() as other:
        client.send(
            op, **{key: text.replace("NAME", "x" * 66_000) for key, text in members.items()}
        )
        answer = client.receive()
        assert answer.get("level", "error") == "error"
        assert answer.get("result") in {None, False}
        other.send("subscribe", topic="/chatter", type="std_msgs/String")
        assert other.receive_op("publish")["msg"] == {"data": "on"}


@system
def test_what_one_client_may_have(network: Network) -> None:
    """Others have their own: what is refused is named, and what is given up makes room."""
    limits = RosbridgeLimits(subscriptions=2, advertisements=2, services=2)
    with bridge_on(network, limits=limits) as bridge, bridge.client() as client:
        for op, name, kind, word in (
            ("subscribe", "topic", "std_msgs/String", "subscriptions"),
            ("advertise", "topic", "std_msgs/String", "advertisements"),
            ("advertise_service", "service", "std_srvs/Empty", "services"),
            ("advertise_action", "action", "actionlib/Test", "services"),
        ):
            for number in (1, 2, 2, 3):
                client.send(op, **{name: f"/x{number}"}, type=kind)
            refusal = f"this client has 2 {word}, which is the limit"
            assert client.receive()["msg"] == f"{op}: {refusal}"
            with bridge.client() as other:
                other.send(op, **{name: "/x3"}, type=kind)
                other.sync()
            undo = op.replace("sub", "unsub") if op == "subscribe" else f"un{op}"
            client.send(undo, **{name: "/x1"})
            client.send(op, **{name: "/x3"}, type=kind)
            client.sync()


@system
def test_too_many_calls(network: Network) -> None:
    go_on = threading.Event()

    def wait(_request: Any) -> Any:
        go_on.wait(TIMEOUT)
        return Empty.Response()

    network.node("other").service("wait", Empty, wait)
    with bridge_on(network, limits=RosbridgeLimits(calls=3)) as bridge, bridge.client() as client:
        bridge.wait_for_service("/wait")
        for number in range(4):
            client.send("call_service", service="/wait", id=number)
        refused = client.receive_op("service_response")
        assert (refused["id"], refused["result"]) == (3, False)
        assert refused["values"] == "this client has 3 calls, which is the limit"
        go_on.set()
        assert {client.receive_op("service_response")["id"] for _ in range(3)} == {0, 1, 2}
        client.sync()


@system
def test_calls_that_do_not_end(network: Network) -> None:
    called: SimpleQueue[Any] = SimpleQueue()
    go_on = threading.Event()

    def wait(_request: Any) -> Any:
        called.put(None)
        go_on.wait(TIMEOUT)
        return Empty.Response()

    network.node("other").service("wait", Empty, wait)
    with (
        bridge_on(network, limits=RosbridgeLimits(operation=3000)) as bridge,
        bridge.client() as client,
    ):
        bridge.wait_for_service("/wait")
        for number in range(3):
            client.send("call_service", service="/wait", id=number)
        refused = client.receive_op("service_response")
        assert (refused["id"], refused["result"]) == (2, False)
        assert refused["values"].endswith("have not ended; wait for answers")
        go_on.set()
        assert {client.receive_op("service_response")["id"] for _ in range(2)} == {0, 1}
        client.sync()


@system
@pytest.mark.parametrize("compression", ["none", "cbor"])
def test_a_long_message_goes_in_frames(bridge: Bridge, compression: str) -> None:
    """What waits in the buffer of a socket is one of them."""
    node = bridge.network.node("other")
    node.publisher("image", Image, latch=True).publish(Image(data=bytes(1_000_000)))
    with bridge.client() as client:
        subscribe = {"type": "sensor_msgs/Image", "compression": compression}
        client.send("subscribe", topic="/image", **subscribe)
        pieces = list(client.connection.recv_streaming(decode=False))
        assert len(pieces) > 1
        whole = b"".join(pieces)
        read = json.loads if compression == "none" else cbor2.loads
        assert len(read(whole)["msg"]["data"]) >= 1_000_000
        client.sync()


def test_parts_are_bounded() -> None:
    parts = Fragments(1000)
    for number in range(3):
        assert parts.add(Fragment(id="a", data="", num=number, total=1 << 30)) is None
    assert parts.add(Fragment(id="a", data="x", num=0, total=1 << 30)) is None
    assert parts.add(Fragment(id="b", data="y", num=1, total=2)) is None
    with pytest.raises(UsageError, match="more than 1000 characters wait"):
        parts.add(Fragment(id="c", data="", num=0, total=2))
    assert parts.add(Fragment(id="b", data="y", num=1, total=2)) is None
    assert parts.add(Fragment(id="b", data="x", num=0, total=2)) == "xy"
    for _ in range(100):
        assert parts.add(Fragment(id="d", data="z" * 500, num=0, total=1)) == "z" * 500


def test_parts_have_one_total() -> None:
    parts = Fragments(1000)
    assert parts.add(Fragment(id="a", data="x", num=5, total=6)) is None
    with pytest.raises(UsageError, match="the parts of 'a' differ in their total"):
        parts.add(Fragment(id="a", data="y", num=0, total=2))
    assert parts.add(Fragment(id="a", data="z", num=0, total=1)) == "z"


def image(encodings: Encodings, size: int) -> EncodedMessage:
    """Return a message of a size."""
    return EncodedMessage(encodings, "/image", Image, Image(data=bytes(size)).to_cdr(), 0)


def test_encodings_are_bounded() -> None:
    """A client that does not read keeps messages, and not what was made of them for others."""
    encodings = Encodings(500_000)
    queue: OutgoingQueue[EncodedMessage] = OutgoingQueue(10_000_000, lambda: None, lambda: None)
    topic = SubscribedQueue()
    messages = [image(encodings, 100_000) for _ in range(50)]
    for message in messages:
        queue.offer(topic, message)
        message.encode(("none", "ros1"))
    kept = [one for message in messages for one in message._encoded.values()]
    assert 100_000 < sum(map(len, kept)) <= 500_000
    assert messages[-1].encode(("none", "ros1")) is messages[-1].encode(("none", "ros1"))
    assert messages[0].encode(("none", "ros1")) == messages[-1].encode(("none", "ros1"))


def test_what_waits_is_bounded() -> None:
    waiting = []
    queue: OutgoingQueue[EncodedMessage] = OutgoingQueue(
        1_000_000, lambda: None, lambda: waiting.append("too many answers")
    )
    topics = [SubscribedQueue() for _ in range(3)]
    encodings = Encodings(0)
    for number in range(300):
        queue.offer(topics[number % 3], image(encodings, 50_000))
    gc.collect()
    messages = [one for one in gc.get_objects() if isinstance(one, EncodedMessage)]
    assert sum(one.size for one in messages if one._encodings is encodings) < 1_100_000
    for _ in range(300):
        queue.put(bytes(50_000))
    assert waiting == ["too many answers"]
