"""joint_state_publisher: the states of a robot's joints, from its description and other topics.

Its parameters are those of ROS 1 (ROS wiki, joint_state_publisher), private or in the node's
namespace. There is no window.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from typing import Any
from xml.etree import ElementTree as ET

import msgspec

from rosz.errors import RoszError
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.sensor_msgs.msg import JointState
from rosz.node import Node, serve_loggers

_RIGID = frozenset({"fixed", "floating", "planar"})
_STATE = ("position", "velocity", "effort")
"""Parts of the state of a joint: attributes of the joint, and fields of JointState."""


class DescriptionError(RoszError):
    """The description of the robot, or a parameter about it, cannot be used."""


class Joint(msgspec.Struct):
    """A joint with a state of its own, within limits.

    A part of the state is None until another topic has it, if it has no default.

    Attributes:
        continuous: Whether it goes on at the lower limit when it has reached the upper one.
        forward: Whether ``delta`` moves it forward.
    """

    least: float
    most: float
    position: float | None = None
    velocity: float | None = None
    effort: float | None = None
    continuous: bool = False
    forward: bool = True

    def move(self, delta: float) -> None:
        """Move within the limits, there and back; a continuous joint turns on."""
        moved = (self.position or 0.0) + (delta if self.forward else -delta)
        if self.continuous and moved > self.most:
            moved = self.least
        elif not self.least <= moved <= self.most:
            self.forward = not self.forward
            moved = min(max(moved, self.least), self.most)
        self.position = moved


class Mimic(msgspec.Struct, frozen=True):
    """A joint that follows another one; the offset is in radians or metres."""

    parent: str
    factor: float = 1.0
    offset: float = 0.0

    @classmethod
    def of(cls, joint: ET.Element) -> Mimic | None:
        """Return the ``<mimic>`` of a joint; None if it has none.

        Raises:
            ValueError: A number in it is not one.
        """
        mimic = joint.find("mimic")
        if mimic is None:
            return None
        factor, offset = float(mimic.get("multiplier", 1)), float(mimic.get("offset", 0))
        return cls(mimic.get("joint", ""), factor, offset)


def parse_description(description: object) -> ET.Element:
    """Return the root element of the value of ``robot_description``, which has to be XML."""
    if not isinstance(description, str):
        raise DescriptionError(
            "parameter 'robot_description' is not set, or is not a text: it is the URDF of the"
            ' robot, such as <param name="robot_description" command="xacro FILE"/>'
        )
    try:
        return ET.fromstring(description)  # noqa: S314  # a parameter of this system
    except ET.ParseError as error:
        raise DescriptionError(f"parameter 'robot_description' is not XML: {error}") from error


class JointStatePublisher:
    """Publish the states of all joints of the robot that the parameters of a node describe.

    Raises:
        DescriptionError: The description is missing or not valid, or its joints form a ring.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self.joints: dict[str, Joint] = {}
        self.mimics: dict[str, Mimic] = {}
        self.names: list[str] = []
        for name, given in (self._param("dependent_joints", {}) or {}).items():
            self.mimics[name] = _mimic(name, given)
        self._read(parse_description(self._param("robot_description", None)))
        self._followed = {name: self._follow(name) for name in self.names if name in self.mimics}
        self._publisher = node.publisher("joint_states", JointState, queue_size=5)
        for topic in self._param("source_list", []) or []:
            node.subscription(topic, JointState, self.hear)

    def _param(self, name: str, default: Any) -> Any:
        params = self._node.params
        return params.get(f"~{name}", None) if params.has(f"~{name}") else params.get(name, default)

    def _read(self, robot: ET.Element) -> None:
        """Read the joints of a URDF, or of a COLLADA document."""
        if robot.tag.rpartition("}")[2] == "COLLADA":
            self._read_collada(robot)
            return
        model = robot if robot.tag == "robot" else robot.find(".//robot")
        if model is None:
            raise DescriptionError(
                f"parameter 'robot_description' has <{robot.tag}>; expected <robot> (URDF)"
            )
        for element in model.findall("joint"):
            kind = element.get("type", "")
            if kind not in _RIGID:
                self._read_joint(element, element.get("name", ""), kind)

    def _read_joint(self, element: ET.Element, name: str, kind: str) -> None:
        self.names.append(name)
        least, most = -math.pi, math.pi
        if kind != "continuous":
            limit = element.find("limit")
            try:
                least, most = (float(limit.get(side, "")) for side in ("lower", "upper"))  # type: ignore[union-attr]
            except (AttributeError, ValueError):
                self._node.log.warning(
                    "%s is not fixed, nor continuous, but limits are not specified!", name
                )
                return
        safety = element.find("safety_controller")
        if safety is not None and self._param("use_smallest_joint_limits", True):
            least = max(least, float(safety.get("soft_lower_limit", least)))
            most = min(most, float(safety.get("soft_upper_limit", most)))
        mimic = Mimic.of(element) if self._param("use_mimic_tags", True) else None
        if mimic is not None:
            self.mimics[name] = mimic
        if name in self.mimics:
            return
        zero = self._param(f"zeros/{name}", None)
        if not zero:
            zero = (most + least) / 2 if least > 0 or most < 0 else 0.0
        self.joints[name] = Joint(
            least,
            most,
            float(zero) if self._param("publish_default_positions", True) else None,
            0.0 if self._param("publish_default_velocities", False) else None,
            0.0 if self._param("publish_default_efforts", False) else None,
            continuous=kind == "continuous",
        )

    def _read_collada(self, robot: ET.Element) -> None:
        model = robot.find(".//{*}kinematics_model/{*}technique_common")
        for element in () if model is None else model.findall("{*}joint"):
            limits = element.find("{*}revolute/{*}limits")
            ends = [] if limits is None else [limits.find("{*}min"), limits.find("{*}max")]
            values = [float(end.text) for end in ends if end is not None and end.text]
            if len(values) == len(("min", "max")) and values[0] != values[1]:
                name = element.get("name", "")
                self.names.append(name)
                least, most = map(math.radians, values)
                self.joints[name] = Joint(least, most, 0.0, 0.0, 0.0)

    def _follow(self, name: str) -> Mimic:
        """Return the free joint that a joint follows, also by way of others."""
        mimic = self.mimics[name]
        seen = [name]
        while mimic.parent in self.mimics:
            if mimic.parent in seen:
                ring = ", ".join([*seen, mimic.parent])
                raise DescriptionError(f"Found an infinite recursive mimic chain: [{ring}]")
            seen.append(mimic.parent)
            above = self.mimics[mimic.parent]
            mimic = Mimic(
                above.parent,
                mimic.factor * above.factor,
                mimic.offset + mimic.factor * above.offset,
            )
        if mimic.parent not in self.joints:
            raise DescriptionError(f"joint '{name}' follows '{mimic.parent}', which is not a joint")
        return mimic

    def hear(self, message: JointState) -> None:
        """Take the states of joints from a message of another node."""
        for index, name in enumerate(message.name):
            joint = self.joints.get(name)
            if joint is None:
                continue
            for field in _STATE:
                if len(values := getattr(message, field)):
                    setattr(joint, field, values[index])

    def state(self) -> JointState:
        """Return the states of all joints at this time."""
        message = JointState(name=list(self.names))
        message.header.stamp = Time.from_nsec(self._node.now())
        for field in _STATE:
            is_given = any(getattr(joint, field) is not None for joint in self.joints.values())
            if is_given or (field == "position" and self.mimics):
                setattr(message, field, self._values(field))
        return message

    def _values(self, field: str) -> list[float]:
        values = []
        for name in self.names:
            mimic = self._followed.get(name) or Mimic(name)
            joint = self.joints.get(mimic.parent)
            value = None if joint is None else getattr(joint, field)
            if value is not None and field != "effort":
                value *= mimic.factor
                value += mimic.offset if field == "position" else 0.0
            values.append(value or 0.0)
        return values

    def run(self) -> None:
        """Publish at ``rate`` until the node is shut down."""
        delta = self._param("delta", 0.0)
        for _ in self._node.rate(self._param("rate", 10)):
            if delta > 0:
                for joint in self.joints.values():
                    joint.move(delta)
            if self.names:
                self._publisher.publish(self.state())


def _mimic(name: str, given: Any) -> Mimic:
    if not isinstance(given, Mapping) or "parent" not in given:
        raise DescriptionError(
            f"parameter 'dependent_joints/{name}' is {given!r}; expected a dict with 'parent', and"
            " maybe 'factor' and 'offset'"
        )
    return Mimic(str(given["parent"]), float(given.get("factor", 1)), float(given.get("offset", 0)))


def main() -> None:
    """Publish joint states until the node is shut down."""
    with Node("joint_state_publisher") as node:
        serve_loggers(node)
        try:
            publisher = JointStatePublisher(node)
        except DescriptionError as error:
            sys.exit(f"joint_state_publisher: {error}")
        publisher.run()
