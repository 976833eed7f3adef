#!/usr/bin/env python
"""Tells about every person on custom_chatter."""

import rospy
from quadrotor_receive.msg import Person


def tell(person):
    rospy.loginfo("%s is age: %d", person.name, person.age)


if __name__ == "__main__":
    rospy.init_node("custom_listener", anonymous=True)
    rospy.Subscriber("custom_chatter", Person, tell)
    rospy.spin()
