#!/usr/bin/env python
"""A timer whose callback fails."""

import rospy

rospy.init_node("broken_clock")


def tick(event):
    raise RuntimeError("the spring broke")


timer = rospy.Timer(rospy.Duration(0.02), tick)
timer.join(60)
print(timer.is_alive())
