#!/usr/bin/env python
"""A node that ends with a code, a text, or a failure."""

import sys

import rospy

rospy.init_node("exiting")
rospy.on_shutdown(lambda: print("hook"))
how = rospy.myargv()[1]
if how == "code":
    sys.exit(3)
if how == "text":
    sys.exit("a text for an exit")
if how == "failure":
    {}["key"]
if how == "interrupted":
    raise rospy.ROSInterruptException("unheard")
print("falls off the end")
