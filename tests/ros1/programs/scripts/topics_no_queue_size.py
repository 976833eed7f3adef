#!/usr/bin/env python
"""A publisher without a queue size: a warning, and synchronous publishing."""

import rospy
from std_msgs.msg import String

rospy.init_node("careless")
publisher = rospy.Publisher("news", String)
rospy.Subscriber("news", String, lambda message: rospy.signal_shutdown("heard " + message.data))
while publisher.get_num_connections() < 1:
    rospy.sleep(0.01)
publisher.publish("now")
rospy.spin()
print("end")
