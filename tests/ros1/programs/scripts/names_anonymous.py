#!/usr/bin/env python
"""An anonymous node: its name, twice."""

import rospy

rospy.init_node("walker", anonymous=True)
name = rospy.get_name()
base, pid, millis = name.split("_")
print(base, pid.isdigit(), millis.isdigit(), len(millis))
print(rospy.resolve_name("~x") == name + "/x")
