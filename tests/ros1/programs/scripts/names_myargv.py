#!/usr/bin/env python
"""What is left of the command line when ROS has taken its part."""

import sys

import rospy

print([word.split("/")[-1] for word in rospy.myargv()])
print(rospy.myargv(argv=["prog", "a:=b", "-x", "c", "__name:=d", "_e:=f", "g:=", "i=j"]))
print(rospy.myargv(argv=[]))
print(len(sys.argv))
rospy.init_node("argued")
print(rospy.get_name(), rospy.get_param("~rate", None), len(sys.argv))
