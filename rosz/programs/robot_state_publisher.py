"""robot_state_publisher: the frames of a robot's links, from its description and its joint states.

Its parameters are those of ROS 1 (ROS wiki, robot_state_publisher): ``robot_description`` and
``tf_prefix``, which are searched for upwards, and ``~publish_frequency``, ``~use_tf_static`` and
``~ignore_timestamp``. Of the description it reads names, origins, axes and mimicked joints.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Mapping
from xml.etree import ElementTree as ET

import msgspec

from rosz.errors import RoszError
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from rosz.msgs.sensor_msgs.msg import JointState
from rosz.msgs.std_msgs.msg import Header
from rosz.node import Node, serve_loggers
from rosz.transforms import (
    Pose,
    StaticTransformBroadcaster,
    TransformBroadcaster,
    compose,
    from_rpy,
)

__all__ = ("Link", "RobotError", "RobotStatePublisher", "main", "read_links")

_NANOSECONDS = 1_000_000_000
_FIXED_AHEAD = _NANOSECONDS // 2
_FREQUENCY = 50.0
_TURNING = frozenset({"revolute", "continuous"})
_MOVING = _TURNING | {"prismatic"}
_NO_ROTATION = (0.0, 0.0, 0.0, 1.0)


class RobotError(RoszError):
    """The description of the robot cannot be used."""


class Link(msgspec.Struct, frozen=True):
    """A link, and the joint that it hangs on.

    Attributes:
        parent: Name of the parent link.
        child: Name of the link.
        joint: Name of the joint.
        kind: Type of the joint, as URDF names it.
        origin: Pose of the joint in the parent.
        axis: Axis of the motion, of length 1.
        mimics: Joint that this one follows; empty for none.
        factor: Factor of the position of that joint.
        offset: Number added then, in radians or metres.
    """

    parent: str
    child: str
    joint: str
    kind: str
    origin: Pose
    axis: tuple[float, float, float]
    mimics: str = ""
    factor: float = 1.0
    offset: float = 0.0

    @property
    def moves(self) -> bool:
        """Whether the pose depends on the position of the joint."""
        return self.kind in _MOVING

    def pose(self, position: float = 0.0) -> Pose:
        """Return the pose in the parent.

        Args:
            position: Position of the joint, in radians or metres.
        """
        if not self.moves:
            return self.origin
        x, y, z = self.axis
        if self.kind not in _TURNING:
            moved = Pose((x * position, y * position, z * position), _NO_ROTATION)
            return compose(self.origin, moved)
        sine, cosine = math.sin(position / 2), math.cos(position / 2)
        return compose(self.origin, Pose((0.0, 0.0, 0.0), (x * sine, y * sine, z * sine, cosine)))


def read_links(description: str) -> list[Link]:
    """Return the links of a URDF that have a parent, without those on floating joints.

    Raises:
        RobotError: It is not XML or not a URDF, or a joint is not well-formed.
    """
    try:
        robot = ET.fromstring(description)  # noqa: S314  # a parameter of this system
    except ET.ParseError as error:
        raise RobotError(f"the description of the robot is not XML: {error}") from error
    if robot.tag != "robot":
        raise RobotError(f"the description of the robot has <{robot.tag}>; expected <robot> (URDF)")
    names = {link.get("name", "") for link in robot.findall("link")}
    found = [_read(joint, names) for joint in robot.findall("joint")]
    return [link for link in found if link.kind != "floating"]


def _read(joint: ET.Element, names: set[str]) -> Link:
    name = joint.get("name", "")
    ends = {}
    for role in ("parent", "child"):
        element = joint.find(role)
        ends[role] = "" if element is None else element.get("link", "")
        if ends[role] not in names:
            raise RobotError(
                f"joint '{name}': its {role} '{ends[role]}' is not a link of the robot"
            )
    origin, axis, mimic = (joint.find(tag) for tag in ("origin", "axis", "mimic"))
    try:
        roll, pitch, yaw = _numbers(origin, "rpy", "0 0 0")
        pose = Pose(_numbers(origin, "xyz", "0 0 0"), from_rpy(roll, pitch, yaw))
        direction = _numbers(axis, "xyz", "1 0 0")
        factor, offset = 1.0, 0.0
        if mimic is not None:
            factor, offset = float(mimic.get("multiplier", 1)), float(mimic.get("offset", 0))
    except ValueError as error:
        raise RobotError(f"joint '{name}': {error}; expected three numbers") from error
    length = math.hypot(*direction) or 1.0
    return Link(
        ends["parent"],
        ends["child"],
        name,
        joint.get("type", ""),
        pose,
        (direction[0] / length, direction[1] / length, direction[2] / length),
        "" if mimic is None else mimic.get("joint", ""),
        factor,
        offset,
    )


def _numbers(element: ET.Element | None, name: str, default: str) -> tuple[float, float, float]:
    text = default if element is None else element.get(name, default)
    x, y, z = map(float, text.split())
    return x, y, z


class RobotStatePublisher:
    """Publish the frames of a robot.

    Args:
        node: The node, whose parameters describe the robot.

    Raises:
        RobotError: There is no usable description.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        params = node.params
        links = read_links(self._searched("robot_description", None))
        self._prefix = str(self._searched("tf_prefix", "")).strip("/")
        self._ignore_stamp = bool(params.get("~ignore_timestamp", False))
        frequency = float(params.get("~publish_frequency", _FREQUENCY))
        if frequency <= 0:
            raise RobotError(f"~publish_frequency is {frequency:g}; expected above 0")
        self._interval = round(_NANOSECONDS / frequency)
        self._fixed = [link for link in links if not link.moves]
        self._moving = {link.joint: link for link in links if link.moves}
        self._published: dict[str, int] = {}
        self._newest = 0
        self._broadcaster = TransformBroadcaster(node)
        if params.get("~use_tf_static", True):
            stamp = node.now()
            fixed = [self._transform(link, 0.0, stamp) for link in self._fixed]
            StaticTransformBroadcaster(node).send(fixed)
        else:
            node.timer(1 / frequency, lambda _: self._send_fixed())
        node.subscription("joint_states", JointState, self.receive, queue_size=1)

    def _searched(self, name: str, default: str | None) -> str:
        found = self._node.params.search(name)
        value: object = default if found is None else self._node.params.get(found)
        if isinstance(value, str):
            return value
        raise RobotError(
            f"parameter '{name}' is not set, or is not a text: it is the URDF of the robot, such as"
            ' <param name="robot_description" command="xacro FILE"/>'
        )

    def _send_fixed(self) -> None:
        # Dated ahead, so that they are valid until the next ones come.
        stamp = self._node.now() + _FIXED_AHEAD
        self._broadcast(self._transform(link, 0.0, stamp) for link in self._fixed)

    def receive(self, state: JointState) -> None:
        """Publish the frames of links whose joints moved, unless they were published just now."""
        if len(state.name) != len(state.position):
            self._node.log.warning(
                "ignoring a joint state: %d names and %d positions, expected as many",
                len(state.name),
                len(state.position),
                throttle_identical=10.0,
            )
            return
        now = self._node.now()
        if now < self._newest:
            self._node.log.warning("time moved backwards: the frames are published again")
            self._published.clear()
        self._newest = now
        stamp = state.header.stamp.to_nsec()
        oldest = min((self._published.get(name, 0) for name in state.name), default=now)
        if not self._ignore_stamp and stamp < oldest + self._interval:
            return
        self._broadcast(self._moved(dict(zip(state.name, state.position, strict=True)), stamp))
        self._published.update(dict.fromkeys(state.name, stamp))

    def _moved(self, positions: Mapping[str, float], stamp: int) -> list[TransformStamped]:
        found: list[TransformStamped] = []
        for link in self._moving.values():
            position = positions.get(link.joint)
            if link.mimics in positions:
                position = positions[link.mimics] * link.factor + link.offset
            if position is not None:
                found.append(self._transform(link, position, stamp))
        return found

    def _transform(self, link: Link, position: float, stamp: int) -> TransformStamped:
        pose = link.pose(position)
        header = Header(stamp=Time.from_nsec(stamp), frame_id=self._name(link.parent))
        transform = Transform(Vector3(*pose.translation), Quaternion(*pose.rotation))
        return TransformStamped(header, self._name(link.child), transform)

    def _name(self, link: str) -> str:
        return f"{self._prefix}/{link}" if self._prefix else link

    def _broadcast(self, transforms: Iterable[TransformStamped]) -> None:
        listed = list(transforms)
        if listed:
            self._broadcaster.send(listed)


def main() -> None:
    """Publish frames until the node is shut down."""
    with Node("robot_state_publisher") as node:
        serve_loggers(node)
        try:
            RobotStatePublisher(node)
        except RobotError as error:
            sys.exit(f"robot_state_publisher: {error}")
        node.spin()
