"""Hearing of transforms."""

from __future__ import annotations

from typing import Any

from rosz.errors import TransformArgument
from rosz.msgs.tf2_msgs.msg import TFMessage
from rosz.node import Node
from rosz.qos import QoS
from rosz.transforms.buffer import Buffer
from rosz.transforms.poses import Pose

__all__ = ("TransformListener", "pose_of")

_QUEUE = QoS(depth=100)
_STATIC = QoS(depth=100, durability="transient_local")


def pose_of(transform: Any) -> Pose:
    """Return what a geometry_msgs/Transform says."""
    t, r = transform.translation, transform.rotation
    return Pose((t.x, t.y, t.z), (r.x, r.y, r.z, r.w))


class TransformListener:
    """Puts what others tell into a buffer, until closed.

    When simulated time moves back, the buffer is cleared.

    Args:
        buffer: Where to put it.
        node: Who listens.
    """

    def __init__(self, buffer: Buffer, node: Node) -> None:
        self.buffer = buffer
        self._node = node
        self._withdraw = node.clock.on_jump(lambda _: buffer.clear())
        self._subscriptions = [
            node.subscription("/tf", TFMessage, self._moving, qos=_QUEUE),
            node.subscription("/tf_static", TFMessage, self._static, qos=_STATIC),
        ]

    def _moving(self, message: TFMessage) -> None:
        self._take(message, static=False)

    def _static(self, message: TFMessage) -> None:
        self._take(message, static=True)

    def _take(self, message: TFMessage, *, static: bool) -> None:
        for one in message.transforms:
            stamp = one.header.stamp.sec * 10**9 + one.header.stamp.nanosec
            try:
                self.buffer.set(
                    one.header.frame_id,
                    one.child_frame_id,
                    stamp,
                    pose_of(one.transform),
                    static=static,
                )
            except TransformArgument as error:
                self._node.log.warning("%s", error, throttle_identical=10.0)

    def close(self) -> None:
        """Listen no more."""
        self._withdraw()
        for subscription in self._subscriptions:
            subscription.close()
