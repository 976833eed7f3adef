"""Frames with two parents, as the doctor and ``rosz tf`` show them."""

from __future__ import annotations

import time

import pytest
from network import Network

from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import TransformStamped
from rosz.node import Node, TimerEvent
from rosz.transforms import (
    FrameParents,
    Monitor,
    StaticTransformBroadcaster,
    TransformBroadcaster,
    describe_other_parents,
    tree_as_dot,
    tree_as_text,
)

from .conftest import Doctor


def place(parent: str, child: str) -> TransformStamped:
    """Return the transform of a frame at the origin of its parent."""
    transform = TransformStamped(child_frame_id=child)
    transform.header.frame_id = parent
    transform.transform.rotation.w = 1.0
    return transform


def keep_sending(node: Node, parent: str, child: str) -> None:
    """Publish a moving frame until the node is closed."""
    broadcaster = TransformBroadcaster(node)

    def send(_: TimerEvent) -> None:
        transform = place(parent, child)
        transform.header.stamp = Time.from_nsec(node.now())
        broadcaster.send(transform)

    node.timer(0.05, send)


@pytest.mark.parametrize("moving", [False, True])
def test_a_frame_with_two_parents(doctor: Doctor, network: Network, moving: bool) -> None:
    for name, parent in (("robot", "base"), ("ekf", "odom")):
        node = network.node(name)
        StaticTransformBroadcaster(node).send(place("map", parent))
        if moving:
            keep_sending(node, parent, "laser")
        else:
            StaticTransformBroadcaster(node).send(place(parent, "laser"))
    monitor = Monitor(network.node("watcher"))
    finding = doctor(listen=3.0)["two-parents"]
    assert finding.level == "error"
    assert [line.partition(" (")[0] for line in finding.evidence] == [
        "laser is in base, says /robot",
        "laser is in odom, says /ekf",
    ]
    frames = monitor.frames()
    assert [frame.frame for frame in frames if frame.other_parents] == ["laser"]
    (shown,) = (describe_other_parents(frame) for frame in frames if frame.other_parents)
    assert shown in {
        " (two parents: also in base from /robot)",
        " (two parents: also in odom from /ekf)",
    }
    (line,) = (line for line in tree_as_text(frames) if "laser" in line)
    assert line == f"    laser{shown}"
    assert tree_as_dot(frames, 1.0).count('-> "laser"') == 2


def test_frames_with_one_parent(doctor: Doctor, network: Network) -> None:
    node = network.node("robot")
    broadcaster = StaticTransformBroadcaster(node)
    broadcaster.send(place("base", "laser"))
    broadcaster.send(place("odom", "laser"))  # it moved
    keep_sending(node, "map", "base")
    assert "two-parents" not in doctor(listen=0.5)


def test_what_changes_its_parent_has_one(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0.0
    monkeypatch.setattr(time, "monotonic", lambda: now)
    parents = FrameParents()
    for moment, parent, publisher in (
        (1.0, "table", b"camera"),
        (1.5, "table", b"camera"),
        (1.6, "gripper", b"arm"),
        (2.0, "gripper", b"arm"),
        (9.0, "table", b"camera"),
    ):
        now = moment
        parents.add(place(parent, "cup"), publisher, static=False)
        assert not parents.several()
    now = 9.1
    parents.add(place("gripper", "cup"), b"arm", static=False)
    now = 9.2
    parents.add(place("table", "cup"), b"camera", static=False)
    assert parents.several() == {"cup": {"table": b"camera", "gripper": b"arm"}}
    now = 12.0
    assert not parents.several()
