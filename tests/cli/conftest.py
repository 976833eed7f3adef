"""What tests of commands share."""

from __future__ import annotations

import pytest
from network import Network

from rosz.msgs.geometry_msgs.msg import Point, Pose, PoseStamped, Twist
from rosz.msgs.std_msgs.msg import Header, String
from rosz.node import Node

from .shell import Shell, latch


@pytest.fixture
def shell(
    network: Network, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Shell:
    """A shell on a network of its own."""
    return Shell(network, monkeypatch, capsys)


@pytest.fixture
def talker(network: Network) -> Node:
    """A node that has published a pose and a text, and listens to /cmd_vel."""
    node = network.node("talker")
    node.subscription("/cmd_vel", Twist, lambda _: None)
    pose = Pose(position=Point(1.5, -2.0, 0.25))
    latch(node, "/robot/pose", PoseStamped(header=Header(frame_id="map"), pose=pose))
    latch(node, "/robot/text", String("hello"))
    return node
