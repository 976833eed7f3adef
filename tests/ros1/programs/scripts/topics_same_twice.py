#!/usr/bin/env python
"""Publishers and subscribers of one topic in one node: same type, other type."""

import rospy
from std_msgs.msg import Int32, String

rospy.init_node("twice")
one = rospy.Publisher("news", String, queue_size=1)
two = rospy.Publisher("news", String, queue_size=5)
print(one.name, one.resolved_name, one.type, one.md5sum, one.data_class.__name__)
print(one.get_num_connections(), two.get_num_connections(), one.reg_type)
for kind in (rospy.Publisher, rospy.Subscriber):
    try:
        kind("news", Int32, queue_size=1)
        print("fine")
    except Exception as error:
        print(type(error).__name__, error)
