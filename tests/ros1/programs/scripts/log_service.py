#!/usr/bin/env python
"""The level of a logger, changed by service while the node runs."""

import rospy
from roscpp.srv import GetLoggers, SetLoggerLevel

rospy.init_node("adjustable")
rospy.logdebug("unheard")
set_level = rospy.ServiceProxy("~set_logger_level", SetLoggerLevel)
set_level.wait_for_service(10)
print(repr(str(set_level("rosout", "DEBUG"))))
rospy.logdebug("my word")
set_level("rosout", "warn")
rospy.loginfo("unheard")
rospy.logwarn("heard")
set_level("rosout", "info")
rospy.loginfo("heard")
loggers = {one.name: one.level for one in rospy.ServiceProxy("~get_loggers", GetLoggers)().loggers}
print(loggers["rosout"], "rosout" in loggers)
