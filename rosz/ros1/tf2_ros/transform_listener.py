"""tf2_ros.transform_listener: filling a buffer from the network."""

from __future__ import annotations

from typing import Any

from rosz.ros1.tf2_ros.buffer import Buffer
from rosz.ros1.tf2_ros.transform_broadcaster import node_of
from rosz.transforms import TransformListener as _Listener

__all__ = ("TransformListener",)


class TransformListener:
    """Receive transforms and put them into a buffer.

    Args:
        buffer: Buffer to fill.
        node: An rclpy node; the node of the process when not given. The options of rospy are
            ignored.
    """

    def __init__(self, buffer: Buffer, node: Any = None, **_options: Any) -> None:
        self.buffer: Buffer = buffer
        listening = node_of(node)
        buffer.clock = listening.clock
        self._listener = _Listener(buffer.frames, listening)

    def unregister(self) -> None:
        """Close the subscriptions."""
        self._listener.close()
