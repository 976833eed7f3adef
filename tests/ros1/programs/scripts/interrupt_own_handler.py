#!/usr/bin/env python
"""A signal handler of the program, set before or after init_node."""

import signal
import sys

import rospy


def handler(number, frame):
    print("own handler", number, rospy.is_shutdown())
    if "after" in sys.argv:
        rospy.Timer(rospy.Duration(0.2), lambda event: rospy.signal_shutdown("timer"), oneshot=True)


if "before" in sys.argv:
    signal.signal(signal.SIGINT, handler)
rospy.init_node("handling")
rospy.on_shutdown(lambda: print("hook"))
if "after" in sys.argv:
    signal.signal(signal.SIGINT, handler)
print("ready")
rospy.spin()
print("end")
