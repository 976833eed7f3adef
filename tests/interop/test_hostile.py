"""Damage from the network: no crash, no hang, one line of the log per kind, and life goes on."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from queue import SimpleQueue
from typing import Any

import pytest
import zenoh
from network import TIMEOUT, Network, eventually

from rosz.msgs.example_interfaces.srv import AddTwoInts
from rosz.msgs.sensor_msgs.msg import PointCloud2
from rosz.msgs.std_msgs.msg import String
from rosz.node import MessageInfo, Node
from rosz.session.mesh import machine_id

from .plain import Plain, plain_session

STRING = f"std_msgs::msg::dds_::String_/{String._type_hash}"
ADD = f"example_interfaces::srv::dds_::AddTwoInts_/{AddTwoInts._type_hash}"
HELLO = String("hello").to_cdr()
GID = bytes(range(16))
FINE = struct.pack("<qqB16s", 1, 2, 16, GID)


@pytest.fixture
def node(network: Network) -> Node:
    return network.node("victim")


@pytest.fixture
def plain(network: Network, node: Node) -> Iterator[Plain]:
    assert node.context.mesh.ready.is_set()
    with plain_session(network.rendezvous) as session:
        yield session


DAMAGED_ATTACHMENTS = {
    "empty": b"",
    "short": FINE[:-1],
    "long": FINE + b"\0",
    "old release": bytes(77),
    "other size of GID": struct.pack("<qqB16s", 1, 2, 15, GID),
    "random": bytes(range(256)) * 100,
}
DAMAGED_STRINGS = {
    "empty": b"",
    "no body": b"\0\1\0\0",
    "unknown encoding": b"\0\7" + HELLO[2:],
    "length beyond the end": b"\0\1\0\0\xff\xff\xff\xff",
    "no end": HELLO[:-1],
    "no UTF-8": b"\0\1\0\0\3\0\0\0\xff\xfe\0",
}


@pytest.mark.parametrize("damage", DAMAGED_ATTACHMENTS.values(), ids=DAMAGED_ATTACHMENTS)
@pytest.mark.parametrize("form", ["callback", "iteration", "generic", "latched"])
def test_attachments(
    node: Node, plain: Plain, capfd: pytest.CaptureFixture[str], damage: bytes, form: str
) -> None:
    got = listen(node, form)
    for _ in range(20):
        plain.put(f"42/chatter/{STRING}", HELLO, attachment=damage)
    plain.put(f"42/chatter/{STRING}", HELLO, attachment=FINE)
    assert got() == String("hello")
    node.close()
    assert capfd.readouterr().err.count("dropping damaged samples on '/chatter'") == 1


@pytest.mark.parametrize("damage", DAMAGED_STRINGS.values(), ids=DAMAGED_STRINGS)
@pytest.mark.parametrize("form", ["callback", "iteration", "generic", "latched"])
def test_payloads(
    node: Node, plain: Plain, capfd: pytest.CaptureFixture[str], damage: bytes, form: str
) -> None:
    got = listen(node, form)
    for _ in range(20):
        plain.put(f"42/chatter/{STRING}", damage, attachment=FINE)
    later = struct.pack("<qqB16s", 100, 2, 16, GID)
    plain.put(f"42/chatter/{STRING}", HELLO, attachment=later)
    assert got() == String("hello")
    node.close()
    assert capfd.readouterr().err.count("dropping damaged samples on '/chatter'") == 1


def listen(node: Node, form: str) -> Any:
    """Subscribe in one of several ways, and return what gives the next message."""
    from rosz.qos import QoS

    if form == "callback":
        got: SimpleQueue[String] = SimpleQueue()
        node.subscription("chatter", String, got.put, queue_size=100)
        return lambda: got.get(timeout=TIMEOUT)
    if form == "generic":
        return node.subscription("chatter", queue_size=100).get
    qos = QoS(depth=100, durability="transient_local" if form == "latched" else "volatile")
    return node.subscription("chatter", String, qos=qos).get


def test_kinds_of_damage_are_bounded(
    node: Node, plain: Plain, capfd: pytest.CaptureFixture[str]
) -> None:
    """A sender that is broken in a thousand ways does not fill the disk."""
    got: SimpleQueue[object] = SimpleQueue()
    node.subscription("cloud", PointCloud2, got.put, queue_size=5000)
    key = f"42/cloud/sensor_msgs::msg::dds_::PointCloud2_/{PointCloud2._type_hash}"
    cloud = PointCloud2(data=bytes(1000)).to_cdr()
    for end in range(len(cloud)):
        plain.put(key, cloud[:end], attachment=FINE)
    plain.put(key, cloud, attachment=struct.pack("<qqB16s", 9999, 2, 16, GID))
    assert got.get(timeout=TIMEOUT) == PointCloud2(data=bytes(1000))
    node.close()
    assert capfd.readouterr().err.count("dropping damaged samples on '/cloud'") <= 10


def test_no_attachment_is_no_damage(node: Node, plain: Plain) -> None:
    """Plain Zenoh publishers are welcome; where a sample comes from is then unknown."""
    got: SimpleQueue[tuple[String, MessageInfo]] = SimpleQueue()
    node.subscription("chatter", String, lambda *both: got.put(both), with_info=True)
    plain.put(f"42/chatter/{STRING}", HELLO)
    message, info = got.get(timeout=TIMEOUT)
    assert message == String("hello")
    assert (info.sequence, info.gid, info.source_time, info.lost) == (0, b"", 0, 0)


def test_strange_sequence_numbers(node: Node, plain: Plain) -> None:
    """From 0, negative, going back, beyond all bounds: every sample is delivered."""
    got: SimpleQueue[int] = SimpleQueue()
    node.subscription(
        "chatter", String, lambda _, info: got.put(info.sequence), queue_size=100, with_info=True
    )
    numbers = [0, 1, 1, 0, -5, 7, 3, (1 << 63) - 1, -(1 << 63), 2]
    for number in numbers:
        attachment = struct.pack("<qqB16s", number, 2, 16, GID)
        plain.put(f"42/chatter/{STRING}", HELLO, attachment=attachment)
    assert [got.get(timeout=TIMEOUT) for _ in numbers] == numbers


@pytest.mark.parametrize(
    ("payload", "attachment", "text"),
    [
        (None, FINE, "example_interfaces/AddTwoInts"),
        (b"", FINE, "example_interfaces/AddTwoInts"),
        (b"\0\1\0\0\1\2", FINE, "example_interfaces/AddTwoInts"),
        (struct.pack("<4sqq", b"\0\1\0\0", 1, 2), b"short", "attachment"),
    ],
)
def test_queries(
    node: Node, plain: Plain, payload: bytes | None, attachment: bytes, text: str
) -> None:
    node.service("add", AddTwoInts, lambda request: request.a + request.b)
    for _ in range(3):
        (reply,) = plain.ask(f"42/add/{ADD}", payload=payload, attachment=attachment)
        assert reply.err is not None
        assert text in reply.err.payload.to_string()
    good = struct.pack("<4sqq", b"\0\1\0\0", 1, 2)
    (reply,) = plain.ask(f"42/add/{ADD}", payload=good)  # no attachment, no harm
    assert reply.ok is not None


def test_answers(network: Network, node: Node, plain: Plain) -> None:
    """A server that answers with damage, with an error that is no text, or twice."""
    from rosz.errors import ServiceError

    queries = plain.queries(f"42/add/{ADD}")
    plain.token(f"@ros2_lv/42/{plain.session.zid()}/0/1/SS/%/%/bad/%add/{ADD}/::,10:,:,:,,")
    client = node.client("add", AddTwoInts)
    client.wait_for_service()
    ends: SimpleQueue[object] = SimpleQueue()

    def call() -> None:
        try:
            ends.put(client(1, 2).sum)
        except ServiceError as error:
            ends.put(str(error))

    def answer(payload: bytes, *, error: bool = False, times: int = 1) -> object:
        network.thread(call)
        with queries.get(timeout=TIMEOUT) as query:
            for _ in range(times):
                if error:
                    query.reply_err(payload)
                else:
                    query.reply(f"42/add/{ADD}", payload)
        return ends.get(timeout=TIMEOUT)

    assert "service [/add] sent a damaged response: " in str(answer(b"\0\1\0\0\1"))
    assert "service [/add] sent a damaged response: " in str(answer(b""))
    assert "responded with an error: \ufffd\ufffd" in str(answer(b"\xff\xfe", error=True))
    assert answer(struct.pack("<4sq", b"\0\1\0\0", 3), times=2) == 3


def test_what_is_addressed_to_nobody(node: Node, plain: Plain) -> None:
    """Inboxes and links that make no sense."""
    zid = node.context.session.zid
    subscription = node.subscription("chatter", String)
    for number in ("x", "-1", "99999999999999999999"):
        plain.put(f"@rosz/42/inbox/{zid}/{number}", b"junk")
    inbox = f"@rosz/42/inbox/{zid}/{subscription.token.entity_id}"
    plain.put(inbox, b"junk")
    plain.session.delete(inbox)
    plain.put(inbox, HELLO, attachment=FINE)
    assert subscription.get() == String("hello")


def test_control(node: Node, plain: Plain) -> None:
    key = f"@rosz/42/control/{node.context.session.zid}/{node.node_id}"
    for payload in (b"", b"\xc1", b"\x91\x01", b"\x81\xa6action\xa5dance"):
        (reply,) = plain.ask(key, payload=payload, target=zenoh.QueryTarget.ALL)
        assert reply.err is not None
    assert not node.is_shutdown


def test_answers_about_links(network: Network, plain: Plain) -> None:
    """Somebody who lies about links delays nobody for ever."""
    lies = plain.queries(f"@rosz/links/{machine_id()}/liar")

    def lie() -> None:
        while True:
            query = lies.get()
            if query is None:
                return
            with query:
                query.reply(f"@rosz/links/{machine_id()}/liar", b"\xc1junk")

    network.thread(lie)
    newcomer = network.node("newcomer")
    assert newcomer.context.mesh.ready.wait(TIMEOUT)
    lies.put(None)  # type: ignore[arg-type]  # the end


def test_deletes_are_no_messages(node: Node, plain: Plain) -> None:
    subscription = node.subscription("chatter", String)
    plain.session.delete(f"42/chatter/{STRING}")
    plain.put(f"42/chatter/{STRING}", HELLO, attachment=FINE)
    assert subscription.get() == String("hello")


def test_flood_of_tokens(network: Network, node: Node) -> None:
    """Hundreds of tokens, some of them damaged, that come and go."""
    with plain_session(network.rendezvous) as visitor:
        for number in range(300):
            visitor.token(f"@ros2_lv/42/feed/{number}/{number}/NN/%/%/n{number}")
            visitor.token(f"@ros2_lv/42/feed/{number}/x/NN/%/%/n{number}")
        graph = node.context.graph
        graph.wait_for(lambda view: len(view.nodes()) == 301, TIMEOUT, "all tokens")
    eventually(lambda: node.context.graph.view().nodes() == ["/victim"], "all tokens are gone")
