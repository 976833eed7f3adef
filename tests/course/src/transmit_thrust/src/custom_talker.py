#!/usr/bin/env python
"""Says ten times a second how old somebody is; without a queue size, as scripts of old do."""

import rospy
from quadrotor_receive.msg import Person


def talk():
    publisher = rospy.Publisher("custom_chatter", Person)
    rospy.init_node("custom_talker", anonymous=True)
    rate = rospy.Rate(10)
    person = Person(name="ROS User", age=4)
    while not rospy.is_shutdown():
        rospy.loginfo(person)
        publisher.publish(person)
        rate.sleep()


if __name__ == "__main__":
    try:
        talk()
    except rospy.ROSInterruptException:
        pass
