"""robot_state_publisher: the frames that follow from a description and from joint states."""

from __future__ import annotations

import math
from typing import Any

import pytest
from network import Network, eventually

from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.sensor_msgs.msg import JointState
from rosz.msgs.std_msgs.msg import Header
from rosz.programs.joint_state_publisher import DescriptionError
from rosz.programs.robot_state_publisher import read_links
from rosz.transforms import Monitor, to_rpy

ROBOT = """<robot name="r">
  <link name="base"/><link name="arm"/><link name="hand"/><link name="finger"/><link name="lidar"/>
  <link name="free"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/>
    <origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/><axis xyz="0 0 2"/></joint>
  <joint name="wrist" type="continuous"><parent link="arm"/><child link="hand"/>
    <origin xyz="2 0 0"/><axis xyz="0 0 1"/>
    <mimic joint="shoulder" multiplier="-1" offset="0.25"/></joint>
  <joint name="grip" type="prismatic"><parent link="hand"/><child link="finger"/>
    <axis xyz="0 1 0"/></joint>
  <joint name="mount" type="fixed"><parent link="base"/><child link="lidar"/>
    <origin xyz="0 0 3"/></joint>
  <joint name="float" type="floating"><parent link="base"/><child link="free"/></joint>
</robot>"""
START = ("-P", "-m", "rosz", "run", "robot_state_publisher", "robot_state_publisher")


def test_links_of_a_description() -> None:
    links = {link.child: link for link in read_links(ROBOT)}
    assert set(links) == {"arm", "hand", "finger", "lidar"}
    assert links["arm"].axis == (0.0, 0.0, 1.0)
    assert to_rpy(links["arm"].pose(0.5).rotation)[2] == pytest.approx(math.pi / 2 + 0.5)
    assert links["finger"].pose(0.1).translation == pytest.approx((0.0, 0.1, 0.0))
    assert not links["lidar"].moves


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<robot", "is not XML"),
        ("<sdf/>", "expected <robot>"),
        (
            '<robot><link name="a"/><joint name="j" type="fixed"><parent link="a"/>'
            '<child link="b"/></joint></robot>',
            "joint 'j': its child 'b' is not a link",
        ),
        (
            '<robot><link name="a"/><link name="b"/><joint name="j" type="fixed">'
            '<parent link="a"/><child link="b"/><origin xyz="1 2"/></joint></robot>',
            "joint 'j': .*expected three numbers",
        ),
    ],
)
def test_descriptions_that_cannot_be_used(text: str, message: str) -> None:
    with pytest.raises(DescriptionError, match=message):
        read_links(text)


def test_frames_of_a_robot(network: Network) -> None:
    node = network.node("driver")
    node.params["/robot_description"] = ROBOT
    node.params["/tf_prefix"] = "r1"
    program = network.run(*START)
    monitor = Monitor(network.node("watcher"))
    states = node.publisher("joint_states", JointState, queue_size=1)
    why_not = monitor.buffer.why_not

    def known() -> Any:
        """Publish until the frames are there: the first states come before the subscription."""
        header = Header(stamp=Time.from_nsec(node.now()))
        names, positions = ["shoulder", "grip"], [0.5, 0.125]
        states.publish(JointState(header=header, name=names, position=positions))
        return not why_not("r1/base", "r1/finger") and not why_not("r1/base", "r1/lidar")

    eventually(known, "the frames")
    pose, _ = monitor.buffer.lookup("r1/base", "r1/hand")
    angle = math.pi / 2 + 0.5
    assert pose.translation == pytest.approx((1 + 2 * math.cos(angle), 2 * math.sin(angle), 0.0))
    assert to_rpy(pose.rotation)[2] == pytest.approx(angle - 0.5 + 0.25)
    assert monitor.buffer.lookup("r1/hand", "r1/finger")[0].translation == pytest.approx(
        (0.0, 0.125, 0.0)
    )
    assert monitor.buffer.lookup("r1/base", "r1/lidar")[0].translation == (0.0, 0.0, 3.0)
    assert {one.frame for one in monitor.frames() if one.static} == {"r1/lidar"}
    assert program.process.poll() is None


def test_a_robot_without_a_description(network: Network) -> None:
    program = network.run(*START)
    assert program.exit_code() == 1
    assert "parameter 'robot_description' is not set" in program.output
