#!/usr/bin/env python
"""The header of a connection, and of a message."""

import rospy
from geometry_msgs.msg import PointStamped

rospy.init_node("headed")
seen = []
lines = []


def callback(message):
    if not seen:
        header = message._connection_header
        for key in ("callerid", "latching", "md5sum", "topic", "type"):
            lines.append("%s %s" % (key, header[key]))
    seen.append(message.header.seq)
    lines.append("%d %s %.1f %d" % (message.header.seq, message.header.frame_id, message.point.x, message.header.stamp.secs))
    if len(seen) == 3:
        rospy.signal_shutdown("three")


rospy.Subscriber("points", PointStamped, callback)
publisher = rospy.Publisher("points", PointStamped, queue_size=5)
while publisher.get_num_connections() < 1:
    rospy.sleep(0.01)
message = PointStamped()
message.header.frame_id = "map"
message.header.stamp = rospy.Time(12, 34)
for number in range(3):
    message.point.x = number
    publisher.publish(message)
    print("sent", message.header.seq, message.header.stamp.secs)
rospy.spin()
print("\n".join(lines))
