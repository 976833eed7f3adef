#!/usr/bin/env python
"""All ways to call a service, right and wrong."""

import rospy
from std_srvs.srv import Empty, EmptyRequest, SetBool, SetBoolRequest, SetBoolResponse

rospy.init_node("caller")


def handle(request):
    return SetBoolResponse(request.data, "%s from %s" % (request.data, request._connection_header["callerid"]))


rospy.Service("switch", SetBool, handle)
rospy.Service("nothing", Empty, lambda request: [])
switch = rospy.ServiceProxy("switch", SetBool)
nothing = rospy.ServiceProxy("nothing", Empty)
switch.wait_for_service()
nothing.wait_for_service(timeout=60)


def attempt(what, function, *args, **kwargs):
    try:
        print(what, "->", repr(str(function(*args, **kwargs))))
    except Exception as error:
        print(what, "->", type(error).__name__, error)


attempt("positional", switch, True)
attempt("keyword", switch, data=True)
attempt("request", switch, SetBoolRequest(True))
attempt("call", switch.call, SetBoolRequest(data=False))
attempt("call keyword", switch.call, data=True)
attempt("nothing given", switch)
attempt("nothing needed", nothing)
attempt("empty request", nothing, EmptyRequest())
attempt("two", switch, True, False)
attempt("unknown", switch, flag=True)
attempt("other request", switch, EmptyRequest())
attempt("none", switch, None)
attempt("one too many", nothing, 1)
print(switch.resolved_name, switch.service_class.__name__, switch.request_class.__name__, switch.response_class.__name__)
