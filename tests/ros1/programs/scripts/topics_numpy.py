#!/usr/bin/env python
"""Messages whose arrays are numpy's."""

import numpy
import rospy
from rospy.numpy_msg import numpy_msg
from std_msgs.msg import Float32MultiArray

rospy.init_node("vectors")


def callback(message):
    print(type(message.data).__name__, message.data.dtype, message.data.sum(), (message.data * 2).tolist())
    rospy.signal_shutdown("seen")


rospy.Subscriber("floats", numpy_msg(Float32MultiArray), callback)
publisher = rospy.Publisher("floats", numpy_msg(Float32MultiArray), queue_size=5)
while publisher.get_num_connections() < 1:
    rospy.sleep(0.01)
publisher.publish(data=numpy.array([1.0, 2.5, -3.0], dtype=numpy.float32))
rospy.spin()
print(numpy_msg(Float32MultiArray)._type)
