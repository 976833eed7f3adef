#!/usr/bin/env python
"""The order of an end: hooks, what follows spin, atexit."""

import atexit

import rospy
from std_msgs.msg import String

atexit.register(lambda: print("atexit first", rospy.is_shutdown()))
rospy.on_shutdown(lambda: print("hook before init", rospy.is_shutdown()))
rospy.init_node("ending")
atexit.register(lambda: print("atexit second", rospy.is_shutdown()))
publisher = rospy.Publisher("last_words", String, queue_size=1)


def first():
    print("first", rospy.is_shutdown())
    rospy.loginfo("said by a hook")
    try:
        publisher.publish("still there?")
        print("published")
    except rospy.ROSException as error:
        print(type(error).__name__, error)


def second():
    print("second")
    raise RuntimeError("a hook that fails")


class Third:
    def __call__(self):
        print("third")


rospy.on_shutdown(first)
rospy.on_shutdown(second)
rospy.on_shutdown(Third())
rospy.core.add_preshutdown_hook(lambda reason: print("pre", reason))
try:
    rospy.on_shutdown("not a function")
except Exception as error:
    print(type(error).__name__, error)
rospy.signal_shutdown("that's it")
rospy.signal_shutdown("once more")
print("after", rospy.is_shutdown(), rospy.core.is_shutdown_requested())
rospy.spin()
print("spun")
