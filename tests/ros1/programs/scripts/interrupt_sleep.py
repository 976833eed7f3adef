#!/usr/bin/env python
"""Ctrl-C in sleep: rospy's, and Python's own."""

import sys
import time

import rospy

rospy.init_node("sleeping")
sleep = rospy.sleep if "rospy" in sys.argv else time.sleep
print("ready")
try:
    while not rospy.is_shutdown():
        sleep(0.5)
    print("slept")
except rospy.ROSInterruptException as error:
    print(type(error).__name__, error)
except KeyboardInterrupt:
    print("KeyboardInterrupt")
print("end", rospy.is_shutdown())
