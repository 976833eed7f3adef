"""Every key, token, attachment and payload of rosz, byte for byte, as plain Zenoh sees them."""

from __future__ import annotations

import struct
import time
from collections.abc import Iterator
from queue import SimpleQueue
from typing import Any

import pytest
import xxhash
import zenoh
from network import TIMEOUT, Network, eventually

from rosz.msgs.example_interfaces.srv import AddTwoInts
from rosz.msgs.geometry_msgs.msg import Twist
from rosz.msgs.std_msgs.msg import String
from rosz.msgs.std_srvs.srv import Empty
from rosz.node import SubscriberLink
from rosz.qos import QoS

from .plain import Plain, plain_session

STRING = (
    "std_msgs::msg::dds_::String_/"
    "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
)
TWIST = (
    "geometry_msgs::msg::dds_::Twist_/"
    "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"
)
ADD = (
    "example_interfaces::srv::dds_::AddTwoInts_/"
    "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
)
HELLO = bytes.fromhex("000100000600000068656c6c6f00")
NO_FIELDS = bytes.fromhex("0001000000")
SECOND = 1_000_000_000


@pytest.fixture
def plain(network: Network) -> Iterator[Plain]:
    network.context()  # the one that holds the rendezvous
    with plain_session(network.rendezvous) as session:
        yield session


def next_of(queue: SimpleQueue[Any]) -> Any:
    return queue.get(timeout=TIMEOUT)


def next_token(queue: SimpleQueue[tuple[str, bool]], part: str) -> tuple[str, bool]:
    while True:
        key, alive = next_of(queue)
        if part in key:
            return key, alive


def split(attachment: zenoh.ZBytes | None) -> tuple[int, int, bytes]:
    """Read an attachment by the reference, and check that each byte of it is as it should be."""
    assert attachment is not None
    raw = attachment.to_bytes()
    assert len(raw) == 33
    sequence, source_time = struct.unpack_from("<qq", raw)
    assert raw[16] == 0x10
    assert abs(source_time - time.time_ns()) < 60 * SECOND
    return sequence, source_time, raw[17:]


def gid_of(token: str) -> bytes:
    return xxhash.xxh3_128_digest(token.encode())[::-1]


def number_of(token: str) -> int:
    return int(token.split("/")[4])


def test_talker(network: Network, plain: Plain) -> None:
    tokens = plain.tokens("@ros2_lv/42/**")
    samples = plain.subscribe(f"42/robot1/chatter/{STRING}")
    node = network.node("talker", argv=["__ns:=/robot1"])
    zid = node.context.session.zid
    publisher = node.publisher("chatter", String)

    key, alive = next_token(tokens, "/NN/")
    assert (key, alive) == (f"@ros2_lv/42/{zid}/0/0/NN/%/%robot1/talker", True)
    token, alive = next_token(tokens, "%chatter")
    number = number_of(token)
    assert alive
    assert token == (
        f"@ros2_lv/42/{zid}/0/{number}/MP/%/%robot1/talker/%robot1%chatter/{STRING}/::,10:,:,:,,"
    )

    for count in (1, 2, 3):
        publisher.publish("hello")
        sample = next_of(samples)
        sequence, _, gid = split(sample.attachment)
        assert str(sample.key_expr) == f"42/robot1/chatter/{STRING}"
        assert sample.payload.to_bytes() == HELLO
        assert sequence == count
        assert gid == gid_of(token) == publisher.gid
        assert sample.encoding == zenoh.Encoding.ZENOH_BYTES
        assert sample.priority == zenoh.Priority.DATA
        assert sample.congestion_control == zenoh.CongestionControl.DROP
        assert not sample.express

    publisher.close()
    assert next_token(tokens, "%chatter") == (token, False)
    node.close()
    assert next_token(tokens, "/NN/") == (f"@ros2_lv/42/{zid}/0/0/NN/%/%robot1/talker", False)


def test_listener(network: Network, plain: Plain) -> None:
    tokens = plain.tokens("@ros2_lv/42/**")
    node = network.node("listener")
    zid = node.context.session.zid
    node.subscription("cmd_vel", Twist, print, queue_size=1)
    token, _ = next_token(tokens, "cmd_vel")
    assert token == (
        f"@ros2_lv/42/{zid}/0/{number_of(token)}/MS/%/%/listener/%cmd_vel/{TWIST}/::,1:,:,:,,"
    )


def test_payload_of_a_nested_message(network: Network, plain: Plain) -> None:
    samples = plain.subscribe(f"42/cmd_vel/{TWIST}")
    publisher = network.node().publisher("/cmd_vel", Twist)
    message = Twist()
    message.linear.x = 1.5
    message.angular.z = -0.25
    publisher.publish(message)
    assert next_of(samples).payload.to_bytes() == b"\0\1\0\0" + struct.pack(
        "<6d", 1.5, 0, 0, 0, 0, -0.25
    )


@pytest.mark.parametrize(
    ("qos", "chunk"),
    [
        (QoS(), "::,10:,:,:,,"),
        (QoS(depth=42), "::,:,:,:,,"),
        (QoS(depth=1, durability="transient_local"), ":1:,1:,:,:,,"),
        (QoS(depth=5, reliability="best_effort"), "2::,5:,:,:,,"),
        (QoS(depth=42, history="keep_all"), "::2,:,:,:,,"),
        (QoS(deadline=SECOND // 10), "::,10:0,100000000:,:,,"),
        (
            QoS(depth=1000, durability="transient_local", lifespan=10 * SECOND),
            ":1:,1000:,:10,0:,,",
        ),
    ],
)
def test_qos(network: Network, plain: Plain, qos: QoS, chunk: str) -> None:
    tokens = plain.tokens("@ros2_lv/42/**")
    node = network.node()
    node.publisher("a", String, qos=qos)
    node.subscription("b", String, print, qos=qos)
    assert next_token(tokens, "%a/")[0].endswith(f"/{chunk}")
    assert next_token(tokens, "%b/")[0].endswith(f"/{chunk}")


@pytest.mark.parametrize(
    ("qos", "congestion"),
    [
        (QoS(), zenoh.CongestionControl.DROP),
        (QoS(reliability="best_effort"), zenoh.CongestionControl.DROP),
        (QoS(history="keep_all"), zenoh.CongestionControl.BLOCK),
        (QoS(history="keep_all", reliability="best_effort"), zenoh.CongestionControl.DROP),
    ],
)
def test_congestion(
    network: Network, plain: Plain, qos: QoS, congestion: zenoh.CongestionControl
) -> None:
    samples = plain.subscribe(f"42/chatter/{STRING}")
    network.node().publisher("chatter", String, qos=qos).publish("hello")
    assert next_of(samples).congestion_control == congestion


def test_latched_cache(network: Network, plain: Plain) -> None:
    """What is latched is served from rmw_zenoh's advanced publisher cache."""
    node = network.node()
    publisher = node.publisher("map", String, qos=QoS(depth=2, durability="transient_local"))
    for text in ("one", "two", "three"):
        publisher.publish(text)
    node.context.mesh.ready.wait(TIMEOUT)
    zid = node.context.session.zid

    def ask() -> list[zenoh.Reply]:
        return plain.ask(
            f"42/map/{STRING}/@adv/pub/{zid}/**?_max=2;_anyke",
            target=zenoh.QueryTarget.ALL,
            accept_replies=zenoh.ReplyKeyExpr.ANY,
        )

    eventually(ask, "the cache is known")
    samples = [reply.ok for reply in ask()]
    assert [sample and sample.payload.to_bytes()[8:-1] for sample in samples] == [b"two", b"three"]
    assert [sample and str(sample.key_expr) for sample in samples] == [f"42/map/{STRING}"] * 2
    assert [split(sample and sample.attachment)[0] for sample in samples] == [2, 3]


def test_service_server(network: Network, plain: Plain) -> None:
    tokens = plain.tokens("@ros2_lv/42/**")
    node = network.node("adder")
    node.service("/add", AddTwoInts, lambda request: request.a + request.b)
    token, _ = next_token(tokens, "/SS/")
    zid = node.context.session.zid
    assert token == (f"@ros2_lv/42/{zid}/0/{number_of(token)}/SS/%/%/adder/%add/{ADD}/::,10:,:,:,,")
    gid = bytes(range(16))
    request = struct.pack("<4sqq", b"\0\1\0\0", 3, 4)
    for sequence in (7, 8):
        asked = struct.pack("<qqB16s", sequence, 5, 16, gid)
        (reply,) = plain.ask(f"42/add/{ADD}", payload=request, attachment=asked)
        assert reply.ok is not None
        assert str(reply.ok.key_expr) == f"42/add/{ADD}"
        assert reply.ok.payload.to_bytes() == struct.pack("<4sq", b"\0\1\0\0", 7)
        echoed, source_time, whose = split(reply.ok.attachment)
        assert (echoed, whose) == (sequence, gid)
        assert source_time != 5


def test_service_client(network: Network, plain: Plain) -> None:
    tokens = plain.tokens("@ros2_lv/42/**")
    queries = plain.queries(f"42/add/{ADD}")
    plain.token(f"@ros2_lv/42/{plain.session.zid()}/0/1/SS/%/%/adder/%add/{ADD}/::,10:,:,:,,")
    node = network.node("caller")
    client = node.client("add", AddTwoInts)
    token, _ = next_token(tokens, "/SC/")
    assert token == (
        f"@ros2_lv/42/{node.context.session.zid}/0/{number_of(token)}"
        f"/SC/%/%/caller/%add/{ADD}/::,10:,:,:,,"
    )
    client.wait_for_service()
    answers: SimpleQueue[Any] = SimpleQueue()
    for count in (1, 2):
        network.thread(lambda: answers.put(client(20, 22)))
        query = next_of(queries)
        with query:
            sequence, _, gid = split(query.attachment)
            assert (sequence, gid) == (count, gid_of(token))
            assert query.payload.to_bytes() == struct.pack("<4sqq", b"\0\1\0\0", 20, 22)
            assert str(query.key_expr) == f"42/add/{ADD}"
            assert str(query.parameters) == ""
            answer = struct.pack("<4sq", b"\0\1\0\0", 42)
            query.reply(f"42/add/{ADD}", answer, attachment=query.attachment)
        assert next_of(answers).sum == 42


def test_service_without_fields(network: Network, plain: Plain) -> None:
    """An empty message has a byte, for there are no empty payloads."""
    node = network.node()
    tokens = plain.tokens("@ros2_lv/42/**")
    node.service("reset", Empty, lambda _: None)
    next_token(tokens, "/SS/")
    kind = Empty._type_hash
    attachment = struct.pack("<qqB16s", 1, 1, 16, bytes(16))
    (reply,) = plain.ask(
        f"42/reset/std_srvs::srv::dds_::Empty_/{kind}", payload=NO_FIELDS, attachment=attachment
    )
    assert reply.ok is not None
    assert reply.ok.payload.to_bytes() == NO_FIELDS


def test_service_is_complete(network: Network, plain: Plain) -> None:
    """ROS 2 clients ask complete servers only, and several of one name answer all."""
    tokens = plain.tokens("@ros2_lv/42/**")
    network.node("first").service("which", AddTwoInts, lambda _: 1)
    network.node("second").service("which", AddTwoInts, lambda _: 2)
    for _ in range(2):
        next_token(tokens, "/SS/")
    attachment = struct.pack("<qqB16s", 1, 1, 16, bytes(16))
    request = struct.pack("<4sqq", b"\0\1\0\0", 0, 0)
    replies = plain.ask(f"42/which/{ADD}", payload=request, attachment=attachment)
    answers = sorted(reply.ok.payload.to_bytes()[4] for reply in replies if reply.ok)
    assert answers == [1, 2]


def test_error_of_a_handler(network: Network, plain: Plain) -> None:
    def fail(_request: object) -> None:
        raise ValueError("no such thing")

    tokens = plain.tokens("@ros2_lv/42/**")
    network.node().service("add", AddTwoInts, fail)
    next_token(tokens, "/SS/")
    attachment = struct.pack("<qqB16s", 1, 1, 16, bytes(16))
    request = struct.pack("<4sqq", b"\0\1\0\0", 0, 0)
    (reply,) = plain.ask(f"42/add/{ADD}", payload=request, attachment=attachment)
    assert reply.err is not None
    assert reply.err.payload.to_string() == "error processing request: no such thing"


def test_humble(network: Network, plain: Plain) -> None:
    tokens = plain.tokens("@ros2_lv/42/**")
    samples = plain.subscribe("42/chatter/std_msgs::msg::dds_::String_/TypeHashNotSupported")
    node = network.node(context=network.context(distro="humble"))
    node.publisher("chatter", String).publish("hello")
    assert (
        "/std_msgs::msg::dds_::String_/TypeHashNotSupported/" in next_token(tokens, "%chatter")[0]
    )
    assert next_of(samples).payload.to_bytes() == HELLO


def test_own_keys_hide_from_wildcards(network: Network, plain: Plain) -> None:
    """What is rosz's own, a ROS 2 tool that listens to everything never sees."""
    samples = plain.subscribe("**")
    node, listener = network.node(), network.node("listener")
    chatter = node.publisher("chatter", String)
    listener.subscription("chatter", String, print)
    linked: SimpleQueue[SubscriberLink[String]] = SimpleQueue()
    chatter.on_connection(linked.put)
    next_of(linked).publish(String("for you alone"))
    chatter.publish("hello")
    assert str(next_of(samples).key_expr) == f"42/chatter/{STRING}"
