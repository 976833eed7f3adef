#!/usr/bin/env python
"""init_node called again, in the same and in other words."""

import rospy


def attempt(*args, **kwargs):
    try:
        rospy.init_node(*args, **kwargs)
        print(args, kwargs, "fine", rospy.get_name())
    except Exception as error:
        print(args, kwargs, type(error).__name__, error)


print(rospy.core.is_initialized(), rospy.is_shutdown(), rospy.get_name())
attempt("first")
print(rospy.core.is_initialized(), rospy.is_shutdown())
attempt("first")
attempt("second")
attempt("first", log_level=rospy.DEBUG)
attempt("first", anonymous=True)
