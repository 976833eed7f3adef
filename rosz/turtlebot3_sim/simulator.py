"""The program ``turtlebot3_sim``: the robot as a node, with TurtleBot3's topics in Gazebo.

The simulation runs in steps of 10 ms; the parameter ``~real_time_factor`` sets its speed.
"""

from __future__ import annotations

import threading
import time
from typing import Any

from rosz.errors import UsageError, near_miss
from rosz.msgs.geometry_msgs.msg import Twist
from rosz.msgs.nav_msgs.msg import Odometry
from rosz.msgs.rosgraph_msgs.msg import Clock
from rosz.msgs.sensor_msgs.msg import Imu, JointState, LaserScan
from rosz.msgs.std_srvs.srv import Empty
from rosz.msgs.tf2_msgs.msg import TFMessage
from rosz.node import Node
from rosz.turtlebot3_sim import messages
from rosz.turtlebot3_sim.world import ARENAS, Robot

__all__ = ("STEP_NS", "Simulator", "main")

STEP_NS = 10_000_000
"""Simulated time of one step in nanoseconds."""
_ODOMETRY_HZ = 30
_SECOND = 1_000_000_000
_MIN_PAUSE = 0.002
_MAX_DELAY = 0.25
"""Seconds of wall time that the simulation catches up with; a longer delay is skipped."""
_RESETS = ("reset_world", "gazebo/reset_world")
"""Names of Gazebo's service in ROS 2 and in ROS 1."""


class Simulator:
    """A robot in an arena as a node; it ends with the node.

    The private parameters are ``world`` (``turtlebot3_world`` or ``empty``), ``x_pos``, ``y_pos``
    and ``yaw`` for the start, and ``real_time_factor``. Stamps are simulated time if
    ``/use_sim_time`` is set, else wall time; ``/clock`` is always published.

    Args:
        node: Node with the topics and parameters.

    Raises:
        UsageError: A parameter has an invalid value.
        ParamError: A parameter has the wrong type.
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
        mounts.publish(TFMessage(messages.mounts(self._stamp())))
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
            robot = self._robot
            robot.x, robot.y, robot.theta = self._start
            robot.forward = robot.turn = robot.speed = robot.wheel_left = robot.wheel_right = 0.0

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
            self._clock.publish(Clock(messages.stamp(self._time)))
            now = self._stamp()
            if _passes(before, self._time, _ODOMETRY_HZ):
                self._odometry.publish(messages.odometry(self._robot, now))
                self._tf.publish(TFMessage([messages.transform(self._robot, now)]))
                self._joints.publish(messages.joints(self._robot, now))
                self._imu.publish(messages.imu(self._robot, now))
            if _passes(before, self._time, 1 / messages.SCAN_PERIOD):
                self._scan.publish(messages.scan(self._robot, now))

    def _stamp(self) -> Any:
        simulated = self._node.clock.simulated
        return messages.stamp(self._time if simulated else time.time_ns())


def main() -> None:
    """Simulate until the node is shut down."""
    with Node("turtlebot3_sim") as node:
        node.context.cooperative = True
        Simulator(node)
        node.spin()


def _passes(before: int, now: int, hz: float) -> bool:
    """Return whether a periodic event is due between two times in nanoseconds."""
    return int(before * hz // _SECOND) != int(now * hz // _SECOND)
