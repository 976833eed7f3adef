"""Programs of Debian's ROS 1 that pass on what a node of rosz publishes, with rosz as the master.

What the node hears of them is what a node of rospy hears of them beside a roscore.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from network import TIMEOUT, eventually

from .world import World

pytestmark = [pytest.mark.ros1, pytest.mark.system]

_LONG = 4 * TIMEOUT
_PROGRAMS = (
    ("image_transport/republish", "raw", "in:=/image", "raw", "out:=/image_again"),
    ("joint_state_publisher/joint_state_publisher",),
    ("robot_state_publisher/robot_state_publisher",),
    ("diagnostic_aggregator/aggregator_node", "__name:=analyzers"),
    ("topic_tools/relay", "/one", "/relayed"),
    ("topic_tools/throttle", "messages", "/one", "5", "/throttled"),
    ("topic_tools/drop", "/one", "1", "2", "/dropped"),
    ("topic_tools/transform", "/one", "/length", "std_msgs/Int32", "len(m.data)"),
    ("topic_tools/mux", "/selected", "/one", "/two"),
)
_PACKAGES = (
    "image-transport-tools, ros-robot-state-publisher, libdiagnostic-aggregator-tools, topic-tools,"
    " python3-topic-tools, joint-state-publisher"
)
_HEARD = """\
/diagnostics_agg [('/Motors', 1, 'Warning'), ('/Motors/motor left', 1, 'warm')]
/dropped one
/image_again 64 48 rgb8 1175040
/joint_states ['elbow'] (0.0,)
/length 3
/relayed one
/selected one
/selected two
/tf base arm 1.0
/tf_static arm tip 2.0
/throttled one
"""
"""What rospy hears beside a roscore."""

_PEER = '''
import rosz.ros1
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import Int32, String
from tf2_msgs.msg import TFMessage
from topic_tools.srv import MuxSelect

ROBOT = """<robot name="r"><link name="base"/><link name="arm"/><link name="tip"/>
<joint name="elbow" type="revolute"><parent link="base"/><child link="arm"/>
<origin xyz="0 0 1"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="fixed" type="fixed"><parent link="arm"/><child link="tip"/>
<origin xyz="0 0 2"/></joint></robot>"""
MOTORS = {"type": "diagnostic_aggregator/GenericAnalyzer", "path": "Motors", "contains": ["motor"]}
rospy.init_node("peer")
rospy.set_param("/robot_description", ROBOT)
rospy.set_param("/analyzers/analyzers/motors", MOTORS)
heard = set()

def hear(topic, kind, describe):
    def tell(message):
        text = describe(message)
        if text and (topic, text) not in heard:
            heard.add((topic, text))
            print(topic, text)
    rospy.Subscriber(topic, kind, tell)

def of_image(m):
    return f"{m.width} {m.height} {m.encoding} {sum(bytearray(m.data))}"

def of_status(m):
    return str(sorted((s.name, s.level, s.message) for s in m.status)) if len(m.status) > 1 else ""

def of_transform(m):
    one = m.transforms[0]
    return f"{one.header.frame_id} {one.child_frame_id} {one.transform.translation.z}"

hear("/image_again", Image, of_image)
hear("/diagnostics_agg", DiagnosticArray, of_status)
hear("/joint_states", JointState, lambda m: f"{list(m.name)} {tuple(m.position)}")
hear("/length", Int32, lambda m: m.data)
for name in ("/tf", "/tf_static"):
    hear(name, TFMessage, of_transform)
for name in ("/relayed", "/throttled", "/dropped", "/selected"):
    hear(name, String, lambda m: m.data)
image, status, one, two = (
    rospy.Publisher(name, kind, queue_size=1)
    for name, kind in (
        ("/image", Image), ("/diagnostics", DiagnosticArray), ("/one", String), ("/two", String)
    )
)
print("ready")
picture = Image(height=48, width=64, encoding="rgb8", step=192)
picture.data = bytes(i % 256 for i in range(48 * 192))
warm = DiagnosticStatus(level=1, name="motor left", message="warm")
select = rospy.ServiceProxy("/mux/select", MuxSelect)
rate, selected = rospy.Rate(20), False
while not rospy.is_shutdown():
    now = picture.header.stamp = rospy.Time.now()
    image.publish(picture)
    warned = DiagnosticArray(status=[warm])
    warned.header.stamp = now
    status.publish(warned)
    one.publish("one")
    two.publish("two")
    if ("/selected", "one") in heard and not selected:
        selected = True
        select.wait_for_service()
        assert select("/two").prev_topic == "/one"
    rate.sleep()
'''


def test_programs_of_debian_pass_messages_on() -> None:
    paths = [Path("/usr/lib") / program for program, *_ in _PROGRAMS]
    if not all(path.exists() for path in paths):
        pytest.skip(f"needs programs of ROS 1 (Debian: {_PACKAGES})")
    world = World()
    try:
        peer = world.network.program(_PEER)
        peer.wait_for("ready")
        for path, (_, *words) in zip(paths, _PROGRAMS, strict=True):
            world.start(str(path), *words)
        expected = _HEARD.splitlines()
        eventually(lambda: set(expected) <= set(peer.lines), "what they pass on", _LONG)
        assert sorted(line for line in peer.lines if line.startswith("/")) == expected
    finally:
        world.close()
