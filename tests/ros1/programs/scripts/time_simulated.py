#!/usr/bin/env python
"""A node in simulated time, ten times as fast as the real one."""

import rospy

rospy.set_param("/use_sim_time", True)
rospy.init_node("simulated")
print(rospy.rostime.is_wallclock(), rospy.get_param("/use_sim_time"))
while rospy.get_time() == 0:
    rospy.rostime.wallsleep(0.001)
start = rospy.Time.now()
print("started", start.to_sec() >= 10, start.to_sec() < 1000)
rospy.sleep(20)
passed = (rospy.Time.now() - start).to_sec()
print("slept", 20 <= passed < 200)  # a sleep in real time would take 200
rate = rospy.Rate(2)
for _ in range(3):
    rate.sleep()
ticks = []
timer = rospy.Timer(rospy.Duration(1), lambda event: ticks.append(event.current_real.to_sec()))
while len(ticks) < 3:
    rospy.rostime.wallsleep(0.01)
timer.shutdown()
print("ticked", [later > sooner for sooner, later in zip(ticks, ticks[1:3])])
rospy.signal_shutdown("simulated enough")
