#! /usr/bin/env python
"""Calls for help twice a second; the node's name is not the file's."""

import rospy
from std_msgs.msg import String

rospy.init_node("sos_2")
rate = rospy.Rate(2)
call = String("help me Obi-Wan Kenobi, you're my only hope")
publisher = rospy.Publisher("/help_msg", String, queue_size=1)
while not rospy.is_shutdown():
    publisher.publish(call)
    rate.sleep()
