"""What each side lists of the other, and the hashes of all types."""

from __future__ import annotations

import subprocess
from contextlib import suppress
from typing import Any

import pytest
from cached import hiroz_peer
from cli.shell import Shell
from network import TIMEOUT, eventually

from rosz.errors import TypeNotFound
from rosz.msgs.action_tutorials_interfaces.action import Fibonacci
from rosz.msgs.example_interfaces.srv import AddTwoInts
from rosz.msgs.std_msgs.msg import String
from rosz.node import Node
from rosz.qos import QoS
from rosz.typestore import TypeStore

from .city import City, Peer

DIFFERENT = {
    "action_msgs::srv::dds_::CancelGoal_",  # hiroz 0.2.1 has a third hash for it, too
    "lifecycle_msgs::msg::dds_::TransitionEvent_",  # it has a Time, where ROS 2 has an uint64
}
"""The types that hiroz has otherwise than ROS 2."""


@pytest.fixture
def ours(city: City) -> Node:
    """A node with one of each."""
    node = city.node("ours", namespace="robot")
    node.publisher("/chatter", String, qos=QoS(depth=3, durability="transient_local"))
    node.subscription("/back", String, lambda _: None, qos=QoS(depth=5, reliability="best_effort"))
    node.service("/add", AddTwoInts, lambda request: request.a + request.b)
    node.action_server("/fibonacci", Fibonacci, lambda goal: goal.succeed())
    return node


@pytest.mark.usefixtures("ours")
def test_what_it_lists(peer: Peer) -> None:
    ends: dict[tuple[str, str], list[Any]] = {}
    services: dict[str, str] = {}

    def seen() -> dict[str, Any]:
        graph: dict[str, Any] = peer.ask("graph", "graph")
        ends.clear()
        ends.update({(end[0], end[1]): end[2:] for end in graph["endpoints"] if end[2] == "ours"})
        rows = graph["snapshot"]["services"]
        services.update({row["name"]: row["type"] for row in rows})
        return graph

    eventually(
        lambda: (
            any(node["name"] == "ours" for node in seen()["snapshot"]["nodes"])
            and {("MP", "/chatter"), ("MS", "/back")} <= {*ends}
            and "/robot/ours/get_parameters" in services
            and seen()["actions"]
        ),
        "all of the node",
    )
    graph = seen()
    assert {"name": "ours", "namespace": "/robot"} in graph["snapshot"]["nodes"]
    assert ends["MP", "/chatter"] == ["ours", String._type_hash, ":1:,3:,:,:,,"]
    assert ends["MS", "/back"] == ["ours", String._type_hash, "2::,5:,:,:,,"]
    assert services["/add"] == "example_interfaces::srv::dds_::AddTwoInts_"
    (action,) = graph["actions"]
    assert action[0] == "/fibonacci"


def test_what_commands_list(city: City, shell: Shell) -> None:
    peer = city.peer("/factory/partner")
    peer.do("publish", "std_msgs/msg/String", "/chatter", "latched3")
    peer.do("listen", "std_msgs/msg/String", "/back", "besteffort")
    peer.do("serve", "/add")
    peer.do("act", "/fibonacci")
    eventually(lambda: "/fibonacci" in shell("action", "list").lines, "its last tokens")
    assert "/factory/partner" in shell("node", "list").lines
    topics = shell("topic", "list").lines
    assert {"/chatter", "/back", "/parameter_events"} <= {*topics}
    assert "/add" in shell("service", "list").lines
    info = shell("ros2", "topic", "info", "-v", "/chatter").out
    for line in (
        "Node name: partner",
        "Node namespace: /factory",
        f"Topic type hash: {String._type_hash}",
        "Durability: TRANSIENT_LOCAL",
        "History (Depth): KEEP_LAST (3)",
    ):
        assert line in info
    assert shell("topic", "type", "/chatter").lines == ["std_msgs/String"]
    assert shell("service", "type", "/add").lines == ["example_interfaces/AddTwoInts"]
    assert "partner" in shell("node", "info", "/factory/partner").out
    assert shell("service", "call", "/add", "20", "22").lines == ["sum: 42"]


def test_doctor(ours: Node, peer: Peer, shell: Shell) -> None:
    """Nothing is wrong where both work together."""
    peer.do("listen", "std_msgs/msg/String", "/chatter", "-")
    peer.do("publish", "std_msgs/msg/String", "/back", "besteffort")
    peer.do("serve", "/sum")
    ours.context.graph.wait_for_topic("/back", TIMEOUT)
    findings = shell("doctor", "--json").json
    # Segments of memory are of the machine, and perhaps of a program that another test killed.
    assert [finding for finding in findings if finding["name"] != "stale-lock"] == []


def test_hashes() -> None:
    """Of all types that hiroz and rosz have in common."""
    command = [str(hiroz_peer()), "hashes"]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    types = TypeStore()
    theirs, ours = {}, {}
    for _, dds, type_hash, _ in map(str.split, lines):
        package, kind, _, name = dds.split("::")
        is_message = kind == "msg" or name.endswith("_FeedbackMessage_")
        find = types.message if is_message else types.service
        with suppress(TypeNotFound):
            ours[dds] = find(f"{package}/{kind}/{name[:-1]}")._type_hash
            theirs[dds] = type_hash
    assert len(lines) - len(ours) < 5
    assert {dds for dds, type_hash in theirs.items() if ours[dds] != type_hash} == DIFFERENT
