#!/usr/bin/env python
"""Greets the world ten times a second, with the time."""

import rospy
from std_msgs.msg import String


def talk():
    publisher = rospy.Publisher("chatter", String, queue_size=10)
    rospy.init_node("talker", anonymous=True)
    rate = rospy.Rate(10)
    while not rospy.is_shutdown():
        greeting = "hello world %s" % rospy.get_time()
        rospy.loginfo(greeting)
        publisher.publish(greeting)
        rate.sleep()


if __name__ == "__main__":
    try:
        talk()
    except rospy.ROSInterruptException:
        pass
