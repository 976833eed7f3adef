"""The topics ``/tf`` and ``/tf_static``: broadcasters, and a listener that fills a buffer."""

from __future__ import annotations

from collections.abc import Iterable
from copy import deepcopy
from functools import partial
from typing import Any

from rosz.errors import TransformArgument
from rosz.msgs.tf2_msgs.msg import TFMessage
from rosz.node import Node
from rosz.qos import QoS
from rosz.transforms.buffer import Buffer
from rosz.transforms.poses import Pose

__all__ = ("StaticTransformBroadcaster", "TransformBroadcaster", "TransformListener", "pose_of")

_QUEUE = QoS(depth=100)
_STATIC_PUBLISHER = QoS(depth=1, durability="transient_local")
_STATIC_QUEUE = QoS(depth=100, durability="transient_local")


def _as_list(transform: Any) -> list[Any]:
    return list(transform) if isinstance(transform, Iterable) else [transform]


class TransformBroadcaster:
    """Publish transforms of moving frames on ``/tf``.

    Args:
        node: Node of the publisher.
    """

    def __init__(self, node: Node) -> None:
        self._publisher = node.publisher("/tf", TFMessage, qos=_QUEUE)

    def send(self, transform: Any) -> None:
        """Publish one TransformStamped or several."""
        self._publisher.publish(TFMessage(_as_list(transform)))


class StaticTransformBroadcaster:
    """Publish transforms of static frames on ``/tf_static``, also to late subscriptions.

    Args:
        node: Node of the publisher.
    """

    def __init__(self, node: Node) -> None:
        self._sent: dict[str, Any] = {}
        self._publisher = node.publisher("/tf_static", TFMessage, qos=_STATIC_PUBLISHER)

    def send(self, transform: Any) -> None:
        """Publish one TransformStamped or several, together with all earlier ones."""
        for one in _as_list(transform):
            self._sent[one.child_frame_id] = deepcopy(one)  # the caller may change it
        self._publisher.publish(TFMessage(list(self._sent.values())))


def pose_of(transform: Any) -> Pose:
    """Return the pose of a geometry_msgs/Transform."""
    t, r = transform.translation, transform.rotation
    return Pose((t.x, t.y, t.z), (r.x, r.y, r.z, r.w))


class TransformListener:
    """Receive transforms and put them into a buffer, until closed.

    When simulated time jumps back, the buffer is cleared.

    Args:
        buffer: Buffer to fill.
        node: Node of the subscriptions.
    """

    def __init__(self, buffer: Buffer, node: Node) -> None:
        self.buffer: Buffer = buffer
        self._node = node
        self._remove_hook = node.clock.on_jump(lambda _: buffer.clear())
        self._subscriptions = [
            node.subscription(topic, TFMessage, partial(self._receive, static=static), qos=qos)
            for topic, static, qos in (("/tf", False, _QUEUE), ("/tf_static", True, _STATIC_QUEUE))
        ]

    def _receive(self, message: TFMessage, *, static: bool) -> None:
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
        """Close the subscriptions."""
        self._remove_hook()
        for subscription in self._subscriptions:
            subscription.close()
