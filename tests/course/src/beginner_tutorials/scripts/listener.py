#!/usr/bin/env python
"""Repeats what it hears."""

import rospy
from std_msgs.msg import String

rospy.init_node("listener", anonymous=True)
rospy.Subscriber("chatter", String, lambda heard: rospy.loginfo("I heard %s", heard.data))
rospy.spin()
