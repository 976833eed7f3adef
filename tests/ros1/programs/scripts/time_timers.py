#!/usr/bin/env python
"""Timers: events, one shot, reset, stop."""

import threading

import rospy

rospy.init_node("ticker")
lock = threading.Lock()
events, once = [], []


def tick(event):
    events.append(event)
    if len(events) == 4:
        timer.shutdown()
        single.join(60)
        rospy.signal_shutdown("four ticks")


def only(event):
    once.append(event)


single = rospy.Timer(rospy.Duration(0.01), only, oneshot=True)
timer = rospy.Timer(rospy.Duration(0.05), tick)
print(timer.is_alive(), timer.daemon, isinstance(timer, threading.Thread))
rospy.spin()
first, second = events[0], events[1]
print(first.last_expected, first.last_real, first.last_duration)
print(type(first.current_expected).__name__, type(first.current_real).__name__)
print((second.current_expected - second.last_expected).to_sec(), second.last_expected == first.current_expected)
print(second.last_real == first.current_real, type(second.last_duration).__name__, second.last_duration >= 0)
print(len(once), once[0].last_real, len(events))
