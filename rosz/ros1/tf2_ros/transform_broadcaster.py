"""tf2_ros.transform_broadcaster: publishing transforms of moving frames."""

from __future__ import annotations

from typing import Any

from rosz.node import Node
from rosz.ros1 import state
from rosz.transforms import TransformBroadcaster as _Broadcaster

__all__ = ("TransformBroadcaster", "node_of")


def node_of(node: Any) -> Node:
    """Return rosz's node of an rclpy node, or the node of the process."""
    given: Node | None = getattr(node, "rosz_node", None)
    return state.node() if given is None else given


class TransformBroadcaster:
    """Publish transforms of moving frames.

    Args:
        node: An rclpy node; the node of the process when not given.
    """

    def __init__(self, node: Any = None) -> None:
        self._broadcaster = _Broadcaster(node_of(node))

    def sendTransform(self, transform: Any) -> None:  # noqa: N802  # ROS 1's
        """Publish one TransformStamped or several."""
        self._broadcaster.send(transform)
