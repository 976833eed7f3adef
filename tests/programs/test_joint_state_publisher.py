"""joint_state_publisher, compared with Debian's."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from network import Network
from ros1.programs.runners import Ros

from rosz.programs.joint_state_publisher import DescriptionError, JointStatePublisher

from .sides import RealSide, RoszSide, run_script

ROBOT = """<urdf><robot name="r">
  <joint name="free" type="revolute"><limit lower="-1" upper="2"/></joint>
  <joint name="fixed" type="fixed"/>
  <joint name="above" type="prismatic"><limit lower="1" upper="3"/></joint>
  <joint name="wheel" type="continuous"/>
  <joint name="careful" type="revolute"><limit lower="-2" upper="2"/>
    <safety_controller soft_lower_limit="0.5" soft_upper_limit="1.5"/></joint>
  <joint name="child" type="revolute"><limit lower="-1" upper="1"/>
    <mimic joint="free" multiplier="2" offset="0.25"/></joint>
  <joint name="grandchild" type="revolute"><limit lower="-1" upper="1"/>
    <mimic joint="child" multiplier="-1"/></joint>
  <joint name="led" type="revolute"><limit lower="-1" upper="1"/></joint>
  <joint name="a/b" type="revolute"><limit lower="-1" upper="1"/></joint>
</robot></urdf>"""

USER = """
import rospy
from sensor_msgs.msg import JointState
rospy.init_node("user")
heard = []
rospy.Subscriber("joint_states", JointState, heard.append)
while not heard:
    rospy.sleep(0.05)
def show(state):
    print(list(state.name), [round(x, 6) for x in state.position], list(state.velocity),
          list(state.effort))
show(heard[0])
publisher = rospy.Publisher("arm_states", JointState, queue_size=1)
while heard[-1].position[0] != 0.75:
    publisher.publish(JointState(name=["free", "odd"], position=[0.75, 9], velocity=[0.5, 9]))
    rospy.sleep(0.05)
show(heard[-1])
rospy.signal_shutdown("done")
"""
SET = f"""
import rospy
rospy.set_param("robot_description", {ROBOT!r})
rospy.set_param("source_list", ["arm_states"])
rospy.set_param("rate", 20)
rospy.set_param("zeros", {{"free": 0.5, "a": {{"b": 0.125}}}})
rospy.set_param("publish_default_efforts", True)
rospy.set_param("dependent_joints", {{"led": {{"parent": "wheel", "factor": 3.0, "offset": 1.0}}}})
import os
os._exit(0)
"""
PROGRAM = ("joint_state_publisher", "joint_state_publisher")


def both(side: RealSide | RoszSide, folder: Path) -> list[str]:
    run_script(side, folder, SET)
    return run_script(side, folder, USER, PROGRAM)


def test_it_publishes_what_that_of_ros_1_does(ros: Ros, network: Network, tmp_path: Path) -> None:
    if not Path("/usr/lib/joint_state_publisher").exists():
        pytest.skip("needs that of ROS 1 (Debian: joint-state-publisher)")
    ros.clean()
    keeper = network.node("keeper")
    assert keeper.params.get("/nothing", None) is None  # keeps the parameters alive
    with ThreadPoolExecutor(2) as pool:
        expected = pool.submit(both, RealSide(ros), tmp_path)
        found = pool.submit(both, RoszSide(network), tmp_path)
    assert found.result() == expected.result()


def test_it_moves_joints(network: Network) -> None:
    node = network.node("publisher")
    node.params.set("robot_description", ROBOT)
    publisher = JointStatePublisher(node)
    free, wheel = publisher.joints["free"], publisher.joints["wheel"]
    positions = []
    for _ in range(4):
        free.move(1.5)
        positions.append(free.position)
    assert positions == [1.5, 2.0, 0.5, -1.0]
    wheel.move(4.0)
    assert wheel.position == wheel.least


@pytest.mark.parametrize(
    ("robot", "text"),
    [
        (None, "'robot_description' is not set"),
        ("<robot", "is not XML"),
        ("<sdf/>", "has <sdf>; expected <robot>"),
        (
            '<robot><joint name="a" type="continuous"><mimic joint="b"/></joint>'
            '<joint name="b" type="continuous"><mimic joint="a"/></joint></robot>',
            r"infinite recursive mimic chain: \[a, b, a\]",
        ),
        (
            '<robot><joint name="a" type="continuous"><mimic joint="x"/></joint></robot>',
            "joint 'a' follows 'x', which is not a joint",
        ),
    ],
)
def test_a_robot_that_cannot_be_used(network: Network, robot: str | None, text: str) -> None:
    node = network.node("publisher")
    if robot is not None:
        node.params.set("robot_description", robot)
    with pytest.raises(DescriptionError, match=text):
        JointStatePublisher(node)
