#!/usr/bin/env python
"""Simulated time without a clock: time stands at zero, and log lines say so."""

import rospy

rospy.set_param("use_sim_time", True)
rospy.init_node("still")
print(rospy.Time.now(), rospy.get_time(), rospy.rostime.is_wallclock())
rospy.loginfo("standing still")
rospy.logwarn("still standing")
print(rospy.Time.now().is_zero())
rospy.set_param("use_sim_time", False)
