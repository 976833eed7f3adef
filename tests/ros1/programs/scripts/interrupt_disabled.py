#!/usr/bin/env python
"""A node that leaves signals to the program."""

import signal
import sys
import time

import rospy

rospy.init_node("stubborn", disable_signals=True)
rospy.on_shutdown(lambda: print("hook"))
print("ready")
try:
    time.sleep(100)
except KeyboardInterrupt:
    print("interrupted", rospy.is_shutdown())
if "shutdown" in sys.argv:
    rospy.signal_shutdown("by hand")
print("end", rospy.is_shutdown(), signal.getsignal(signal.SIGINT) is signal.default_int_handler)
