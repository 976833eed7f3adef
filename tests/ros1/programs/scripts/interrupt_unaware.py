#!/usr/bin/env python
"""Ctrl-C in code that knows nothing of it: only the shutdown hook tells it to end."""

import sys
import time

import rospy

rospy.init_node("unaware")
stopped = []


def stop():
    print("stopping", rospy.is_shutdown())
    rospy.sleep(0.3)
    print("stopped", rospy.is_shutdown())
    stopped.append(True)


rospy.on_shutdown(stop)
if "server" in sys.argv:
    import actionlib
    from tf2_msgs.msg import LookupTransformAction

    client = actionlib.SimpleActionClient("nobody", LookupTransformAction)
    print("ready")
    print(client.wait_for_server())
else:
    print("ready")
    try:
        while not stopped:
            time.sleep(0.01) if "sleep" in sys.argv else [number**2 for number in range(100)]
    except BaseException as error:
        print(type(error).__name__)
        raise
print("end", stopped)
