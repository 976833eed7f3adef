#!/usr/bin/env python3
import actionlib
import diagnostic_updater
import message_filters
import rospy
from actionlib.msg import TestAction, TestResult
from sensor_msgs.msg import CameraInfo, Image

rospy.init_node("worker")
server = actionlib.SimpleActionServer(
    "work", TestAction, lambda goal: server.set_succeeded(TestResult(0)), auto_start=False)
server.start()
pair = [message_filters.Subscriber("image", Image), message_filters.Subscriber("info", CameraInfo)]
message_filters.TimeSynchronizer(pair, 10).registerCallback(lambda image, info: None)
updater = diagnostic_updater.Updater()
updater.setHardwareID(str(CameraInfo(K=[1.0] * 9).K[0]))
updater.add("state", lambda status: status.summary(0, "fine") or status)
updater.update()
rospy.spin()
