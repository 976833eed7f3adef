#!/usr/bin/env python
"""Log calls with the wrong arguments."""

import rospy

rospy.init_node("odd_logger")
for args in (("%d", "x"), ("%s %s", 1), ("no place", 1)):
    try:
        rospy.loginfo(*args)
        print("fine")
    except Exception as error:
        print(type(error).__name__, error)
try:
    rospy.loginfo()
except TypeError:
    print("TypeError")
try:
    1 / 0
except ZeroDivisionError:
    rospy.logerr("with a trace", exc_info=True)
