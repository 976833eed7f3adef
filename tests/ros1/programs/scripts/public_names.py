#!/usr/bin/env python
"""rospy's functions and classes, and how they are called."""

import inspect

import rospy


def shown(parameter):
    if isinstance(parameter.default, (type(None), bool, int, float, str)):
        return "%s=%r" % (parameter.name, parameter.default)
    return str(parameter).partition(":")[0].partition("=")[0] + ("" if parameter.default is parameter.empty else "=...")


def shape(thing):
    if inspect.isclass(thing):
        return "class"
    if inspect.isroutine(thing):
        try:
            parameters = inspect.signature(thing).parameters.values()
        except ValueError:
            return "function"
        return ", ".join(shown(one) for one in parameters)
    return type(thing).__name__


NAMES = """
delete_param get_caller_id get_name get_namespace get_node_uri get_param get_param_cached
get_param_names get_published_topics get_ros_root get_rostime get_time has_param init_node
is_shutdown logdebug logdebug_once logdebug_throttle logerr logerr_once logerr_throttle logfatal
logfatal_once logfatal_throttle loginfo loginfo_once loginfo_throttle logout logwarn logwarn_once
logwarn_throttle myargv on_shutdown parse_rosrpc_uri remap_name resolve_name search_param set_param
signal_shutdown sleep spin wait_for_service
""".split()
for name in NAMES:
    print(name, "|", shape(getattr(rospy, name)), name in rospy.__all__)
for kind in (rospy.Publisher, rospy.Subscriber, rospy.Service, rospy.ServiceProxy, rospy.Rate, rospy.Timer):
    print(kind.__name__, "|", shape(kind.__init__))
for error in (
    rospy.ROSException, rospy.ROSSerializationException, rospy.ROSInitException, rospy.ROSInterruptException,
    rospy.ROSInternalException, rospy.TransportException, rospy.TransportTerminated, rospy.TransportInitError,
    rospy.ServiceException, rospy.exceptions.ROSTimeMovedBackwardsException,
):
    print([one.__name__ for one in error.__mro__])
