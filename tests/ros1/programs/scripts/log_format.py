#!/usr/bin/env python
"""Log lines in a form of the user's own (ROSCONSOLE_FORMAT)."""

import rospy


def speak():
    rospy.loginfo("from a function")


class Robot:
    def move(self):
        rospy.logwarn("from a method")


rospy.init_node("formed")
speak()
Robot().move()
rospy.logerr("from the module")
rospy.logfatal("named", logger_name="arm")
