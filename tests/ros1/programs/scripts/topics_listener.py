#!/usr/bin/env python
"""The listener of every course, which has heard enough after five."""

import rospy
from std_msgs.msg import String

heard = []


def callback(data):
    rospy.loginfo("%s heard %s", rospy.get_caller_id(), data.data)
    heard.append(data.data)
    if len(heard) == 5:
        rospy.signal_shutdown("heard enough")


def listener():
    rospy.init_node("listener")
    rospy.Subscriber("chatter", String, callback)
    print("ready")
    rospy.spin()
    print("spun", len(heard))


if __name__ == "__main__":
    listener()
