#!/usr/bin/env python
"""Rates and sleeps, also odd ones."""

import time

import rospy

rospy.init_node("paced")
start = time.time()
rate = rospy.Rate(20)
print(rate.sleep_dur, rate.remaining().to_sec() <= 0.05)
for _ in range(4):
    rate.sleep()
took = time.time() - start
print("paced" if took >= 0.15 else took)
print(rospy.sleep(0), rospy.sleep(-1), rospy.sleep(rospy.Duration(0.01)), rospy.sleep(rospy.Duration(-5)))
for make in (
    lambda: rospy.Rate(0),
    lambda: rospy.Rate("x"),
    lambda: rospy.Rate(-5).sleep_dur,
    lambda: rospy.Rate(rospy.Duration(1)),
    lambda: rospy.sleep("x"),
    lambda: rospy.sleep(None),
    lambda: rospy.Rate(10, reset=True).sleep_dur,
    lambda: rospy.Rate(0.5).sleep_dur,
):
    try:
        print(make())
    except Exception as error:
        print(type(error).__name__)
before, now, seconds, after = time.time(), rospy.Time.now(), rospy.get_time(), time.time()
print(type(now).__name__, type(rospy.get_rostime()).__name__, before - 1 < now.to_sec() < after + 1)
print(type(seconds).__name__, before - 1 < seconds < after + 1)
print(rospy.rostime.is_wallclock(), rospy.rostime.is_rostime_initialized())
rospy.signal_shutdown("enough")
