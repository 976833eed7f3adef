#!/usr/bin/env python
"""Callbacks with arguments, methods, several on one topic."""

import threading

import rospy
from std_msgs.msg import Int32

done = threading.Event()
lines = []


class Counter:
    def __init__(self):
        self.total = 0

    def add(self, message):
        self.total += message.data
        lines.append("total %d" % self.total)

    def add_weighted(self, message, weight):
        self.total += message.data * weight
        lines.append("weighted %d" % self.total)


def named(message, args):
    lines.append("named %d %s" % (message.data, args))
    if message.data == 3:
        done.set()


rospy.init_node("several")
counter = Counter()
one = rospy.Subscriber("numbers", Int32, counter.add)
two = rospy.Subscriber("numbers", Int32, counter.add_weighted, 10)
three = rospy.Subscriber("numbers", Int32, named, callback_args=("x", {"y": 1}))
silent = rospy.Subscriber("numbers", Int32)
publisher = rospy.Publisher("numbers", Int32, queue_size=10)
while publisher.get_num_connections() < 1:
    rospy.sleep(0.01)
for number in (1, 2, 3):
    publisher.publish(number)
done.wait(60)
print("\n".join(lines))
