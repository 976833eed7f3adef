#!/usr/bin/env python
"""What a program makes before it is a node works once it is one."""

import actionlib
import bondpy.bondpy
import resource_retriever
import rospy
import tf
import tf2_ros
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from std_msgs.msg import Header
from tf2_msgs.msg import LookupTransformAction, LookupTransformGoal, LookupTransformResult


def execute(goal):
    server.set_succeeded(LookupTransformResult(), "to " + goal.target_frame)


def stamped(parent, child):
    turned = Quaternion(w=1)
    return TransformStamped(Header(stamp=rospy.Time.now(), frame_id=parent), child, Transform(Vector3(x=1), turned))


server = actionlib.SimpleActionServer("early", LookupTransformAction, execute, auto_start=False)
private = actionlib.SimpleActionServer("~do", LookupTransformAction, execute, auto_start=False)
moving, static, old = tf2_ros.TransformBroadcaster(), tf2_ros.StaticTransformBroadcaster(), tf.TransformBroadcaster()
try:
    moving.sendTransform(TransformStamped())
except rospy.ROSException:
    print("too early")
rospy.init_node("early")
server.start()
private.start()
client = actionlib.SimpleActionClient("early", LookupTransformAction)
print(client.wait_for_server(rospy.Duration(20)))
print(client.send_goal_and_wait(LookupTransformGoal(target_frame="map"), rospy.Duration(20)))
print(client.get_goal_status_text())
state = rospy.get_master().getSystemState()[2]
print(sorted({name for kind in state for name, _ in kind if name.startswith("/early/")}))

buffer = tf2_ros.Buffer()
listener = tf2_ros.TransformListener(buffer)
static.sendTransform(stamped("map", "odom"))
while not rospy.is_shutdown() and not buffer.can_transform("map", "lidar", rospy.Time()):
    moving.sendTransform(stamped("odom", "base"))
    old.sendTransform((1, 0, 0), (0, 0, 0, 1), rospy.Time.now(), "lidar", "base")
    rospy.sleep(0.05)
print(buffer.lookup_transform("map", "lidar", rospy.Time()).transform.translation.x)

bond = bondpy.bondpy.Bond("bonds", "b")
for name in ("connect", "heartbeat", "disconnect"):
    getattr(bond, "set_" + name + "_timeout")(3)
bond.set_heartbeat_period(0.5)
print(bond.connect_timeout, bond.heartbeat_timeout, bond.disconnect_timeout, bond.heartbeat_period)

print(resource_retriever.get_filename("http://localhost/a"))
path = resource_retriever.get_filename("package://std_msgs/package.xml")
print(path.startswith("file:///"), path.endswith("/package.xml"))
print(path == "file://" + resource_retriever.get_filename("package://std_msgs/package.xml", use_protocol=False))
print(b"std_msgs" in resource_retriever.get(path))
for url in ("package://std_msgs", "package://no_such_package/a", "package://std_msgs/nothing"):
    try:
        resource_retriever.get(url)
    except Exception as error:
        print(type(error).__name__, str(error)[:20] if "such" not in url else "")
rospy.signal_shutdown("done")
