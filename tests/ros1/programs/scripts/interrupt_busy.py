#!/usr/bin/env python
"""Ctrl-C in a loop of pure Python, which asks whether it may go on."""

import rospy

rospy.init_node("busy")
count = 0
while not rospy.is_shutdown():
    count += 1
    if count == 1:
        print("ready")
print("counted", count > 0)
