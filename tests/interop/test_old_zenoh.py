"""Nodes whose Zenoh is an older one, as that of a ROS 2 which is not the newest, beside rosz.

The other side is plain Zenoh in an interpreter of its own, with the keys, tokens and attachments of
rmw_zenoh: a node that talks, listens, serves and calls.
"""

from __future__ import annotations

import json
from contextlib import suppress
from textwrap import dedent

import pytest
from cached import OLD_ZENOH, old_zenoh
from network import TIMEOUT, Network, Program, eventually, free_port

from rosz.errors import WaitTimeout
from rosz.message import Message
from rosz.msgs.example_interfaces.srv import AddTwoInts
from rosz.msgs.std_msgs.msg import String
from rosz.node import Node
from rosz.qos import DEFAULT, SERVICES
from rosz.session import Router
from rosz.wire import Kind, Token, entity_key, format_token

VERSIONS = (OLD_ZENOH, "1.9.0")
PARTNER = """
    import json
    import struct
    import sys
    import time

    import zenoh

    plan = json.loads(sys.argv[1])
    config = zenoh.Config()
    for key, value in plan["config"].items():
        config.insert_json5(key, json.dumps(value))
    session = zenoh.open(config)
    zid = str(session.zid())
    count = 0

    def attached():
        global count
        count += 1
        return struct.pack("<qqB", count, time.time_ns(), 16) + bytes(range(16))

    def serve(query):
        a, b = struct.unpack("<4xqq", query.payload.to_bytes())
        reply = b"\\0\\1\\0\\0" + struct.pack("<q", a + b)
        query.reply(plan["serve"], reply, attachment=query.attachment)
        query.drop()

    def heard(sample):
        print("heard", sample.payload.to_bytes().hex(), flush=True)

    subscriber = session.declare_subscriber(plan["listen"], heard)
    queryable = session.declare_queryable(plan["serve"], serve, complete=True)
    publisher = session.declare_publisher(plan["talk"])
    tokens = [
        session.liveliness().declare_token(key.replace("ZID", zid)) for key in plan["tokens"]
    ]
    print("up", zid, flush=True)
    for line in sys.stdin:
        verb, _, payload = line.strip().partition(" ")
        if verb == "publish":
            publisher.put(bytes.fromhex(payload), attachment=attached())
        else:
            replies = session.get(
                plan["call"],
                payload=bytes.fromhex(payload),
                attachment=attached(),
                target=zenoh.QueryTarget.ALL_COMPLETE,
                consolidation=zenoh.ConsolidationMode.NONE,
            )
            answers = [reply.ok.payload.to_bytes().hex() for reply in replies if reply.ok]
            print("answers", *answers, flush=True)
"""


@pytest.fixture(params=VERSIONS)
def interpreter(request: pytest.FixtureRequest) -> str:
    return str(old_zenoh(request.param))


@pytest.fixture
def city(network: Network) -> Network:
    """A network at a loopback port."""
    network.rendezvous = f"tcp/127.0.0.1:{free_port()}"
    return network


def start(city: Network, interpreter: str, mode: str, type_hash: str = "") -> Program:
    """Start the node with the older Zenoh, called ``/old``.

    Args:
        city: Its network.
        interpreter: The interpreter with the older Zenoh.
        mode: Mode of its session.
        type_hash: What stands for the hash of each type.
    """
    string, add = String._type_name, AddTwoInts._type_name
    string_hash, add_hash = type_hash or String._type_hash, type_hash or AddTwoInts._type_hash
    rows = [
        (Kind.NODE, "", "", "", None),
        (Kind.PUBLISHER, "/from_old", string, string_hash, DEFAULT),
        (Kind.SUBSCRIPTION, "/to_old", string, string_hash, DEFAULT),
        (Kind.SERVICE, "/old_add", add, add_hash, SERVICES),
        (Kind.CLIENT, "/add", add, add_hash, SERVICES),
    ]
    tokens = [
        format_token(
            Token(city.domain, "ZID", 0, number, kind, "/", "old", "/", name, type_name, text, qos)
        )
        for number, (kind, name, type_name, text, qos) in enumerate(rows)
    ]
    config = {
        "mode": mode,
        "connect/endpoints": [city.rendezvous],
        "connect/timeout_ms": -1 if mode == "peer" else int(TIMEOUT * 1000),
        "connect/exit_on_failure": mode == "client",
        "connect/retry": {"period_init_ms": 200, "period_max_ms": 200},
        "scouting/multicast/enabled": False,
        "timestamping/enabled": True,
    } | ({"listen/endpoints": ["tcp/127.0.0.1:0"]} if mode == "peer" else {})
    plan = {
        "config": config,
        "tokens": tokens,
        "talk": entity_key(city.domain, "/from_old", string, string_hash),
        "listen": entity_key(city.domain, "/to_old", string, string_hash),
        "serve": entity_key(city.domain, "/old_add", add, add_hash),
        "call": entity_key(city.domain, "/add", add, add_hash),
    }
    program = city.execute(interpreter, "-c", dedent(PARTNER), json.dumps(plan))
    program.wait_for("up")
    return program


def words(message: Message) -> str:
    """Return the bytes of a message in hexadecimal."""
    return message.to_cdr().hex()


def talk(node: Node, old: Program) -> None:
    """See that topics and services work in both directions."""
    heard = node.subscription("/from_old", String)
    publisher = node.publisher("/to_old", String)
    node.service("/add", AddTwoInts, lambda request: request.a + request.b)
    publisher.wait_for_subscribers(timeout=TIMEOUT)
    eventually(lambda: publisher._raw.matched, "a route to the other's subscriber")
    publisher.publish("hello")
    old.wait_for(f"heard {words(String('hello'))}")

    def hears() -> bool:
        old.say(f"publish {words(String('there'))}")
        with suppress(WaitTimeout):
            return heard.get(1.0).data == "there"
        return False

    node.context.graph.wait_for_topic("/from_old", TIMEOUT)
    eventually(hears, "the other's message")
    with node.client("/old_add", AddTwoInts, timeout=TIMEOUT) as client:
        client.wait_for_service(TIMEOUT)
        assert client(20, 22).sum == 42
    answer = f"answers {words(AddTwoInts.Response(5))}"

    def answers() -> bool:
        seen = len(old.lines)
        old.say(f"call {words(AddTwoInts.Request(2, 3))}")
        return old.wait_for("answers", after=seen) == answer

    eventually(answers, "the answer to the other's call")
    assert "/old" in node.context.graph.view().nodes()


@pytest.mark.parametrize("mode", ["peer", "client"])
def test_at_a_core(city: Network, interpreter: str, mode: str) -> None:
    with Router(city.environment()):
        old = start(city, interpreter, mode)
        talk(city.node("new"), old)


def test_before_a_core(city: Network, interpreter: str) -> None:
    """A core that starts after the node, and then nodes that see it through the core only."""
    old = start(city, interpreter, "peer")
    with Router(city.environment()):
        talk(city.node("new", context=city.context(mode="client")), old)


def test_without_a_router(city: Network, interpreter: str) -> None:
    node = city.node("new")
    talk(node, start(city, interpreter, "peer"))


def test_humble(city: Network) -> None:
    """Its types have no hashes."""
    with Router(city.environment()):
        old = start(city, str(old_zenoh()), "peer", "TypeHashNotSupported")
        talk(city.node("new", context=city.context(distro="humble")), old)
