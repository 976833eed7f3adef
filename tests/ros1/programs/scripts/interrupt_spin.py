#!/usr/bin/env python
"""Ctrl-C in spin."""

import rospy
from std_msgs.msg import String

rospy.init_node("spinning")
rospy.Subscriber("chatter", String)
rospy.Timer(rospy.Duration(0.05), lambda event: None)
rospy.on_shutdown(lambda: print("hook", rospy.is_shutdown()))
print("ready")
rospy.spin()
print("spun", rospy.is_shutdown())
