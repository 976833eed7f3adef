#!/usr/bin/env python
"""Ctrl-C while waiting for a message or a service."""

import sys

import rospy
from std_msgs.msg import String

rospy.init_node("waiting")
print("ready")
try:
    if "message" in sys.argv:
        rospy.wait_for_message("silence", String)
    elif "message_timeout" in sys.argv:
        rospy.wait_for_message("silence", String, timeout=100)
    elif "service_timeout" in sys.argv:
        rospy.wait_for_service("nobody", timeout=100)
    else:
        rospy.wait_for_service("nobody")
    print("came")
except rospy.ROSException as error:
    print(type(error).__name__, error)
print("end")
