"""tf2_ros.static_transform_broadcaster: publishing transforms of frames that do not move."""

from __future__ import annotations

from typing import Any

from rosz.ros1.tf2_ros.transform_broadcaster import node_of
from rosz.transforms import StaticTransformBroadcaster as _StaticBroadcaster

__all__ = ("StaticTransformBroadcaster",)


class StaticTransformBroadcaster:
    """Publish transforms of static frames, also to late subscriptions.

    Args:
        node: An rclpy node; the node of the process when not given.
    """

    def __init__(self, node: Any = None) -> None:
        self._broadcaster = _StaticBroadcaster(node_of(node))

    def sendTransform(self, transform: Any) -> None:  # noqa: N802  # ROS 1's
        """Publish one TransformStamped or several."""
        self._broadcaster.send(transform)
