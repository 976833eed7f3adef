#!/usr/bin/env python
"""Ctrl-C in a loop with a rate, caught or not."""

import sys

import rospy

rospy.init_node("looping")
rospy.on_shutdown(lambda: print("hook"))
rate = rospy.Rate(1)
print("ready")
if "caught" in sys.argv:
    try:
        while not rospy.is_shutdown():
            rate.sleep()
    except rospy.ROSInterruptException as error:
        print(type(error).__name__, error)
else:
    while not rospy.is_shutdown():
        rate.sleep()
print("end", rospy.is_shutdown())
