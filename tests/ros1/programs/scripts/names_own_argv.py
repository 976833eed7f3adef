#!/usr/bin/env python
"""A node that gives init_node a command line of its own."""

import rospy

rospy.init_node("given", argv=["chatter:=/news", "_rate:=5", "__name:=ignored"])
print(rospy.get_name(), rospy.resolve_name("chatter"), rospy.get_param("~rate", None))
