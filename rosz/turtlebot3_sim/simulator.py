"""The program ``turtlebot3_sim``: the robot as a node, with TurtleBot3's topics in Gazebo.

The simulation runs in steps of 10 ms; the parameter ``~real_time_factor`` sets its speed.
"""

from __future__ import annotations

import math
import threading
import time
from typing import Any

from rosz.errors import UsageError, near_miss
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
from rosz.msgs.rosgraph_msgs.msg import Clock
from rosz.msgs.sensor_msgs.msg import Imu, JointState, LaserScan
from rosz.msgs.std_msgs.msg import Header
from rosz.msgs.std_srvs.srv import Empty
from rosz.msgs.tf2_msgs.msg import TFMessage
from rosz.node import Node
from rosz.turtlebot3_sim.world import ARENAS, BEAMS, LASER_X, RANGE_MAX, RANGE_MIN, Robot

STEP_NS = 10_000_000
"""Simulated time of one step in nanoseconds."""
_ODOMETRY_HZ = 30
_SECOND = 1_000_000_000
_MIN_PAUSE = 0.002
_MAX_DELAY = 0.25
"""Seconds of wall time that the simulation catches up with; a longer delay is skipped."""
_RESETS = ("reset_world", "gazebo/reset_world")
"""Names of Gazebo's service in ROS 2 and in ROS 1."""

_SCAN_PERIOD = 0.2
"""Seconds between two scans."""
_GRAVITY = 9.80665
_UNKNOWN = 1e6
"""Variance of height, roll and pitch, which wheels cannot measure."""


def _diagonal(*values: float) -> list[float]:
    size = len(values)
    return [values[row] if row == column else 0.0 for row in range(size) for column in range(size)]


_PLANAR_COVARIANCE = _diagonal(1e-5, 1e-5, _UNKNOWN, _UNKNOWN, _UNKNOWN, 1e-3)
_ATTITUDE_COVARIANCE = _diagonal(1e-6, 1e-6, 1e-6)
_RATE_COVARIANCE = _diagonal(4e-8, 4e-8, 4e-8)
_ACCELERATION_COVARIANCE = _diagonal(2.9e-4, 2.9e-4, 2.9e-4)


class Turtlebot3Simulator:
    """A robot in an arena as a node; it ends with the node.

    The private parameters are ``world`` (``turtlebot3_world`` or ``empty``), ``x_pos``, ``y_pos``
    and ``yaw`` for the start, and ``real_time_factor``. Stamps are simulated time if
    ``/use_sim_time`` is set, else wall time; ``/clock`` is always published.

    Raises:
        UsageError: A parameter has an invalid value.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        get = node.params.get
        world = get("~world", "turtlebot3_world", type=str)
        if world not in ARENAS:
            hint = near_miss(world, ARENAS) or f": expected one of {', '.join(ARENAS)}"
            raise UsageError(f"parameter ~world is '{world}'{hint}")
        self._factor = get("~real_time_factor", 1.0, type=float)
        if not 0 < self._factor <= 1000:  # noqa: PLR2004  # faster than any machine
            raise UsageError(f"parameter ~real_time_factor is '{self._factor}': expected 0 to 1000")
        x, y = (-2.0, -0.5) if world == "turtlebot3_world" else (0.0, 0.0)
        self._start = (
            get("~x_pos", x, type=float),
            get("~y_pos", y, type=float),
            get("~yaw", 0.0, type=float),
        )
        self._robot = Robot(ARENAS[world], *self._start)
        self._lock = threading.Lock()
        self._end = threading.Event()
        self._time = 0
        self._open_topics()
        node.log.info("TurtleBot3 burger in '%s' at x=%g, y=%g", world, *self._start[:2])
        self._thread = threading.Thread(target=self._run, name="rosz-turtlebot3", daemon=True)
        node.on_shutdown(lambda _: self.close())
        self._thread.start()

    def close(self) -> None:
        """Stop the simulation; a second call has no effect."""
        self._end.set()
        if threading.current_thread() is not self._thread:
            self._thread.join()

    def _open_topics(self) -> None:
        node = self._node
        self._clock = node.publisher("/clock", Clock, queue_size=1)
        self._odometry = node.publisher("odom", Odometry, queue_size=1)
        self._tf = node.publisher("/tf", TFMessage, queue_size=10)
        self._joints = node.publisher("joint_states", JointState, queue_size=1)
        self._imu = node.publisher("imu", Imu, queue_size=1)
        self._scan = node.publisher("scan", LaserScan, queue_size=1)
        mounts = node.publisher("/tf_static", TFMessage, latch=True)
        mounts.publish(TFMessage(_mounts(self._stamp())))
        node.subscription("cmd_vel", Twist, self._command, queue_size=1)
        for name in _RESETS:
            node.service(name, Empty, self._reset)

    def _command(self, twist: Twist) -> None:
        try:
            with self._lock:
                self._robot.command(twist.linear.x, twist.angular.z)
        except UsageError as error:
            self._node.log.warning("ignoring a command: %s", error, throttle=1)

    def _reset(self, _: Any) -> None:
        with self._lock:
            self._robot = Robot(self._robot.arena, *self._start)

    def _run(self) -> None:
        """Run steps at the pace of wall time times the factor."""
        step = STEP_NS / _SECOND / self._factor
        due = time.monotonic() + step
        while not self._end.wait(max(due - time.monotonic(), _MIN_PAUSE)):
            now = time.monotonic()
            due = max(due, now - _MAX_DELAY)
            while due <= now and not self._end.is_set():
                self._step()
                due += step

    def _step(self) -> None:
        with self._lock:
            self._robot.step(STEP_NS / _SECOND)
            before, self._time = self._time, self._time + STEP_NS
            self._clock.publish(Clock(Time.from_nsec(self._time)))
            now = self._stamp()
            if _passes(before, self._time, _ODOMETRY_HZ):
                self._odometry.publish(_odometry(self._robot, now))
                self._tf.publish(TFMessage([_transform(self._robot, now)]))
                self._joints.publish(_joints(self._robot, now))
                self._imu.publish(_imu(self._robot, now))
            if _passes(before, self._time, 1 / _SCAN_PERIOD):
                self._scan.publish(_scan(self._robot, now))

    def _stamp(self) -> Any:
        simulated = self._node.clock.simulated
        return Time.from_nsec(self._time if simulated else time.time_ns())


def main() -> None:
    """Simulate until the node is shut down."""
    with Node("turtlebot3_sim") as node:
        node.context.cooperative = True
        Turtlebot3Simulator(node)
        node.spin()


def _passes(before: int, now: int, hz: float) -> bool:
    """Return whether a periodic event is due between two times in nanoseconds."""
    return int(before * hz // _SECOND) != int(now * hz // _SECOND)


def _odometry(robot: Robot, now: Time) -> Odometry:
    """Return the pose of the robot in frame ``odom``, and its speed in its own frame."""
    pose = Pose(Point(robot.x, robot.y, 0.0), _heading(robot.theta))
    twist = Twist(Vector3(x=robot.speed), Vector3(z=robot.turn))
    return Odometry(
        Header(stamp=now, frame_id="odom"),
        "base_footprint",
        PoseWithCovariance(pose, _PLANAR_COVARIANCE),
        TwistWithCovariance(twist, _PLANAR_COVARIANCE),
    )


def _transform(robot: Robot, now: Time) -> TransformStamped:
    """Return the pose of the robot in frame ``odom`` as a transform."""
    place = Transform(Vector3(robot.x, robot.y, 0.0), _heading(robot.theta))
    return TransformStamped(Header(stamp=now, frame_id="odom"), "base_footprint", place)


def _mounts(now: Time) -> list[TransformStamped]:
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


def _scan(robot: Robot, now: Time) -> LaserScan:
    return LaserScan(
        Header(stamp=now, frame_id="base_scan"),
        angle_min=0.0,
        angle_max=math.tau * (BEAMS - 1) / BEAMS,
        angle_increment=math.tau / BEAMS,
        time_increment=0.0,
        scan_time=_SCAN_PERIOD,
        range_min=RANGE_MIN,
        range_max=RANGE_MAX,
        ranges=list(robot.scan()),
    )


def _imu(robot: Robot, now: Time) -> Imu:
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


def _joints(robot: Robot, now: Time) -> JointState:
    return JointState(
        Header(stamp=now),
        ["wheel_left_joint", "wheel_right_joint"],
        [robot.wheel_left, robot.wheel_right],
        list(robot.wheel_speeds()),
        [],
    )


def _heading(theta: float) -> Quaternion:
    return Quaternion(z=math.sin(theta / 2), w=math.cos(theta / 2))
