#!/usr/bin/env python
"""Log calls with the wrong arguments."""

import rospy

rospy.init_node("odd_logger")
try:
    rospy.loginfo()
except TypeError:
    print("TypeError")
try:
    1 / 0
except ZeroDivisionError:
    rospy.logerr("with a trace", exc_info=True)
