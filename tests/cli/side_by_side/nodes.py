"""The nodes of the scenario: one rospy program, which ROS 1's Python and rosz both run."""

# mypy: disable-error-code="import-not-found"

from __future__ import annotations

import sys

import rospy
from geometry_msgs.msg import PoseStamped
from nav_msgs.srv import GetPlan
from sensor_msgs.msg import JointState
from std_msgs.msg import Int32, String
from std_srvs.srv import Empty, EmptyResponse, SetBool, SetBoolResponse


def talker() -> None:
    """Publish texts, numbers, and what stays."""
    rospy.init_node("talker")
    texts = rospy.Publisher("chatter", String, queue_size=10)
    numbers = rospy.Publisher("counter", Int32, queue_size=10)
    pose = rospy.Publisher("robot/pose", PoseStamped, queue_size=1, latch=True)
    message = PoseStamped()
    message.header.frame_id = "map"
    message.header.stamp = rospy.Time(12, 345)
    message.pose.position.x = 1.5
    message.pose.orientation.w = 1.0
    pose.publish(message)
    joints = rospy.Publisher("robot/joints", JointState, queue_size=1, latch=True)
    joints.publish(JointState(name=["left", "right"], position=[0.25, -0.5], velocity=[1.0]))
    rate = rospy.Rate(50)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    while not rospy.is_shutdown():
        texts.publish("hello")
        numbers.publish(7)
        rate.sleep()


def listener() -> None:
    """Listen, serve, and have parameters."""
    rospy.init_node("listener")
    rospy.set_param("~gain", 2.5)
    rospy.set_param("/robot", {"name": "r2", "wheels": [1, 2], "flags": {"fast": True}})
    rospy.Subscriber("chatter", String, lambda _: None)
    rospy.Subscriber("robot/odd", String, lambda _: None)
    rospy.Service("power", SetBool, lambda request: SetBoolResponse(request.data, "as you wish"))
    rospy.Service("robot/plan", GetPlan, lambda _: None)
    rospy.Service("robot/reset", Empty, lambda _: EmptyResponse())
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    rospy.spin()


if __name__ == "__main__":
    {"talker": talker, "listener": listener}[sys.argv[1]]()
