"""The events of services that nodes of rclpy publish, and what reads them."""

from __future__ import annotations

from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network

from rosz.errors import ServiceError
from rosz.msgs.service_msgs.msg import ServiceEventInfo
from rosz.msgs.std_srvs.srv import SetBool
from rosz.node import Node
from rosz.node.ros2 import event_class
from rosz.ros2.rclpy.entities import ServiceIntrospectionState
from rosz.ros2.rclpy.executors import Future
from rosz.ros2.rclpy.qos import QoSProfile

from .conftest import World

OFF, METADATA, CONTENTS = ServiceIntrospectionState
TOPIC = "/flip/_service_event"


@pytest.fixture
def watcher(network: Network) -> Node:
    return network.node("watcher")


@pytest.fixture
def events(watcher: Node) -> SimpleQueue[Any]:
    """What is published about the service, received with the type that its publishers tell."""
    seen: SimpleQueue[Any] = SimpleQueue()
    watcher.subscription(TOPIC, event_class(watcher.context.types, "std_srvs/SetBool"), seen.put)
    return seen


def flip(request: Any, response: Any) -> Any:
    response.message = f"got {request.data}"
    return response


def call(world: World, client: Any, value: bool = True) -> Future:
    future = client.call_async(SetBool.Request(value))
    world.spin_until(future.done, "the response")
    return future  # type: ignore[no-any-return]


def wait_for_publishers(node: Node, count: int) -> None:
    graph = node.context.graph
    graph.wait_for(lambda view: len(view.publishers(TOPIC)) == count, TIMEOUT, "publishers")


def test_both_ends(world: World, watcher: Node, events: SimpleQueue[Any]) -> None:
    server = world.node.create_service(SetBool, "flip", flip)
    client = world.node.create_client(SetBool, "flip")
    clock = world.node.get_clock()
    client.configure_introspection(clock, QoSProfile(depth=10), CONTENTS)
    server.configure_introspection(clock, 10, CONTENTS)
    wait_for_publishers(watcher, 2)
    call(world, client)
    got = {event.info.event_type: event for event in (events.get(timeout=TIMEOUT) for _ in "four")}
    assert sorted(got) == [0, 1, 2, 3]
    assert len({bytes(event.info.client_gid) for event in got.values()}) == 1
    assert bytes(got[0].info.client_gid) == client._client.gid
    assert len({event.info.sequence_number for event in got.values()}) == 1
    for kind in (ServiceEventInfo.REQUEST_SENT, ServiceEventInfo.REQUEST_RECEIVED):
        assert [request.data for request in got[kind].request] == [True]
        assert got[kind].response == []
    for kind in (ServiceEventInfo.RESPONSE_SENT, ServiceEventInfo.RESPONSE_RECEIVED):
        assert [response.message for response in got[kind].response] == ["got True"]
        assert got[kind].request == []
    assert got[3].info.stamp >= got[0].info.stamp
    number = got[0].info.sequence_number
    client.configure_introspection(clock, 10, OFF)
    server.configure_introspection(clock, 10, METADATA)
    wait_for_publishers(watcher, 1)
    call(world, client)
    for kind in (ServiceEventInfo.REQUEST_RECEIVED, ServiceEventInfo.RESPONSE_SENT):
        event = events.get(timeout=TIMEOUT)
        assert (event.info.event_type, event.request, event.response) == (kind, [], [])
        assert event.info.sequence_number > number
    server.configure_introspection(clock, 10, OFF)
    wait_for_publishers(watcher, 0)
    call(world, client)
    assert events.empty()


def test_a_refused_call_has_no_response(
    world: World, watcher: Node, events: SimpleQueue[Any]
) -> None:
    def fail(_request: Any, _response: Any) -> Any:
        raise ServiceError("no")

    server = world.node.create_service(SetBool, "flip", fail)
    server.configure_introspection(world.node.get_clock(), 10, METADATA)
    wait_for_publishers(watcher, 1)
    client = world.node.create_client(SetBool, "flip")
    client.wait_for_service(TIMEOUT)
    future = client.call_async(SetBool.Request(True))
    with pytest.raises(ServiceError, match="no"):
        world.spin_until(future.done, "the response")
    assert events.get(timeout=TIMEOUT).info.event_type == ServiceEventInfo.REQUEST_RECEIVED
    server.destroy()
    wait_for_publishers(watcher, 0)
    assert events.empty()
