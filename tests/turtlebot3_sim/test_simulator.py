from __future__ import annotations

import math
import signal
import threading
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

from rosz.errors import RoszError
from rosz.msgs.geometry_msgs.msg import Twist, Vector3
from rosz.msgs.nav_msgs.msg import Odometry
from rosz.msgs.rosgraph_msgs.msg import Clock
from rosz.msgs.sensor_msgs.msg import Imu, JointState, LaserScan
from rosz.msgs.std_srvs.srv import Empty
from rosz.msgs.tf2_msgs.msg import TFMessage
from rosz.node import Node
from rosz.turtlebot3_sim.simulator import Turtlebot3Simulator

WAYPOINTS = ((1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0))


class Heard:
    """The newest message of a topic, and the number of messages."""

    def __init__(self, node: Node, topic: str, message_type: Any) -> None:
        self.count = 0
        self.first: Any = None
        self.last: Any = None
        node.subscription(topic, message_type, self._take, queue_size=1000)

    def _take(self, message: Any) -> None:
        self.first = self.first or message
        self.last = message
        self.count += 1


def start(network: Network, **params: object) -> Node:
    """Start a simulation, and return another node."""
    user = network.node("user")
    for name, value in params.items():
        user.params[f"/turtlebot3_sim/{name}"] = value
    Turtlebot3Simulator(network.node("turtlebot3_sim"))
    user.context.graph.wait_for(
        lambda view: bool(view.servers("/gazebo/reset_world")), TIMEOUT, "the simulation"
    )
    return user


def seconds(message: Any) -> float:
    return float(message.header.stamp.sec + message.header.stamp.nanosec / 1e9)


def usual_period(messages: Sequence[Any]) -> float:
    """Return the median of the times between messages, of which some may be lost."""
    stamps = [seconds(one) for one in messages]
    gaps = sorted(later - sooner for sooner, later in pairwise(stamps))
    return gaps[len(gaps) // 2]


def test_topics_in_their_frames(network: Network) -> None:
    user = start(network, real_time_factor=5)
    kinds = {"odom": Odometry, "scan": LaserScan, "imu": Imu, "joint_states": JointState}
    heard = {name: Heard(user, name, kind) for name, kind in kinds.items()}
    tf, fixed = Heard(user, "/tf", TFMessage), Heard(user, "/tf_static", TFMessage)
    eventually(lambda: all(one.last for one in (*heard.values(), tf, fixed)), "all topics")
    odometry, scan = heard["odom"].last, heard["scan"].last
    assert (odometry.header.frame_id, odometry.child_frame_id) == ("odom", "base_footprint")
    assert (odometry.pose.pose.position.x, odometry.pose.pose.position.y) == (-2.0, -0.5)
    assert odometry.pose.pose.orientation.w == 1.0
    assert [odometry.pose.covariance[7 * n] for n in range(6)] == [1e-5, 1e-5, 1e6, 1e6, 1e6, 1e-3]
    assert (scan.header.frame_id, len(scan.ranges)) == ("base_scan", 360)
    assert scan.angle_max == pytest.approx(359 * scan.angle_increment, rel=1e-6)
    assert heard["imu"].last.linear_acceleration.z == pytest.approx(9.81, abs=0.01)
    assert list(heard["joint_states"].last.name) == ["wheel_left_joint", "wheel_right_joint"]
    moving = tf.last.transforms[0]
    assert (moving.header.frame_id, moving.child_frame_id) == ("odom", "base_footprint")
    parents = {t.child_frame_id: t.header.frame_id for t in fixed.last.transforms}
    assert parents["base_scan"] == parents["imu_link"] == "base_link"
    assert parents["base_link"] == "base_footprint"


def test_rates_in_simulated_time(network: Network) -> None:
    network.node("before").params["/use_sim_time"] = True
    user = start(network, real_time_factor=10)
    odometry: list[Odometry] = []
    scans: list[LaserScan] = []
    user.subscription("odom", Odometry, odometry.append, queue_size=1000)
    user.subscription("scan", LaserScan, scans.append, queue_size=1000)
    eventually(lambda: len(scans) > 10 and len(odometry) > 60, "ten scans")
    assert usual_period(odometry) == pytest.approx(1 / 30, rel=0.1)
    assert usual_period(scans) == pytest.approx(1 / 5, rel=0.2)


def test_stamps_are_wall_time_unless_asked(network: Network) -> None:
    user = start(network)
    odometry, clock = Heard(user, "odom", Odometry), Heard(user, "/clock", Clock)
    eventually(lambda: odometry.last and clock.last, "odometry")
    assert seconds(odometry.last) == pytest.approx(user.now() / 1e9, abs=TIMEOUT)
    assert clock.last.clock.sec < 1e6


def test_it_follows_commands_and_resets(network: Network) -> None:
    user = start(network, world="empty", real_time_factor=20, x_pos=1, yaw=math.pi / 2)
    odometry = Heard(user, "odom", Odometry)
    commands = user.publisher("cmd_vel", Twist)
    commands.wait_for_subscribers()
    commands.publish(Twist(Vector3(x=math.nan), Vector3()))
    commands.publish(Twist(Vector3(x=1.0), Vector3()))
    eventually(lambda: odometry.last and odometry.last.pose.pose.position.y > 0.5, "a way")
    assert odometry.last.twist.twist.linear.x == 0.22
    assert odometry.last.pose.pose.position.x == pytest.approx(1.0)
    assert odometry.last.pose.pose.orientation.z == pytest.approx(math.sin(math.pi / 4))
    user.client("gazebo/reset_world", Empty)()
    eventually(lambda: odometry.last.pose.pose.position.y == 0.0, "the start")
    assert odometry.last.twist.twist.linear.x == 0.0


def test_a_pillar_is_in_the_way(network: Network) -> None:
    user = start(network, real_time_factor=20, y_pos=0.0)
    odometry = Heard(user, "odom", Odometry)
    commands = user.publisher("cmd_vel", Twist)
    commands.wait_for_subscribers()
    commands.publish(Twist(Vector3(x=0.22), Vector3()))

    def stands_elsewhere() -> bool:
        now = odometry.last  # the whole way takes less time than a busy machine may look away
        return bool(now and now.pose.pose.position.x > -2.0 and now.twist.twist.linear.x == 0)

    eventually(stands_elsewhere, "a stop")
    assert odometry.last.pose.pose.position.x == pytest.approx(-1.1 - 0.15 - 0.105, abs=0.003)


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("world", "turtlebot3_wrld", "did you mean 'turtlebot3_world'"),
        ("real_time_factor", 0, "expected 0 to 1000"),
        ("x_pos", "left", "x_pos"),
    ],
)
def test_wrong_parameters(network: Network, name: str, value: object, text: str) -> None:
    node = network.node("turtlebot3_sim")
    node.params[f"~{name}"] = value
    with pytest.raises(RoszError, match=text):
        Turtlebot3Simulator(node)


def test_through_the_waypoints_of_the_tutorial(network: Network) -> None:
    network.node("before").params["/use_sim_time"] = True
    user = start(network, world="empty", real_time_factor=5)
    commands = user.publisher("cmd_vel", Twist)
    odometry = Heard(user, "odom", Odometry)
    reached: list[tuple[float, float]] = []
    arrived = threading.Event()

    def control(_: object) -> None:
        """Turn to the next waypoint, then drive there and correct the course."""
        if odometry.last is None or arrived.is_set():
            return
        pose = odometry.last.pose.pose
        goal = WAYPOINTS[len(reached)]
        away = goal[0] - pose.position.x, goal[1] - pose.position.y
        if math.hypot(*away) < 0.05:
            reached.append((pose.position.x, pose.position.y))
            if len(reached) == len(WAYPOINTS):
                arrived.set()
            commands.publish(Twist())
            return
        heading = 2 * math.atan2(pose.orientation.z, pose.orientation.w)
        error = math.remainder(math.atan2(away[1], away[0]) - heading, math.tau)
        forward = 0.2 if abs(error) < 0.2 else 0.0
        commands.publish(Twist(Vector3(x=forward), Vector3(z=max(-1.0, min(1.0, error)))))

    user.timer(0.1, control)
    assert arrived.wait(4 * TIMEOUT), f"only {reached}"
    for place, goal in zip(reached, WAYPOINTS, strict=True):
        assert math.dist(place, goal) < 0.05


@pytest.mark.parametrize(
    ("package", "file", "x"),
    [
        ("turtlebot3_sim", "turtlebot3_sim.launch", -2.0),
        ("turtlebot3_gazebo", "turtlebot3_world.launch", -2.0),
        ("turtlebot3_gazebo", "turtlebot3_empty_world.launch", 0.0),
    ],
)
def test_launch_files(network: Network, package: str, file: str, x: float) -> None:
    launch = network.run("-m", "rosz", "launch", package, file, "real_time_factor:=3")
    try:
        user = network.node("user")
        odometry = Heard(user, "odom", Odometry)
        eventually(lambda: odometry.last, "odometry")
        assert odometry.last.pose.pose.position.x == x
        assert user.params["/use_sim_time"] is True
        assert seconds(odometry.last) < 1e6, launch.output
    finally:
        launch.send(signal.SIGINT)
        code = launch.exit_code()
    assert code == 0
    assert "Traceback" not in launch.output
