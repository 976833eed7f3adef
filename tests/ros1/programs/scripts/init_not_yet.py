#!/usr/bin/env python
"""Everything that a script may try before init_node."""

import rospy
from std_msgs.msg import String
from std_srvs.srv import Trigger


def attempt(what, function, *args, **kwargs):
    try:
        result = function(*args, **kwargs)
        print(what, "->", result if isinstance(result, (bool, str, int, list)) else type(result).__name__)
    except Exception as error:
        print(what, "->", type(error).__name__, error)


publisher = rospy.Publisher("early", String, queue_size=1)
attempt("publish", publisher.publish, "x")
attempt("subscribe", rospy.Subscriber, "early", String, lambda message: None)
attempt("now", rospy.Time.now)
attempt("get_rostime", rospy.get_rostime)
attempt("get_time", rospy.get_time)
attempt("sleep", rospy.sleep, 0.01)
attempt("spin", rospy.spin)
attempt("name", rospy.get_name)
attempt("namespace", rospy.get_namespace)
attempt("resolve", rospy.resolve_name, "x")
attempt("is_shutdown", rospy.is_shutdown)
attempt("set_param", rospy.set_param, "early_value", 1)
attempt("get_param", rospy.get_param, "early_value")
attempt("private", rospy.get_param, "~private", 5)
attempt("service", rospy.wait_for_service, "nobody", 0.05)
attempt("proxy", rospy.ServiceProxy, "nobody", Trigger)
attempt("message", rospy.wait_for_message, "early", String, 0.05)
attempt("rate", rospy.Rate, 10)
rospy.loginfo("said too early")
rospy.logwarn("said too early, too")
rospy.init_node("late")
attempt("publish", publisher.publish, "x")
attempt("private", rospy.get_param, "~private", 5)
rospy.loginfo("said in time")
