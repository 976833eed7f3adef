#!/usr/bin/env python
"""Callbacks of one topic wait for each other; those of two topics do not."""

import threading

import rospy
from std_msgs.msg import Empty

rospy.init_node("threads")
meeting = threading.Barrier(2)
lock = threading.Lock()
lines = []


def callback(message, name):
    lines.append("met" if meeting.wait(60) in (0, 1) else "never")
    with lock:
        if len(lines) == 4:
            rospy.signal_shutdown("met twice")


publishers = []
for name in ("left", "right"):
    rospy.Subscriber(name, Empty, callback, name)
    publishers.append(rospy.Publisher(name, Empty, queue_size=5))
while not all(publisher.get_num_connections() for publisher in publishers):
    rospy.sleep(0.01)
for publisher in publishers * 2:
    publisher.publish()
rospy.spin()
print(lines)
