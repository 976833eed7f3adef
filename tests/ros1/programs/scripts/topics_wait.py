#!/usr/bin/env python
"""wait_for_message, with and without luck."""

import rospy
from std_msgs.msg import Int32, String

rospy.init_node("waiter")
for timeout in (0.1, 1e-9):
    try:
        rospy.wait_for_message("silence", String, timeout)
    except rospy.ROSException as error:
        print(type(error).__name__, error)
publisher = rospy.Publisher("sevens", Int32, queue_size=1)
timer = rospy.Timer(rospy.Duration(0.02), lambda event: publisher.publish(7))
print(rospy.wait_for_message("sevens", Int32).data)
print(rospy.wait_for_message("/sevens", Int32, 60))
print(rospy.wait_for_message("sevens", Int32, rospy.Duration(60).to_sec()).data)
timer.shutdown()
