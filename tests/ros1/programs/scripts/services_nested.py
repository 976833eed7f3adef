#!/usr/bin/env python
"""Services called from callbacks, timers and other services."""

import rospy
from std_msgs.msg import Int32
from std_srvs.srv import SetBool, SetBoolResponse, Trigger

rospy.init_node("nested")
inner = rospy.ServiceProxy("inner", Trigger)
outer = rospy.ServiceProxy("outer", SetBool)


def outer_handler(request):
    return SetBoolResponse(request.data, "outer of " + inner().message)


rospy.Service("inner", Trigger, lambda request: (True, "inner"))
rospy.Service("outer", SetBool, outer_handler)


def callback(message):
    print(message.data, outer(message.data > 1).message)
    if message.data == 2:
        rospy.Timer(rospy.Duration(0.01), in_timer, oneshot=True)


def in_timer(event):
    print("timer", outer(True))
    rospy.signal_shutdown("done")


rospy.Subscriber("numbers", Int32, callback)
publisher = rospy.Publisher("numbers", Int32, queue_size=5)
while publisher.get_num_connections() < 1:
    rospy.sleep(0.01)
publisher.publish(1)
publisher.publish(2)
rospy.spin()
