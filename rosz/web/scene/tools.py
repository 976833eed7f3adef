"""The tools of the view, which publish where one points: as rviz's do, on the same topics."""

from __future__ import annotations

import math
from typing import Any

import msgspec

from rosz.access import PagePolicy
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs import msg as geometry
from rosz.msgs.std_msgs.msg import Header
from rosz.node import Node, Publisher
from rosz.transforms import from_rpy


class Tool(msgspec.Struct, frozen=True):
    """A tool, with the topic that it publishes and a hint for the user."""

    title: str
    topic: str
    kind: type[Any]
    hint: str


_PULL = "Press where it is, and pull to where it looks."
TOOLS = {
    "estimate": Tool("Pose estimate", "/initialpose", geometry.PoseWithCovarianceStamped, _PULL),
    "goal": Tool("Goal", "/move_base_simple/goal", geometry.PoseStamped, _PULL),
    "point": Tool("Point", "/clicked_point", geometry.PointStamped, "Click a point."),
}
_POSITION_VARIANCE = 0.5 * 0.5
_YAW_VARIANCE = (math.pi / 12) ** 2


def _covariance() -> list[float]:
    """Return the covariance of rviz: half a metre, and fifteen degrees."""
    values = [0.0] * 36
    values[0] = values[7] = _POSITION_VARIANCE
    values[35] = _YAW_VARIANCE
    return values


class Tools:
    """Publishes what tools point at.

    Args:
        node: The node that publishes.
        permission: The changes that the page may make.
    """

    def __init__(self, node: Node, permission: PagePolicy) -> None:
        self._node = node
        self._permission = permission
        self._publishers: dict[str, Publisher[Any]] = {}

    def take(self, name: str) -> None:
        """Declare the publisher of a tool, so that others know it when it publishes.

        Raises:
            UsageError: The page may not publish its topic.
        """
        tool = TOOLS[name]
        self._permission.check("publish", tool.topic)
        if name not in self._publishers:
            self._publishers[name] = self._node.publisher(tool.topic, tool.kind, queue_size=1)

    def send(self, name: str, frame: str, point: tuple[float, float, float], yaw: float) -> None:
        """Publish where a tool points.

        Args:
            name: Name of the tool.
            frame: The fixed frame.
            point: Where, in metres.
            yaw: Direction in radians.

        Raises:
            UsageError: The page may not publish its topic.
        """
        self.take(name)
        header = Header(stamp=Time.from_nsec(self._node.now()), frame_id=frame)
        place = geometry.Point(*point)
        message: Any = geometry.PointStamped(header, place)
        pose = geometry.Pose(place, geometry.Quaternion(*from_rpy(0.0, 0.0, yaw)))
        if name == "estimate":
            message = geometry.PoseWithCovarianceStamped(
                header, geometry.PoseWithCovariance(pose, _covariance())
            )
        elif name == "goal":
            message = geometry.PoseStamped(header, pose)
        self._publishers[name].publish(message)

    def close(self) -> None:
        """Withdraw the publishers."""
        publishers, self._publishers = self._publishers, {}
        for publisher in publishers.values():
            publisher.close()
