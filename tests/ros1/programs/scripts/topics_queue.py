#!/usr/bin/env python
"""What a slow callback still gets to see, by the size of its queue."""

import threading

import rospy
from std_msgs.msg import Int32

rospy.init_node("slow")


go = threading.Event()


def begin(size):
    started, seen = threading.Event(), []

    def callback(message):
        seen.append(message.data)
        if message.data == 0:
            started.set()
            go.wait(60)

    topic = "numbers_%s" % size
    rospy.Subscriber(topic, Int32, callback, queue_size=size)
    publisher = rospy.Publisher(topic, Int32, queue_size=100)
    while publisher.get_num_connections() < 1:
        rospy.sleep(0.01)
    publisher.publish(0)
    started.wait(60)
    for number in range(1, 11):
        publisher.publish(number)
    return size, seen


begun = [begin(size) for size in (1, 2, 5, 100, None)]
rospy.sleep(1)
go.set()
deadline = rospy.get_time() + 60
for size, seen in begun:
    while seen[-1] != 10 and rospy.get_time() < deadline:
        rospy.sleep(0.01)
    print(size, seen)
