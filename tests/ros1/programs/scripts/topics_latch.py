#!/usr/bin/env python
"""Latched topics: the newest message greets whoever comes later."""

import rospy
from std_msgs.msg import String

rospy.init_node("latched")
latched = rospy.Publisher("map", String, latch=True, queue_size=1)
plain = rospy.Publisher("scan", String, queue_size=1)
for text in ("first", "second", "third"):
    latched.publish(text)
    plain.publish(text)
print(rospy.wait_for_message("map", String, 60).data)
print(rospy.wait_for_message("map", String, 60).data)
try:
    rospy.wait_for_message("scan", String, timeout=0.3)
except rospy.ROSException as error:
    print(type(error).__name__, error)


def heard(message):
    print("heard", message.data, message._connection_header["latching"])
    rospy.signal_shutdown("done")


rospy.Subscriber("map", String, heard)
rospy.spin()
