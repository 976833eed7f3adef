#!/usr/bin/env python
"""What comes over /rosout of one's own log lines."""

import threading

import rospy
from rosgraph_msgs.msg import Log

seen, done = [], threading.Event()


def callback(message):
    if message.name == rospy.get_name():
        seen.append(message)
        if message.msg == "last":
            done.set()


def speak():
    rospy.logwarn("a warning of %d", 5)


rospy.init_node("narrator")
publisher_seen = rospy.Subscriber("/rosout", Log, callback)
while publisher_seen.get_num_connections() < 1:
    rospy.sleep(0.01)
rospy.sleep(1)
rospy.logdebug("unheard")
rospy.loginfo("first")
speak()
rospy.logwarn("of a part", logger_name="part.wheel")
rospy.logfatal("last")
done.wait(60)
for message in seen:
    print(message.level, message.name, message.msg, message.file.split("/")[-1], message.function, message.line)
print(Log.DEBUG, Log.INFO, Log.WARN, Log.ERROR, Log.FATAL)
print(seen[0].header.stamp.secs > 0)
