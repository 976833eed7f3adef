#!/usr/bin/env python
"""search_param climbs from the node to the root."""

import rospy

rospy.init_node("climber")
print(rospy.get_name())
rospy.set_param("/gain", 1)
print(rospy.search_param("gain"), rospy.search_param("/gain"), rospy.search_param("nowhere"))
rospy.set_param("/a/gain", 2)
print(rospy.search_param("gain"), rospy.get_param(rospy.search_param("gain")))
rospy.set_param("~gain", 3)
print(rospy.search_param("gain"))
rospy.set_param("/a/b/tree/leaf", 4)
print(rospy.search_param("tree/leaf"), rospy.search_param("tree/none"), rospy.search_param("tree"))
print(rospy.search_param("climber/gain"))
print(rospy.get_param("gain", "relative"), rospy.get_param("~gain"))
