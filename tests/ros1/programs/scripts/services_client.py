#!/usr/bin/env python
"""A client of a server that sometimes fails and then leaves."""

import rospy
from std_srvs.srv import SetBool, Trigger

rospy.init_node("client")
rospy.wait_for_service("divide")
divide = rospy.ServiceProxy("divide", SetBool)
print(divide(True).message)
try:
    divide(False)
except rospy.ServiceException as error:
    print("failed:", error)
print(divide(True).message)
print(rospy.ServiceProxy("leave", Trigger)().message)
while True:
    try:
        rospy.wait_for_service("divide", 2)
    except rospy.ROSException as error:
        print(type(error).__name__, error)
        break
    rospy.sleep(0.05)
try:
    divide(True)
except rospy.ServiceException as error:
    print(type(error).__name__, error)
