#!/usr/bin/env python
"""get_param_cached follows what others set."""

import rospy

rospy.init_node("cacher")
rospy.set_param("~limit", 1)
print(rospy.get_param_cached("~limit"))
rospy.set_param("~limit", 2)
deadline = rospy.get_time() + 60
while rospy.get_param_cached("~limit") != 2 and rospy.get_time() < deadline:
    rospy.sleep(0.01)
print(rospy.get_param_cached("~limit"))
print(rospy.get_param_cached("~other", "default"))
try:
    rospy.get_param_cached("~other")
except KeyError as error:
    print("KeyError", error)
