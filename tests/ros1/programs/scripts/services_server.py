#!/usr/bin/env python
"""A server in a process of its own."""

import rospy
from std_srvs.srv import SetBool, Trigger

rospy.init_node("server")


def divide(request):
    rospy.loginfo("asked by %s", request._connection_header["callerid"])
    return True, str(1 / int(request.data))


def leave(request):
    rospy.Timer(rospy.Duration(0.3), lambda event: rospy.signal_shutdown("asked to"), oneshot=True)
    return True, "leaving"


rospy.Service("divide", SetBool, divide)
rospy.Service("leave", Trigger, leave)
print("ready")
rospy.spin()
