"""The messages of the robot (REP 103, REP 105)."""

from __future__ import annotations

import math

from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import (
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Transform,
    TransformStamped,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from rosz.msgs.nav_msgs.msg import Odometry
from rosz.msgs.sensor_msgs.msg import Imu, JointState, LaserScan
from rosz.msgs.std_msgs.msg import Header
from rosz.turtlebot3_sim.world import BEAMS, LASER_X, RANGE_MAX, RANGE_MIN, Robot

__all__ = (
    "SCAN_PERIOD",
    "imu",
    "joints",
    "mounts",
    "odometry",
    "scan",
    "stamp",
    "transform",
)

SCAN_PERIOD = 0.2
"""Seconds between two scans."""
_GRAVITY = 9.80665
_UNKNOWN = 1e6
"""Variance of what wheels cannot measure: height, roll and pitch."""


def _diagonal(*values: float) -> list[float]:
    size = len(values)
    return [values[row] if row == column else 0.0 for row in range(size) for column in range(size)]


_POSE_COVARIANCE = _diagonal(1e-5, 1e-5, _UNKNOWN, _UNKNOWN, _UNKNOWN, 1e-3)
_TWIST_COVARIANCE = _diagonal(1e-5, 1e-5, _UNKNOWN, _UNKNOWN, _UNKNOWN, 1e-3)
_ATTITUDE_COVARIANCE = _diagonal(1e-6, 1e-6, 1e-6)
_RATE_COVARIANCE = _diagonal(4e-8, 4e-8, 4e-8)
_ACCELERATION_COVARIANCE = _diagonal(2.9e-4, 2.9e-4, 2.9e-4)


def stamp(nanoseconds: int) -> Time:
    """Return a time in nanoseconds as a message."""
    return Time(*divmod(nanoseconds, 1_000_000_000))


def odometry(robot: Robot, now: Time) -> Odometry:
    """Return the pose of the robot in frame ``odom``, and its speed in its own frame."""
    pose = Pose(Point(robot.x, robot.y, 0.0), _heading(robot.theta))
    twist = Twist(Vector3(x=robot.speed), Vector3(z=robot.turn))
    return Odometry(
        Header(stamp=now, frame_id="odom"),
        "base_footprint",
        PoseWithCovariance(pose, _POSE_COVARIANCE),
        TwistWithCovariance(twist, _TWIST_COVARIANCE),
    )


def transform(robot: Robot, now: Time) -> TransformStamped:
    """Return the pose of the robot in frame ``odom`` as a transform."""
    place = Transform(Vector3(robot.x, robot.y, 0.0), _heading(robot.theta))
    return TransformStamped(Header(stamp=now, frame_id="odom"), "base_footprint", place)


def mounts(now: Time) -> list[TransformStamped]:
    """Return the static transforms of the parts of the robot."""
    upright = Quaternion(w=1.0)
    rolled = Quaternion(x=-math.sqrt(0.5), w=math.sqrt(0.5))
    places = (
        ("base_footprint", "base_link", (0.0, 0.0, 0.01), upright),
        ("base_link", "base_scan", (LASER_X, 0.0, 0.172), upright),
        ("base_link", "imu_link", (-0.032, 0.0, 0.068), upright),
        ("base_link", "wheel_left_link", (0.0, 0.08, 0.023), rolled),
        ("base_link", "wheel_right_link", (0.0, -0.08, 0.023), rolled),
    )
    return [
        TransformStamped(
            Header(stamp=now, frame_id=parent), child, Transform(Vector3(*position), rotation)
        )
        for parent, child, position, rotation in places
    ]


def scan(robot: Robot, now: Time) -> LaserScan:
    """Return a scan of the laser."""
    return LaserScan(
        Header(stamp=now, frame_id="base_scan"),
        angle_min=0.0,
        angle_max=math.tau * (BEAMS - 1) / BEAMS,
        angle_increment=math.tau / BEAMS,
        time_increment=0.0,
        scan_time=SCAN_PERIOD,
        range_min=RANGE_MIN,
        range_max=RANGE_MAX,
        ranges=list(robot.scan()),
    )


def imu(robot: Robot, now: Time) -> Imu:
    """Return heading, angular speed, and acceleration by gravity and by the curve."""
    return Imu(
        Header(stamp=now, frame_id="imu_link"),
        _heading(robot.theta),
        _ATTITUDE_COVARIANCE,
        Vector3(z=robot.turn),
        _RATE_COVARIANCE,
        Vector3(y=robot.speed * robot.turn, z=_GRAVITY),
        _ACCELERATION_COVARIANCE,
    )


def joints(robot: Robot, now: Time) -> JointState:
    """Return the angles and speeds of the wheels."""
    return JointState(
        Header(stamp=now),
        ["wheel_left_joint", "wheel_right_joint"],
        [robot.wheel_left, robot.wheel_right],
        list(robot.wheel_speeds()),
        [],
    )


def _heading(theta: float) -> Quaternion:
    return Quaternion(z=math.sin(theta / 2), w=math.cos(theta / 2))
