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

from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from rosz.msgs.sensor_msgs.msg import JointState
from rosz.msgs.std_msgs.msg import Header
from rosz.node import Node, serve_loggers
from rosz.programs.joint_state_publisher import DescriptionError, Mimic, parse_description
from rosz.transforms import (
    Pose,
    StaticTransformBroadcaster,
    TransformBroadcaster,
    compose,
    from_rpy,
)

_NANOSECONDS = 1_000_000_000
_FIXED_AHEAD = _NANOSECONDS // 2
_FREQUENCY = 50.0
_TURNING = frozenset({"revolute", "continuous"})
_MOVING = _TURNING | {"prismatic"}
_NO_ROTATION = (0.0, 0.0, 0.0, 1.0)


class RobotLink(msgspec.Struct, frozen=True):
    """A link, and the joint that it hangs on.

    Attributes:
        kind: Type of the joint, as URDF names it.
        origin: Pose of the joint in the parent.
        axis: Axis of the motion, of length 1.
        mimic: The joint that this one follows; None if it follows none.
    """

    parent: str
    child: str
    joint: str
    kind: str
    origin: Pose
    axis: tuple[float, float, float]
    mimic: Mimic | None = None

    @property
    def moves(self) -> bool:
        """Whether the pose depends on the position of the joint."""
        return self.kind in _MOVING

    def pose(self, position: float = 0.0) -> Pose:
        """Return the pose in the parent at a position of the joint, in radians or metres."""
        if not self.moves:
            return self.origin
        x, y, z = self.axis
        if self.kind not in _TURNING:
            moved = Pose((x * position, y * position, z * position), _NO_ROTATION)
            return compose(self.origin, moved)
        sine, cosine = math.sin(position / 2), math.cos(position / 2)
        return compose(self.origin, Pose((0.0, 0.0, 0.0), (x * sine, y * sine, z * sine, cosine)))


def read_links(description: object) -> list[RobotLink]:
    """Return the links of a URDF that have a parent, without those on floating joints."""
    robot = parse_description(description)
    if robot.tag != "robot":
        raise DescriptionError(
            f"the description of the robot has <{robot.tag}>; expected <robot> (URDF)"
        )
    names = {link.get("name", "") for link in robot.findall("link")}
    links = [_read(joint, names) for joint in robot.findall("joint")]
    return [link for link in links if link.kind != "floating"]


def _read(joint: ET.Element, names: set[str]) -> RobotLink:
    name = joint.get("name", "")
    ends = {}
    for role in ("parent", "child"):
        element = joint.find(role)
        ends[role] = "" if element is None else element.get("link", "")
        if ends[role] not in names:
            raise DescriptionError(
                f"joint '{name}': its {role} '{ends[role]}' is not a link of the robot"
            )
    origin, axis = joint.find("origin"), joint.find("axis")
    try:
        roll, pitch, yaw = _numbers(origin, "rpy", "0 0 0")
        pose = Pose(_numbers(origin, "xyz", "0 0 0"), from_rpy(roll, pitch, yaw))
        direction = _numbers(axis, "xyz", "1 0 0")
        mimic = Mimic.of(joint)
    except ValueError as error:
        raise DescriptionError(f"joint '{name}': {error}; expected three numbers") from error
    length = math.hypot(*direction) or 1.0
    return RobotLink(
        ends["parent"],
        ends["child"],
        name,
        joint.get("type", ""),
        pose,
        (direction[0] / length, direction[1] / length, direction[2] / length),
        mimic,
    )


def _numbers(element: ET.Element | None, name: str, default: str) -> tuple[float, float, float]:
    text = default if element is None else element.get(name, default)
    x, y, z = map(float, text.split())
    return x, y, z


class RobotStatePublisher:
    """Publish the frames of the robot that the parameters of a node describe.

    Raises:
        DescriptionError: The description is missing or not valid.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        params = node.params
        links = read_links(self._searched("robot_description"))
        self._prefix = str(self._searched("tf_prefix") or "").strip("/")
        self._ignore_stamp = bool(params.get("~ignore_timestamp", False))
        frequency = float(params.get("~publish_frequency", _FREQUENCY))
        if frequency <= 0:
            raise DescriptionError(f"~publish_frequency is {frequency:g}; expected above 0")
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

    def _searched(self, name: str) -> object:
        path = self._node.params.search(name)
        return None if path is None else self._node.params.get(path)

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
        transforms: list[TransformStamped] = []
        for link in self._moving.values():
            position = positions.get(link.joint)
            if link.mimic is not None and link.mimic.parent in positions:
                position = positions[link.mimic.parent] * link.mimic.factor + link.mimic.offset
            if position is not None:
                transforms.append(self._transform(link, position, stamp))
        return transforms

    def _transform(self, link: RobotLink, position: float, stamp: int) -> TransformStamped:
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
        except DescriptionError as error:
            sys.exit(f"robot_state_publisher: {error}")
        node.spin()
