#!/usr/bin/env python
"""Remappings from the command line, and what becomes of topics, services and parameters."""

import rospy
from rospy.names import get_mappings, get_resolved_mappings
from std_msgs.msg import String
from std_srvs.srv import Trigger

rospy.init_node("mapper", argv=None)
print(sorted(pair for pair in get_mappings().items() if not pair[0].startswith("__")))
print(sorted(pair for pair in get_resolved_mappings().items() if not pair[0].startswith("__")))
publisher = rospy.Publisher("chatter", String, queue_size=1)
print(publisher.name, publisher.resolved_name)
private = rospy.Publisher("~out", String, queue_size=1)
print(private.name, private.resolved_name)
subscriber = rospy.Subscriber("deep/chatter", String)
print(subscriber.name, subscriber.resolved_name)
service = rospy.Service("ask", Trigger, lambda request: (True, "asked"))
print(service.resolved_name)
print(rospy.ServiceProxy("ask", Trigger).resolved_name, rospy.ServiceProxy("ask", Trigger)().message)
rospy.set_param("speed", 3)
print(rospy.get_param("/fast/speed", "not there"), rospy.get_param("speed"))
