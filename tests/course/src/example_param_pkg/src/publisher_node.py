#!/usr/bin/env python
"""Publishes ~message_text on chatter, ~publish_rate times a second."""

import rospy
from std_msgs.msg import String


def publish():
    rospy.init_node("param_publisher_node")
    publisher = rospy.Publisher("chatter", String, queue_size=10)
    hertz = rospy.get_param("~publish_rate", 1.0)
    text = rospy.get_param("~message_text", "Hello Default")
    rate = rospy.Rate(hertz)
    rospy.loginfo(f"[Publisher] Publishing at {hertz} Hz: '{text}'")
    while not rospy.is_shutdown():
        publisher.publish(text)
        rate.sleep()


if __name__ == "__main__":
    try:
        publish()
    except rospy.ROSInterruptException:
        pass
