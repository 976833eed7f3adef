#!/usr/bin/env python
"""What still works when all is over."""

import rospy
from std_msgs.msg import String
from std_srvs.srv import Trigger

rospy.init_node("over")
publisher = rospy.Publisher("news", String, queue_size=1)
proxy = rospy.ServiceProxy("ask", Trigger)
rate = rospy.Rate(100)
rospy.set_param("~value", 5)
rospy.signal_shutdown("over")


def attempt(what, function, *args):
    try:
        print(what, "->", function(*args))
    except Exception as error:
        print(what, "->", type(error).__name__, error)


attempt("publish", publisher.publish, "x")
attempt("sleep", rospy.sleep, 0.01)
attempt("rate", rate.sleep)
attempt("wait for message", rospy.wait_for_message, "news", String, 1)
attempt("wait for service", rospy.wait_for_service, "ask", 1)
attempt("call", proxy)
attempt("spin", rospy.spin)
attempt("name", rospy.get_name)
attempt("time", lambda: rospy.get_time() > 0)
rospy.loginfo("info")
rospy.logwarn("warning")
