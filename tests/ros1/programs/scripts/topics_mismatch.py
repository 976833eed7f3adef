#!/usr/bin/env python
"""Two nodes that disagree about the type of a topic."""

import sys

import rospy
from std_msgs.msg import Int32, String

if "talk" in sys.argv:
    rospy.init_node("talker")
    publisher = rospy.Publisher("chatter", String, queue_size=1, latch=True)
    publisher.publish("a text")
else:
    rospy.init_node("mistaken")
    rospy.Subscriber("chatter", Int32, lambda message: print("heard", message.data))
    print("ready")
rospy.sleep(1.5)
print("end")
