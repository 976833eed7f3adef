#!/usr/bin/env python
"""What is left of publishers and subscribers that are unregistered."""

import rospy
from std_msgs.msg import String

rospy.init_node("leaver")
heard = []
subscriber = rospy.Subscriber("room", String, lambda message: heard.append(message.data))
publisher = rospy.Publisher("room", String, queue_size=5)
second = rospy.Publisher("room", String, queue_size=5)
while publisher.get_num_connections() < 1 or subscriber.get_num_connections() < 1:
    rospy.sleep(0.01)
publisher.publish("one")
while len(heard) < 1:
    rospy.sleep(0.01)
publisher.unregister()
second.publish("two")
while len(heard) < 2:
    rospy.sleep(0.01)
print(heard)
try:
    publisher.publish("three")
except Exception as error:
    print(type(error).__name__, error)
publisher.unregister()
subscriber.unregister()
subscriber.unregister()
deadline = rospy.get_time() + 60
while second.get_num_connections() > 0 and rospy.get_time() < deadline:
    rospy.sleep(0.01)
second.publish("four")
rospy.sleep(0.1)
print(heard, second.get_num_connections(), publisher.impl, subscriber.impl)
