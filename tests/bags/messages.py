"""One message of each of many types, for bags."""

from __future__ import annotations

from typing import Any

from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rosz.msgs.geometry_msgs.msg import (
    Point,
    Pose,
    PoseStamped,
    Quaternion,
    TransformStamped,
    Twist,
    Vector3,
)
from rosz.msgs.nav_msgs.msg import OccupancyGrid, Odometry
from rosz.msgs.rosgraph_msgs.msg import Clock
from rosz.msgs.sensor_msgs.msg import (
    CameraInfo,
    Image,
    Imu,
    JointState,
    Joy,
    LaserScan,
    PointCloud2,
    PointField,
)
from rosz.msgs.std_msgs.msg import (
    Bool,
    ColorRGBA,
    Empty,
    Float64MultiArray,
    Header,
    Int32,
    MultiArrayDimension,
    MultiArrayLayout,
    String,
)
from rosz.msgs.tf2_msgs.msg import TFMessage

__all__ = ("MESSAGES",)

HEADER = Header(7, Time(1700000000, 250), "map")
POSE = Pose(Point(1.0, 2.5, -3.0), Quaternion(0.0, 0.0, 1.0, 0.0))

MESSAGES: dict[str, Any] = {
    "/string": String(data="grüße, 世界"),
    "/empty": Empty(),
    "/bool": Bool(data=True),
    "/int32": Int32(data=-5),
    "/color": ColorRGBA(r=0.5, a=1.0),
    "/floats": Float64MultiArray(
        MultiArrayLayout([MultiArrayDimension("x", 2, 2)], 0), [1.5, -2.25]
    ),
    "/twist": Twist(Vector3(1.0, 0.0, 0.0), Vector3(0.0, 0.0, -0.5)),
    "/pose": PoseStamped(HEADER, POSE),
    "/odom": Odometry(header=HEADER, child_frame_id="base"),
    "/map": OccupancyGrid(header=HEADER, data=[-1, 0, 100]),
    "/clock": Clock(Time(12, 34)),
    "/camera_info": CameraInfo(header=HEADER, height=480, width=640, d=[0.1, 0.2]),
    "/image": Image(HEADER, 2, 3, "mono8", 0, 3, bytes(range(6))),
    "/imu": Imu(header=HEADER),
    "/joints": JointState(HEADER, ["a", "b"], [0.5, 1.5], [], []),
    "/joy": Joy(HEADER, [0.25, -1.0], [1, 0]),
    "/scan": LaserScan(header=HEADER, ranges=[1.0, 2.0], intensities=[]),
    "/cloud": PointCloud2(
        header=HEADER,
        height=1,
        width=2,
        fields=[PointField("x", 0, 7, 1)],
        point_step=4,
        row_step=8,
        data=bytes(8),
    ),
    "/tf": TFMessage([TransformStamped(header=HEADER, child_frame_id="base")]),
    "/diagnostics": DiagnosticArray(
        HEADER, [DiagnosticStatus(b"\2"[0], "motor", "hot", "m1", [KeyValue("t", "90")])]
    ),
}
"""Messages by topic."""
