#!/usr/bin/env python
"""A clock that jumps back, as a bag does that starts over."""

import threading

import rospy
from rosgraph_msgs.msg import Clock

rospy.set_param("/use_sim_time", True)
rospy.init_node("jumper")
publisher = rospy.Publisher("/clock", Clock, queue_size=10)
while publisher.get_num_connections() < 1:
    rospy.rostime.wallsleep(0.01)


def set_clock(seconds):
    publisher.publish(rospy.Time(seconds))
    while rospy.get_time() != seconds:
        rospy.rostime.wallsleep(0.01)


def drive():
    rospy.rostime.wallsleep(1)
    set_clock(50)


for make in (lambda: rospy.sleep(10), lambda: rospy.Rate(0.1).sleep(), lambda: rospy.Rate(0.1, reset=True).sleep()):
    set_clock(100)
    thread = threading.Thread(target=drive)
    thread.start()
    try:
        make()
        print("slept", rospy.get_time())
    except rospy.ROSException as error:
        print(type(error).__name__, error, isinstance(error, rospy.ROSInterruptException))
    thread.join()
rospy.set_param("/use_sim_time", False)
