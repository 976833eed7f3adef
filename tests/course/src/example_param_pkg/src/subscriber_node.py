#!/usr/bin/env python
"""Says what it receives on chatter."""

import rospy
from std_msgs.msg import String


def received(message):
    rospy.loginfo(f"[Subscriber] Received: {message.data}")


if __name__ == "__main__":
    rospy.init_node("param_subscriber_node")
    rospy.Subscriber("chatter", String, received)
    rospy.spin()
