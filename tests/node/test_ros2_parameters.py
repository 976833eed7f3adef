"""Nodes read and write the parameters of nodes of ROS 2 by their names, as those of the store."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

import pytest
from interop.plain import plain_session
from interop.ros2_node import Ros2Node, ros2_node
from network import Network, eventually

from rosz.errors import ParamError, ParamNotFound, ServiceError
from rosz.node import Node
from rosz.wire import Kind, Token, format_token


@pytest.fixture
def node(network: Network) -> Node:
    return network.node("node")


@pytest.fixture
def talker(network: Network, node: Node) -> Iterator[Ros2Node]:
    node.params["/talker/rate"] = 99
    with ros2_node(network.rendezvous, network.domain, "talker", rate=1.5, gains__p=1) as talker:
        eventually(lambda: node.params["/talker/rate"] == 1.5, "the node is there")
        talker.calls.clear()
        yield talker


def test_read(node: Node, talker: Ros2Node) -> None:
    assert talker.calls == []
    assert node.params["/talker/rate"] == 1.5
    assert node.params.get("/talker/rate", type=float) == 1.5
    assert node.params.get("talker/gains") == {"p": 1}
    assert node.params["/talker"] == {"rate": 1.5, "gains": {"p": 1}}
    assert "/talker/gains/p" in node.params
    assert "/talker/none" not in node.params
    assert node.params.get("/talker/none", 7) == 7
    with pytest.raises(ParamNotFound):
        node.params["/talker/none"]


def test_write(node: Node, talker: Ros2Node) -> None:
    node.params["/talker/rate"] = 2
    assert talker.get("rate") == 2.0
    talker.calls.clear()
    node.params.update({"/talker/rate": 3, "/talker/gains/p": 4, "~own": 5})
    assert talker.calls.count("set_parameters_atomically") == 1
    assert (talker.get("rate"), talker.get("gains.p"), node.params["~own"]) == (3.0, 4, 5)
    with pytest.raises(ParamError, match="node '/talker' refuses to set '/talker/none'"):
        node.params["/talker/none"] = 1
    with pytest.raises(ParamError, match=r"is of type \{double\}"):
        del node.params["/talker/rate"]


def test_others_stay_in_the_store(node: Node, talker: Ros2Node) -> None:
    node.params["/talker2/rate"] = 3
    node.params["~rate"] = 4
    assert (node.params["/talker2/rate"], node.params["~rate"]) == (3, 4)
    assert talker.calls == []


def rate(node: Node) -> object:
    """Return what is read while the node of ROS 2 ends."""
    with suppress(ServiceError):
        return node.params["/late/rate"]
    return None


def test_a_name_is_the_stores_until_the_node_is_there(network: Network, node: Node) -> None:
    node.params["/late/rate"] = 1
    for _ in range(2):  # the second time, the name has been looked up
        assert node.params["/late/rate"] == 1
    with ros2_node(network.rendezvous, network.domain, "late", rate=2.5):
        eventually(lambda: node.params["/late/rate"] == 2.5, "the node's own value")
    eventually(lambda: rate(node) == 1, "the store's value")


def test_a_node_of_rosz_reads_at_once_after_its_start(network: Network, talker: Ros2Node) -> None:
    assert network.node("new").params["/talker/rate"] == 1.5
    assert talker.calls == ["list_parameters", "get_parameters"]


def test_a_node_without_these_services(network: Network, node: Node) -> None:
    with plain_session(network.rendezvous) as plain:
        zid = str(plain.session.zid())
        plain.token(format_token(Token(network.domain, zid, 0, 0, Kind.NODE, "/", "bare")))
        with pytest.raises(ServiceError, match="node '/bare' does not serve parameters"):
            eventually(lambda: "/bare/x" in node.params, "never")
