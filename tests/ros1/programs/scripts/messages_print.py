#!/usr/bin/env python
"""Messages as text."""

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, Point32, Polygon, PointStamped, Twist, Wrench
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import (
    Bool,
    Byte,
    Char,
    ColorRGBA,
    Duration,
    Empty,
    Float32,
    Float64,
    Header,
    Int8,
    String,
    Time,
    UInt8MultiArray,
)

messages = [
    Empty(),
    String(),
    String("text"),
    String("two\nlines"),
    String('quotes " and \' and \\'),
    String("gr\u00fc\u00dfe"),
    Bool(True),
    Byte(5),
    Char(65),
    Int8(-5),
    Float32(1.1),
    Float64(1e300),
    Float64(1 / 3),
    Float64(float("inf")),
    Float64(5),
    Time(rospy.Time(5, 6)),
    Duration(rospy.Duration(-1.5)),
    Header(seq=3, stamp=rospy.Time(1, 2), frame_id="map"),
    ColorRGBA(1, 0.5, 0, 1),
    Point(1, 2.5, -3),
    Twist(),
    PointStamped(),
    Polygon([Point32(1, 2, 3), Point32()]),
    Polygon(),
    Wrench(),
    Odometry(child_frame_id="x").twist,
    JointState(name=["a", "b"], position=[1.0, 2.0]),
    JointState(name=["it's", 'a "b"', ""]),
    UInt8MultiArray(data=b"\x00\xff"),
    UInt8MultiArray(data=[1, 2]),
    Image(height=1, width=2, encoding="mono8", step=2, data=b"ab"),
    DiagnosticArray(status=[DiagnosticStatus(name="x", values=[KeyValue("k", "v"), KeyValue()])]),
]
for message in messages:
    print("==", type(message).__name__)
    print(message)
print("== in a list and in a format")
print(["%s" % Point(1, 2, 3), f"{Point()}"])
