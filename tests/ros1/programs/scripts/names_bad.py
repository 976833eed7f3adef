#!/usr/bin/env python
"""Names that are no names, and what is said about them."""

import rospy
from std_msgs.msg import String


def attempt(what, function, *args, **kwargs):
    try:
        print(what, "->", function(*args, **kwargs) is None)
    except Exception as error:
        print(what, "->", type(error).__name__, error)


attempt("empty node", rospy.init_node, "")
attempt("no node", rospy.init_node, None)
attempt("slash", rospy.init_node, "a/b")
rospy.init_node("names_bad")
for name in ("", None, 5):
    attempt("topic %r" % (name,), rospy.Publisher, name, String, queue_size=1)
    attempt("subscribe %r" % (name,), rospy.Subscriber, name, String)
attempt("no class", rospy.Publisher, "x", None, queue_size=1)
attempt("string class", rospy.Publisher, "x", "std_msgs/String", queue_size=1)
attempt("number class", rospy.Subscriber, "x", 5)
attempt("negative queue", rospy.Publisher, "x", String, queue_size=-1)
attempt("text queue", rospy.Publisher, "x", String, queue_size="x")
attempt("negative queue", rospy.Subscriber, "x", String, queue_size=-1)
attempt("text queue", rospy.Subscriber, "x", String, queue_size="x")
