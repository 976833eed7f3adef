#!/usr/bin/env python
"""Private parameters from the command line, and their types."""

import rospy

rospy.init_node("tuned")
for name in sorted(rospy.get_param("~", {})):
    value = rospy.get_param("~" + name)
    print(name, type(value).__name__, repr(value))
