#!/usr/bin/env python
"""Ctrl-C while a service of the node itself takes its time."""

import rospy
from std_srvs.srv import Trigger

rospy.init_node("slow_server")


def handle(request):
    print("ready")
    while not rospy.is_shutdown():
        rospy.rostime.wallsleep(0.01)
    rospy.rostime.wallsleep(1)
    return True, "slept"


rospy.Service("slow", Trigger, handle)
try:
    print(rospy.ServiceProxy("slow", Trigger)())
except rospy.ServiceException as error:
    print(type(error).__name__, error)
print("end", rospy.is_shutdown())
