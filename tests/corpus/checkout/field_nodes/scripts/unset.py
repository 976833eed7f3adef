#!/usr/bin/env python3
import rospy

rospy.init_node("unset")
print(rospy.get_param("~rate"))
