#!/usr/bin/env python
"""Messages made, compared, copied, changed; and what is refused."""

import copy
import pickle

import rospy
from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import Image, PointCloud2, PointField
from std_msgs.msg import Bool, Float32MultiArray, Header, Int8, String, UInt8
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse, Trigger


def attempt(text):
    try:
        print(text, "->", eval(text))
    except Exception as error:
        print(text, "->", type(error).__name__, error)


pose = Pose(Point(1, 2, 3), Quaternion(0, 0, 0, 1))
deep, shallow = copy.deepcopy(pose), copy.copy(pose)
pose.position.x = 9
print(deep.position.x, shallow.position.x, deep == pose, shallow == pose, deep != pose)
print(pickle.loads(pickle.dumps(pose)) == pose, pose == "text", Point(1, 2, 3) == Point(1.0, 2.0, 3.0))
for make in (lambda: Point(1, 2, 3, 4), lambda: Point(w=1), lambda: Point(1, 2, 3, x=1), lambda: SetBoolRequest(1, 2)):
    try:
        print(make())
    except (AttributeError, TypeError):  # genpy has one for each
        print("refused")
for text in """
String(5).data
Int8("x").data
Header().stamp.secs, Header().seq, Header().frame_id
PoseStamped().header.stamp.is_zero()
Bool().data, UInt8().data, String().data, len(Float32MultiArray().data)
OccupancyGrid().info.resolution, list(OccupancyGrid().data)
Image().data, len(Image().data)
PointField.FLOAT32, PointField.INT8
PointCloud2().is_dense
String._type, String._md5sum, "string data" in String._full_text
String.__slots__, String._slot_types, String._has_header
PoseStamped.__slots__, PoseStamped._slot_types, PoseStamped._has_header
PoseStamped._type, PoseStamped._md5sum
SetBool._type, SetBool._md5sum, SetBool._request_class.__name__, SetBool._response_class.__name__
SetBoolRequest._type, SetBoolRequest._md5sum, SetBoolResponse(True, "x").message
SetBoolRequest().data, SetBoolResponse().success
Trigger._request_class()
Point().nothing
hash(Point())
isinstance(Point(), rospy.Message)
isinstance(rospy.Time(), type(Header().stamp))
""".strip().splitlines():
    attempt(text)
message = String()
message.data = 5
print(message.data)
try:
    message.text = "x"
except AttributeError:
    print("AttributeError")
