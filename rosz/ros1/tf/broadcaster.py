"""tf.broadcaster: telling others of frames."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rosz.msgs.geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from rosz.msgs.std_msgs.msg import Header
from rosz.ros1.tf2_ros import TransformBroadcaster as _Broadcaster

__all__ = ("TransformBroadcaster",)


class TransformBroadcaster:
    """Tells of frames that move.

    Args:
        queue_size: Not used.
    """

    def __init__(self, queue_size: int = 100) -> None:  # noqa: ARG002  # ROS 1's
        self._broadcaster = _Broadcaster()

    def sendTransform(  # noqa: N802  # ROS 1's
        self,
        translation: Sequence[float],
        rotation: Sequence[float],
        time: Any,
        child: str,
        parent: str,
    ) -> None:
        """Tell where a frame is in its parent.

        Args:
            translation: ``x, y, z`` in metres.
            rotation: ``x, y, z, w``.
            time: When.
            child: The frame.
            parent: Its parent.
        """
        transform = Transform(
            Vector3(*(float(part) for part in translation)),
            Quaternion(*(float(part) for part in rotation)),
        )
        self.sendTransformMessage(
            TransformStamped(Header(stamp=time, frame_id=parent), child, transform)
        )

    def sendTransformMessage(self, transform: Any) -> None:  # noqa: N802  # ROS 1's
        """Tell of a TransformStamped, or of several."""
        self._broadcaster.sendTransform(transform)
