#!/usr/bin/env python3
import json

import roslib

roslib.load_manifest("field_nodes")
import rospy
from field_msgs.msg import Track
from field_msgs.srv import *
from field_nodes.tracking import track
from tf.transformations import *

rospy.init_node("tracker")
publisher = rospy.Publisher("~track", Track, queue_size=1, latch=True)
rospy.Service("~select", Select, lambda request: SelectResponse())
publisher.publish(track([math.pi, float(numpy.hypot(3, 4))]))
rospy.Subscriber("~track", Track, lambda message: rospy.set_param(
    "~heard", json.dumps(message.distances + (1.0,))))
rospy.spin()
