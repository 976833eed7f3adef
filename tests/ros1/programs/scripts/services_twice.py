#!/usr/bin/env python
"""One name for two services, in one node; services and who they are."""

import rospy
from std_srvs.srv import Empty, Trigger

rospy.init_node("owner")
service = rospy.Service("~ask", Trigger, lambda request: (True, "first"))
print(service.resolved_name)
try:
    rospy.Service("~ask", Trigger, lambda request: (True, "second"))
except Exception as error:
    print(type(error).__name__, error)
try:
    rospy.Service("~ask", Empty, lambda request: [])
except Exception as error:
    print(type(error).__name__, error)
print(rospy.ServiceProxy("~ask", Trigger)().message)
service.shutdown()
rospy.sleep(0.1)
again = rospy.Service("~ask", Trigger, lambda request: (True, "third"))
print(rospy.ServiceProxy("/owner/ask", Trigger)().message)
