#!/usr/bin/env python
"""A callback that fails: the node goes on, and tells where."""

import rospy
from std_msgs.msg import Int32

count = []


def divide(message):
    count.append(message.data)
    if len(count) == 2:
        rospy.signal_shutdown("two")
    return 10 / message.data


moved = []


class Robot:
    def move(self, message, speed):
        moved.append(message.data)
        raise ValueError("cannot move at %s" % speed)


rospy.init_node("clumsy")
rospy.Subscriber("numbers", Int32, divide)
publisher = rospy.Publisher("numbers", Int32, queue_size=5)
other = rospy.Publisher("speeds", Int32, queue_size=5)
rospy.Subscriber("speeds", Int32, Robot().move, callback_args=7)
while publisher.get_num_connections() < 1 or other.get_num_connections() < 1:
    rospy.sleep(0.01)
other.publish(1)
while not moved:
    rospy.sleep(0.01)
rospy.sleep(0.5)  # the error is logged after the callback
publisher.publish(0)
while not count:
    rospy.sleep(0.01)
rospy.sleep(0.5)
publisher.publish(5)
rospy.spin()
print("end", count)
