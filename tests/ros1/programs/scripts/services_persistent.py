#!/usr/bin/env python
"""A persistent proxy: headers go along, calls in a row, close."""

import rospy
from std_srvs.srv import Trigger

rospy.init_node("regular")
headers = []


def handle(request):
    headers.append(request._connection_header["callerid"])
    return True, "call %d" % len(headers)


service = rospy.Service("bar", Trigger, handle)
proxy = rospy.ServiceProxy("bar", Trigger, persistent=True, headers={"cookies": "oatmeal"})
for _ in range(3):
    print(proxy().message)
plain = rospy.ServiceProxy("bar", Trigger)
print(plain().message)
print(headers)
proxy.close()
service.shutdown("closing time")
while True:
    try:
        rospy.wait_for_service("bar", 1)
    except rospy.ROSException:
        break
    rospy.sleep(0.05)
try:
    print(plain().message)
except rospy.ServiceException as error:
    print(type(error).__name__, error)
