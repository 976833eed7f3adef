#!/usr/bin/env python
"""A service with a handler of its own for what goes wrong."""

import rospy
from std_srvs.srv import Trigger

rospy.init_node("handled")
kinds = []


def on_error(error, kind, value, trace):
    kinds.append((type(error) is kind, isinstance(error, Exception), str(value), trace is not None))


def fail(request):
    raise ValueError("so it goes")


rospy.Service("fail", Trigger, fail, error_handler=on_error)
try:
    rospy.ServiceProxy("fail", Trigger)()
except rospy.ServiceException as error:
    print(error)
rospy.Service("wrong", Trigger, lambda request: ("x", 5), error_handler=on_error)
try:
    rospy.ServiceProxy("wrong", Trigger)()
except rospy.ServiceException as error:
    print(error)
print(kinds)
