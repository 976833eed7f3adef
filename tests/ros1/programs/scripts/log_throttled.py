#!/usr/bin/env python
"""Throttled log lines, lines said once, and said when they change."""

import rospy

rospy.init_node("quiet", log_level=rospy.DEBUG)
for number in range(3):
    rospy.logdebug_throttle(60, "my throttled debug %d", number)
    rospy.loginfo_throttle(60, "throttled %d" % number)
    rospy.logwarn_throttle(60, "throttled warning %s" % number)
    rospy.logerr_throttle(60, "throttled error %s" % number)
    rospy.logfatal_throttle(60, "throttled fatal %s" % number)
    rospy.loginfo_once("once %d" % number)
    rospy.logdebug_once("my once debug")
    rospy.logwarn_once("once warning %s" % number)
    rospy.logerr_once("once error")
    rospy.logfatal_once("once fatal")
for number in (1, 1, 2, 2, 1):
    rospy.loginfo_throttle_identical(60, "identical %d" % number)
    rospy.logwarn_throttle_identical(60, "identical warning %d" % number)
    rospy.logerr_throttle_identical(60, "identical error")
for number in range(3):
    rospy.loginfo_throttle(0.1, "now and then")
    rospy.sleep(0.3)
for number in range(2):
    rospy.loginfo_throttle(0, "always %d" % number)
