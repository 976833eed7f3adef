#!/usr/bin/env python
"""Two nodes of one name: the older one gives way."""

import sys

import rospy

rospy.init_node("throne")
rospy.on_shutdown(lambda: print("hook"))
if "old" in sys.argv:
    print("ready")
    rospy.spin()
    print("end")
else:
    print("here")
    rospy.sleep(1)
    print(rospy.is_shutdown())
