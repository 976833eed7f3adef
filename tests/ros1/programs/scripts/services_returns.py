#!/usr/bin/env python
"""All that a handler may return, and what the caller gets."""

import rospy
from std_srvs.srv import Empty, EmptyResponse, Trigger, TriggerResponse

rospy.init_node("server")


def attempt(what, kind, handler):
    name = "ask_" + what.replace(" ", "_")
    service = rospy.Service(name, kind, handler)
    rospy.wait_for_service(name, 60)
    try:
        print(what, "->", str(rospy.ServiceProxy(name, kind)()).replace("\n", ", "))
    except Exception as error:
        print(what, "->", type(error).__name__, error)
    service.shutdown("next")


class Odd(Exception):
    pass


def fail(request):
    raise Odd("that was odd")


def give_up(request):
    raise rospy.ServiceException("no more")


attempt("response", Trigger, lambda request: TriggerResponse(True, "yes"))
attempt("keywords", Trigger, lambda request: TriggerResponse(message="yes"))
attempt("tuple", Trigger, lambda request: (True, "yes"))
attempt("list", Trigger, lambda request: [False, "no"])
attempt("dict", Trigger, lambda request: {"message": "only"})
attempt("whole dict", Trigger, lambda request: {"success": True, "message": "whole"})
attempt("empty dict", Trigger, lambda request: {})
attempt("single", Trigger, lambda request: "alone")
attempt("none", Trigger, lambda request: None)
attempt("none for empty", Empty, lambda request: None)
attempt("list for empty", Empty, lambda request: [])
attempt("response for empty", Empty, lambda request: EmptyResponse())
attempt("value for empty", Empty, lambda request: 5)
attempt("too many", Trigger, lambda request: (True, "a", "b"))
attempt("too few", Trigger, lambda request: (True,))
attempt("unknown key", Trigger, lambda request: {"nothing": 1})
attempt("fails", Trigger, fail)
attempt("gives up", Trigger, give_up)
attempt("no arguments", Trigger, lambda: None)
