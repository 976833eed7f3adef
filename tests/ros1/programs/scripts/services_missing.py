#!/usr/bin/env python
"""Services that nobody offers."""

import rospy
from std_srvs.srv import Trigger

rospy.init_node("lonely")
for name, timeout in (("nobody", 0.1), ("/a/b", 0.1), ("~mine", rospy.Duration(0.1)), ("nobody", 1e-9)):
    try:
        rospy.wait_for_service(name, timeout)
    except Exception as error:
        print(type(error).__name__, error)
proxy = rospy.ServiceProxy("nobody", Trigger)
for call in (proxy, proxy.call, lambda: proxy.wait_for_service(0.1)):
    try:
        call()
    except Exception as error:
        print(type(error).__name__, error)
try:
    rospy.ServiceProxy("nobody", Trigger, persistent=True)
    print("made")
except Exception as error:
    print(type(error).__name__, error)
