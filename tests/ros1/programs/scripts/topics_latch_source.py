#!/usr/bin/env python
"""One of several nodes that latch a message on the same topic."""

import rospy
from std_msgs.msg import String

rospy.init_node("source")
publisher = rospy.Publisher("map", String, latch=True, queue_size=1)
publisher.publish("old of %s" % rospy.get_name())
publisher.publish("new of %s" % rospy.get_name())
print("published")
while publisher.get_num_connections() == 0:
    rospy.sleep(0.01)
while publisher.get_num_connections() > 0:
    rospy.sleep(0.01)
