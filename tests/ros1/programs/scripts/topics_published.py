#!/usr/bin/env python
"""The list of what is published."""

import rospy
from std_msgs.msg import Int32, String

NAMES = ("/alpha", "/robot/beta", "/lister/gamma")
rospy.init_node("lister")
publishers = [
    rospy.Publisher("alpha", String, queue_size=1),
    rospy.Publisher("/robot/beta", Int32, queue_size=1),
    rospy.Publisher("~gamma", String, queue_size=1),
]
rospy.Subscriber("only_heard", String)


def listed(*namespace):
    return sorted(pair for pair in rospy.get_published_topics(*namespace) if pair[0] in NAMES)


def until(count):
    deadline = rospy.get_time() + 60
    while len(listed()) != count and rospy.get_time() < deadline:
        rospy.sleep(0.02)


until(3)
print(listed())
print(listed("/robot"), listed("/robot/"), listed("/nowhere"))
publishers[1].unregister()
until(2)
print(listed())
