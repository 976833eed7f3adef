#!/usr/bin/env python
"""What goes wrong with parameters, and in which words."""

import rospy

rospy.init_node("careless")


def attempt(what, function, *args):
    try:
        print(what, "->", repr(function(*args)))
    except Exception as error:
        print(what, "->", type(error).__name__, error, error.args)


attempt("get", rospy.get_param, "missing")
attempt("get private", rospy.get_param, "~missing")
attempt("get deep", rospy.get_param, "/a/b/c")
attempt("get default", rospy.get_param, "missing", 5)
attempt("get none", rospy.get_param, "missing", None)
attempt("delete", rospy.delete_param, "missing")
attempt("delete private", rospy.delete_param, "~missing")
attempt("delete deep", rospy.delete_param, "/a/b/c")
attempt("has", rospy.has_param, "missing")
attempt("search", rospy.search_param, "missing")
attempt("get number", rospy.get_param, 5)
