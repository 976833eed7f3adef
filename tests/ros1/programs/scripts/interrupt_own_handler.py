#!/usr/bin/env python
"""A signal handler of the program, set before or after init_node."""

import signal
import sys

import rospy


def handler(number, frame):
    print("own handler", number, rospy.is_shutdown())


if "before" in sys.argv:
    signal.signal(signal.SIGINT, handler)
rospy.init_node("handling")
rospy.on_shutdown(lambda: print("hook"))
if "after" in sys.argv:
    signal.signal(signal.SIGINT, handler)
    rospy.Timer(rospy.Duration(1), lambda event: rospy.signal_shutdown("timer"), oneshot=True)
print("ready")
rospy.spin()
print("end")
