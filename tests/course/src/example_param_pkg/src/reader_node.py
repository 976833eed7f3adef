#!/usr/bin/env python
"""Reads parameters in every way: global, private, with a default, only if they are there."""

import rospy

rospy.init_node("publisher_node")
rospy.loginfo(f"Global publish rate: {rospy.get_param('/publish_rate')}")
rospy.loginfo(f"Private publish rate: {rospy.get_param('~publish_rate')}")
rospy.loginfo(f"Parameter with default: {rospy.get_param('~non_existent_param', 5.0)}")
if rospy.has_param("/some_global_param"):
    rospy.loginfo(f"Global param exists: {rospy.get_param('/some_global_param')}")
else:
    rospy.logwarn("Global param does not exist.")
if rospy.has_param("~some_private_param"):
    rospy.loginfo(f"Private param exists: {rospy.get_param('~some_private_param')}")
else:
    rospy.logwarn("Private param does not exist.")
