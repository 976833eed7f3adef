"""Topics in both directions: values, QoS, large messages, logs, types that one side asks for."""

from __future__ import annotations

import json
from array import array
from contextlib import suppress
from typing import Any

import pytest
from network import TIMEOUT, eventually

from rosz.errors import WaitTimeout
from rosz.message import Message, to_plain
from rosz.msgs.builtin_interfaces.msg import Duration, Time
from rosz.msgs.geometry_msgs.msg import (
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Twist,
    Vector3,
)
from rosz.msgs.nav_msgs.msg import Odometry
from rosz.msgs.rcl_interfaces.msg import Log
from rosz.msgs.sensor_msgs.msg import Image, JointState
from rosz.msgs.std_msgs.msg import Header, String
from rosz.msgs.trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from rosz.node import Subscription
from rosz.node.ros2 import request_type
from rosz.qos import ROSOUT, SENSOR_DATA, QoS

from .city import City, Peer

STAMP = Time(sec=1_700_000_000, nanosec=999_999_999)
MESSAGES: list[Message] = [
    String("hello, wörld €"),
    String(""),
    Twist(Vector3(0.5, -0.0, 1e300), Vector3(1e-300, 2.0, -3.0)),
    Image(Header(stamp=STAMP, frame_id="lens"), 2, 3, "rgb8", 0, 9, bytes(range(18))),
    JointState(
        Header(stamp=STAMP), ["a", "", "dëf"], array("d", [1, 2, 3]), array("d"), array("d", [4])
    ),
    Odometry(
        Header(stamp=STAMP, frame_id="odom"),
        "base",
        PoseWithCovariance(
            Pose(Point(1, 2, 3), Quaternion(0, 0, 0, 1)), array("d", map(float, range(36)))
        ),
    ),
    JointTrajectory(
        Header(stamp=STAMP),
        ["shoulder", "elbow"],
        [
            JointTrajectoryPoint(
                positions=array("d", [0.5, 1.5]), time_from_start=Duration(sec=-1, nanosec=7)
            ),
            JointTrajectoryPoint(effort=array("d", [9])),
        ],
    ),
]
LARGE = Image(Header(stamp=STAMP), 500, 700, "rgb8", 0, 2100, bytes(range(250)) * 4200)


def jsonable(message: Message) -> Any:
    """Return the fields of a message as hiroz prints them."""
    return json.loads(json.dumps(to_plain(message), default=list))


def test_values(city: City, peer: Peer) -> None:
    """Sent, read there by name, sent back: each field has its value."""
    node = city.node("rosz_side")
    kinds: dict[type[Message], None] = dict.fromkeys(map(type, MESSAGES))
    for kind in kinds:
        name = kind.__name__.lower()
        peer.do("echo", kind._type_name, f"/{name}", f"/{name}_back")
        back = node.subscription(f"/{name}_back", kind)
        there = node.publisher(f"/{name}", kind)
        there.wait_for_subscribers(timeout=TIMEOUT)
        peer.wait_for_subscription(f"/{name}_back")
        for message in (each for each in MESSAGES if type(each) is kind):
            there.publish(message)
            assert peer.next(f"heard /{name}") == jsonable(message)
            assert back.get(TIMEOUT).to_cdr() == message.to_cdr()


def test_large_and_many(city: City, peer: Peer) -> None:
    """Images of 1 MB, and then numbers in order, there and back."""
    node = city.node("rosz_side")
    peer.do("echo", "sensor_msgs/msg/Image", "/image", "/image_back")
    peer.do("echo", "std_msgs/msg/String", "/number", "/number_back")
    images = node.subscription("image_back", Image)
    numbers = node.subscription("number_back", String, queue_size=0)
    camera = node.publisher("image", Image, queue_size=0)
    counter = node.publisher("number", String, queue_size=0)
    for publisher, back in ((camera, "/image_back"), (counter, "/number_back")):
        publisher.wait_for_subscribers(timeout=TIMEOUT)
        peer.wait_for_subscription(back)
    for _ in range(3):
        camera.publish(LARGE)
        assert images.get(TIMEOUT).data == LARGE.data
    for number in range(500):
        counter.publish(str(number))
    assert [numbers.get(TIMEOUT).data for _ in range(500)] == [*map(str, range(500))]


def text(value: str) -> str:
    """Return a text as hiroz reads it."""
    return json.dumps({"data": value})


def first_live(peer: Peer, subscription: Subscription[String], qos: str = "-") -> str:
    """Let hiroz publish until something comes, and return that."""
    received: list[str] = []

    def comes() -> bool:
        peer.do("publish", "std_msgs/msg/String", subscription.name, qos, text("live"))
        with suppress(WaitTimeout):
            received.append(subscription.get(1.0).data)
        return bool(received)

    eventually(comes, f"a message on '{subscription.name}'")
    return received[0]


@pytest.mark.parametrize("depth", [1, 3])
def test_latched(city: City, peer: Peer, depth: int) -> None:
    """Who comes late gets what is kept, if it asked for that, and nothing else otherwise."""
    qos = QoS(depth=depth, durability="transient_local")
    kept = [str(number) for number in range(depth)]
    node = city.node("rosz_side")
    ours = node.publisher("/ours", String, qos=qos)
    witness = city.node("witness").subscription("/ours", String, qos=qos)
    for value in ["dropped", *kept]:
        ours.publish(value)
        peer.do("publish", "std_msgs/msg/String", "/theirs", f"latched{depth}", text(value))
    eventually(lambda: witness.get(TIMEOUT).data == kept[-1], "the last, beyond the core as well")

    peer.do("listen", "std_msgs/msg/String", "/ours", f"latched{depth}")
    assert [peer.next("heard /ours")["data"] for _ in kept] == kept
    volatile = city.peer("/volatile")
    volatile.do("listen", "std_msgs/msg/String", "/ours", "-")
    ours.wait_for_subscribers(3, TIMEOUT)
    ours.publish("live")
    assert volatile.next("heard /ours")["data"] == "live"

    asked = city.node("late").subscription("/theirs", String, qos=qos)
    assert [asked.get(TIMEOUT).data for _ in kept] == kept
    if depth == 1:
        assert city.node("as_in_ros1").subscription("/theirs", String).get(TIMEOUT).data == "0"
    unasked = city.node("volatile").subscription("/theirs", String, qos=QoS(depth=depth))
    assert first_live(peer, unasked) == "live"


def test_best_effort(city: City, peer: Peer) -> None:
    node = city.node("rosz_side")
    publisher = node.publisher("/ours", String, qos=SENSOR_DATA)
    peer.do("listen", "std_msgs/msg/String", "/ours", "besteffort")
    publisher.wait_for_subscribers(timeout=TIMEOUT)
    publisher.publish("hello")
    assert peer.next("heard /ours") == {"data": "hello"}
    subscription = node.subscription("/theirs", String, qos=SENSOR_DATA)
    assert first_live(peer, subscription, "besteffort") == "live"
    view = node.context.graph.view()
    assert {view.subscriptions("/ours")[0].qos} == {view.publishers("/theirs")[0].qos}


def test_logs(city: City, peer: Peer) -> None:
    """/rosout of both, which is kept for those who come late."""
    node = city.node("rosz_side")
    node.log.warning("bumper pressed")
    peer.do("listen", "rcl_interfaces/msg/Log", "/rosout", "latched1000")
    line = peer.next("heard /rosout")
    assert (line["name"], line["level"], line["msg"]) == ("rosz_side", 30, "bumper pressed")
    theirs = {"level": 40, "name": "partner", "msg": "battery low", "file": "", "function": ""}
    stamp = {"sec": 1, "nanosec": 2}
    row = json.dumps(theirs | {"line": 7, "stamp": stamp})
    peer.do("publish", "rcl_interfaces/msg/Log", "/rosout", "latched1000", row)
    logs = node.subscription("/rosout", Log, qos=ROSOUT)
    assert {logs.get(TIMEOUT).msg for _ in range(2)} == {"bumper pressed", "battery low"}


def test_types_asked_of_the_other(city: City, peer: Peer) -> None:
    """Each gets a definition from the other's node, and reads messages by it."""
    node = city.node("rosz_side")
    node.publisher("/ours", JointTrajectory, latch=True).publish(MESSAGES[-1])
    peer.wait_for_service("/rosz_side/get_type_description")  # it comes after the publisher
    peer.do("discover", "/ours")
    schema = peer.next("discovered /ours")
    assert "trajectory_msgs/msg/JointTrajectory" in schema
    assert "time_from_start" in schema
    battery = {"stamp": {"sec": 1, "nanosec": 2}, "cells": [0.5, 1.5], "limits": [0, 9.5]}
    row = json.dumps(battery | {"name": "main"})
    peer.do("publish", "peer_msgs/msg/Battery", "/battery", "latched1", row)
    publishers = node.context.graph.wait_for_topic("/battery", TIMEOUT).publishers("/battery")
    cls = request_type(node, publishers[0], TIMEOUT)
    assert cls._type_hash == publishers[0].type_hash
    received = node.subscription("/battery", cls, qos=QoS(1, durability="transient_local"))
    assert jsonable(received.get(TIMEOUT)) == json.loads(row)
