"""The messages that the codecs are compared on: their values, free of any library.

Each case has several variants, as a running system has: times and readings change, the names of
frames and joints stay. The frames of images and clouds differ in length, for how fast memory is
copied depends on where it lies.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable
from typing import Any

VARIANTS = 16
PIXELS = bytes(1920 * 480)
POINTS = bytes(1_600_000)
Plain = dict[str, Any]


def header(n: int, frame: str = "base_link") -> Plain:
    return {"stamp": {"sec": 1_700_000_000 + n, "nanosec": 1_000_003 * n}, "frame_id": frame}


def xyz(n: int) -> Plain:
    return {"x": 0.1 * n, "y": -1.5 + n, "z": 0.25}


def xyzw(n: int) -> Plain:
    return {"x": 0.0, "y": 0.0, "z": math.sin(n), "w": math.cos(n)}


def pose(n: int) -> Plain:
    return {"position": xyz(n), "orientation": xyzw(n)}


def twist(n: int) -> Plain:
    return {"linear": xyz(n), "angular": xyz(n + 1)}


def pose_stamped(n: int) -> Plain:
    return {"header": header(n), "pose": pose(n)}


def odometry(n: int) -> Plain:
    covariance = array("d", [0.01 * n] * 36)
    return {
        "header": header(n, "odom"),
        "child_frame_id": "base_footprint",
        "pose": {"pose": pose(n), "covariance": covariance},
        "twist": {"twist": twist(n), "covariance": covariance},
    }


def joint_state(n: int) -> Plain:
    return {
        "header": header(n),
        "name": [f"arm_{joint}_joint" for joint in range(7)],
        "position": array("d", [0.1 * joint + n for joint in range(7)]),
        "velocity": array("d", [0.01 * joint for joint in range(7)]),
        "effort": array("d", [1.0 * joint for joint in range(7)]),
    }


def lists(make: Callable[[int], Plain]) -> Callable[[int], Plain]:
    """Return a maker of the same messages, with lists of numbers as rospy's users write them."""

    def listed(n: int) -> Plain:
        plain = make(n)
        return {k: list(v) if isinstance(v, array) else v for k, v in plain.items()}

    return listed


def laser_scan(n: int) -> Plain:
    limits = ("angle_min", "angle_max", "angle_increment", "time_increment", "scan_time")
    return {
        "header": header(n, "laser"),
        **dict.fromkeys((*limits, "range_min", "range_max"), 0.5),
        "ranges": array("f", [1.0 + 0.01 * i + n for i in range(360)]),
        "intensities": array("f", [100.0 + i for i in range(360)]),
    }


def tf_message(n: int) -> Plain:
    return {
        "transforms": [
            {
                "header": header(n, f"link_{i}"),
                "child_frame_id": f"link_{i + 1}",
                "transform": {"translation": xyz(i), "rotation": xyzw(i + n)},
            }
            for i in range(10)
        ]
    }


def diagnostic_array(n: int) -> Plain:
    return {
        "header": header(n, ""),
        "status": [
            {
                "level": i % 3,
                "name": f"driver: motor {i}",
                "message": f"running at {n * 10 + i} rpm",
                "hardware_id": f"motor-{i}",
                "values": [
                    {"key": f"reading {j}", "value": f"{n + 0.37 * j:.2f}"} for j in range(5)
                ],
            }
            for i in range(6)
        ],
    }


def image(n: int) -> Plain:
    return {
        "header": header(n, "camera_optical_frame"[: 5 + n]),
        "height": 480,
        "width": 640,
        "encoding": "rgb8",
        "is_bigendian": 0,
        "step": 1920,
        "data": PIXELS,
    }


def point_cloud(n: int) -> Plain:
    return {
        "header": header(n, "lidar_optical_frame"[: 4 + n]),
        "height": 1,
        "width": 100_000,
        "fields": [
            {"name": name, "offset": 4 * i, "datatype": 7, "count": 1}
            for i, name in enumerate(("x", "y", "z", "intensity"))
        ],
        "is_bigendian": False,
        "point_step": 16,
        "row_step": 1_600_000,
        "data": POINTS,
        "is_dense": True,
    }


CASES: list[tuple[str, str, Callable[[int], Plain], int]] = [
    ("Twist", "geometry_msgs/Twist", twist, 2000),
    ("PoseStamped", "geometry_msgs/PoseStamped", pose_stamped, 1000),
    ("Odometry", "nav_msgs/Odometry", odometry, 500),
    ("JointState (7)", "sensor_msgs/JointState", joint_state, 500),
    ("LaserScan (360)", "sensor_msgs/LaserScan", laser_scan, 200),
    ("JointState, lists", "sensor_msgs/JointState", lists(joint_state), 500),
    ("LaserScan, lists", "sensor_msgs/LaserScan", lists(laser_scan), 200),
    ("TFMessage (10)", "tf2_msgs/TFMessage", tf_message, 100),
    ("DiagnosticArray", "diagnostic_msgs/DiagnosticArray", diagnostic_array, 50),
    ("Image VGA", "sensor_msgs/Image", image, 20),
    ("PointCloud2 100k", "sensor_msgs/PointCloud2", point_cloud, 10),
]
"""Column of the table, type, maker of its nth variant, variants coded in one measurement."""
