#!/usr/bin/env python
"""Log lines of all levels, formats and loggers."""

import sys

import rospy

level = {"-d": rospy.DEBUG, "-i": rospy.INFO, "-w": rospy.WARN, "-e": rospy.ERROR, "-f": rospy.FATAL}
chosen = [level[word] for word in sys.argv if word in level]
rospy.init_node("logger", log_level=chosen[0] if chosen else rospy.INFO)
rospy.logdebug("my debug")
rospy.loginfo("info")
rospy.logwarn("warning")
rospy.logerr("error")
rospy.logfatal("fatal")
rospy.logout("out")
rospy.loginfo("one %s, two %d, %.2f", "x", 5, 1.5)
rospy.loginfo("100%")
rospy.loginfo(5)
rospy.loginfo(["a", 1])
rospy.loginfo(None)
rospy.loginfo("two\nlines")
rospy.loginfo("gr\u00fc\u00dfe")
rospy.loginfo("named", logger_name="navigation")
rospy.logwarn("named warning", logger_name="navigation.local")
rospy.loginfo("%(key)s", {"key": "from a dict"})
print(rospy.DEBUG, rospy.INFO, rospy.WARN, rospy.ERROR, rospy.FATAL)
