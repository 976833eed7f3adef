#!/usr/bin/env python
"""The clock of a simulation: ticks of 0.1 s from 10 on, until nobody listens."""

import rospy
from rosgraph_msgs.msg import Clock

rospy.init_node("clock", disable_rostime=True)
publisher = rospy.Publisher("/clock", Clock, queue_size=10)
print("ready")
while publisher.get_num_connections() < 1:
    rospy.rostime.wallsleep(0.01)
tick = 100
while publisher.get_num_connections() > 0 and not rospy.is_shutdown():
    publisher.publish(rospy.Time(tick // 10, tick % 10 * 100000000))
    tick += 1
    rospy.rostime.wallsleep(0.01)
print("left")
