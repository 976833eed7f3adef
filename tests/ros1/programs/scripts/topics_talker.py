#!/usr/bin/env python
"""The talker of every course, with an end."""

import rospy
from std_msgs.msg import String


def talker():
    rospy.init_node("talker", anonymous=False)
    publisher = rospy.Publisher("chatter", String, queue_size=10)
    while publisher.get_num_connections() < 1 and not rospy.is_shutdown():
        rospy.sleep(0.01)
    rate = rospy.Rate(50)
    for count in range(5):
        text = "hello world %d" % count
        rospy.loginfo(text)
        publisher.publish(text)
        rate.sleep()
    while publisher.get_num_connections() > 0:
        rospy.sleep(0.01)


if __name__ == "__main__":
    try:
        talker()
    except rospy.ROSInterruptException:
        pass
