"""Several contexts in one process: of one domain they are neighbours, of two they are strangers."""

from __future__ import annotations

import pytest
from network import TIMEOUT, Network

from rosz.errors import ServiceNotFound
from rosz.msgs.example_interfaces.srv import AddTwoInts
from rosz.msgs.std_msgs.msg import String
from rosz.node import Node


def in_domain(network: Network, name: str, domain: int) -> Node:
    return network.node(name, context=network.context(domain=domain))


def test_two_domains_at_one_meeting_point(network: Network) -> None:
    """Neither topics nor services, parameters nor names cross over."""
    one, two = in_domain(network, "same", 1), in_domain(network, "same", 2)
    got_one, got_two = (node.subscription("chatter", String) for node in (one, two))
    one.service("add", AddTwoInts, lambda request: request.a + request.b)
    for node, text in ((one, "one"), (two, "two")):
        publisher = node.publisher("chatter", String)
        publisher.wait_for_subscribers(timeout=TIMEOUT)
        assert len(publisher.subscribers()) == 1
        publisher.publish(text)
    assert got_one.get(TIMEOUT).data == "one"
    assert got_two.get(TIMEOUT).data == "two"
    one.params["/shared"] = 1
    assert "/shared" not in two.params
    with pytest.raises(ServiceNotFound):
        two.client("add", AddTwoInts)(1, 2)
    assert one.client("add", AddTwoInts)(1, 2).sum == 3
    assert not one.is_shutdown
    assert not two.is_shutdown


def test_contexts_end_apart(network: Network) -> None:
    one, two = network.node("one"), network.node("two")
    subscription = two.subscription("chatter", String)
    one.context.close()
    assert one.is_shutdown
    assert not two.is_shutdown
    publisher = two.publisher("chatter", String)
    publisher.publish("still here")
    assert subscription.get(TIMEOUT).data == "still here"
    two.context.graph.wait_for(lambda view: view.nodes() == ["/two"], TIMEOUT, "the other's end")
