#!/usr/bin/env python
"""rospy's public names, what they are, and how they are called."""

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


for name in sorted(rospy.__all__):
    print(name, "|", shape(getattr(rospy, name, "absent")))
for kind in (
    rospy.Publisher, rospy.Subscriber, rospy.Service, rospy.ServiceProxy, rospy.Rate, rospy.Timer, rospy.Time,
    rospy.Duration, rospy.SubscribeListener,
):
    members = [name for name in dir(kind) if not name.startswith("_") and callable(getattr(kind, name))]
    print(kind.__name__, "|", shape(kind.__init__), "|", [name for name in members if not hasattr(__import__("threading").Thread, name)])
for error in (
    rospy.ROSException, rospy.ROSSerializationException, rospy.ROSInitException, rospy.ROSInterruptException,
    rospy.ROSInternalException, rospy.TransportException, rospy.TransportTerminated, rospy.TransportInitError,
    rospy.ServiceException, rospy.exceptions.ROSTimeMovedBackwardsException,
):
    print([one.__name__ for one in error.__mro__])
