#!/usr/bin/env python
# -*- coding: utf-8 -*-
from __future__ import division, print_function, unicode_literals, absolute_import

import roslib
roslib.load_manifest("std_msgs")
import rospy
import std_msgs.msg
from std_msgs.msg import *


class Node(object):
    def __init__(self):
        super(Node, self).__init__()
        self.pub = rospy.Publisher(u"out", String, queue_size=10)
        self.sub = rospy.Subscriber("out", std_msgs.msg.String, self.heard)

    def heard(self, msg):
        rospy.loginfo("I heard %s" % msg.data)
        rospy.signal_shutdown("")

    def run(self):
        while self.pub.get_num_connections() == 0 and not rospy.is_shutdown():
            rospy.sleep(0.01)
        self.pub.publish(String(u"ol\u00e9"))
        rospy.spin()


if __name__ == "__main__":
    rospy.init_node("habits")
    print("3 / 2 =", 3 / 2)
    Node().run()
