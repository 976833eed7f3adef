#!/usr/bin/env python
"""AnyMsg: a subscriber of whatever comes."""

import rospy
from geometry_msgs.msg import Point
from roslib.message import get_message_class

rospy.init_node("any")


def callback(message):
    header = message._connection_header
    print(type(message).__name__, header["type"], header["md5sum"], header["topic"], header["callerid"])
    print(message._type, message._md5sum, message._has_header)
    kind = get_message_class(header["type"])
    print(kind().deserialize(message._buff))
    rospy.signal_shutdown("seen")


rospy.Subscriber("anything", rospy.AnyMsg, callback)
publisher = rospy.Publisher("anything", Point, queue_size=1)
while publisher.get_num_connections() < 1:
    rospy.sleep(0.01)
publisher.publish(1, 2, 3)
rospy.spin()
try:
    rospy.Publisher("anything_else", rospy.AnyMsg, queue_size=1).publish()
except Exception as error:
    print(type(error).__name__, error)
