#!/usr/bin/env python
"""genpy's and roslib's helpers, as scripts use them."""

import genpy
import genpy.message
import rospy
from geometry_msgs.msg import Twist
from roslib.message import get_message_class, get_service_class
from std_msgs.msg import String

print(get_message_class("std_msgs/String") is String, get_message_class("std_msgs/Nothing"))
print(get_service_class("std_srvs/Trigger").__name__, get_service_class("std_srvs/Nothing"))
twist = Twist()
genpy.message.fill_message_args(twist, [[1.0, 0.0, 0.0], [0.0, 0.0, 0.5]])
print(twist)
genpy.message.fill_message_args(twist, [{"linear": {"y": 2.0}}])
print(genpy.message.strify_message(twist))
for args in ([1], [[1, 2], 3], [{"nothing": 1}]):
    try:
        genpy.message.fill_message_args(Twist(), args)
        print("filled")
    except Exception as error:
        print(isinstance(error, genpy.MessageException))
print(genpy.message.get_printable_message_args(twist))
print(genpy.Time is not None, isinstance(rospy.Time(1), genpy.Time), isinstance(rospy.Duration(1), genpy.Duration))
print(issubclass(String, genpy.Message), genpy.Time(1, 2), genpy.Duration(1, 2))
