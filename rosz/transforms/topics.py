"""The topics ``/tf`` and ``/tf_static``: broadcasters, and a listener that fills a buffer."""

from __future__ import annotations

from collections.abc import Iterable
from copy import deepcopy
from functools import partial
from typing import Any, Protocol

from rosz.errors import TransformArgument
from rosz.graph import View
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.std_msgs.msg import Header
from rosz.msgs.tf2_msgs.msg import TFMessage
from rosz.node import MessageInfo, Node
from rosz.qos import QoS
from rosz.session import clamp_timeout
from rosz.transforms.buffer import Buffer
from rosz.transforms.conversions import transform_message
from rosz.transforms.poses import Pose
from rosz.wire import format_token, gid

_QUEUE = QoS(depth=100)  # as in tf2_ros: many broadcasters share the topic
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
        for stamped in _as_list(transform):
            self._sent[stamped.child_frame_id] = deepcopy(stamped)  # the caller may change it
        self._publisher.publish(TFMessage(list(self._sent.values())))


def pose_of(transform: Any) -> Pose:
    """Return the pose of a geometry_msgs/Transform."""
    t, r = transform.translation, transform.rotation
    return Pose((t.x, t.y, t.z), (r.x, r.y, r.z, r.w))


class Observe(Protocol):
    """A function that is called with the transforms of each message, after they are stored."""

    def __call__(self, transforms: list[Any], publisher: bytes, /, *, static: bool) -> object:
        """Take the transforms, and the GID of their publisher."""


class TransformListener:
    """Receive transforms and put them into a buffer, until closed.

    When simulated time jumps back, the buffer is cleared.

    Args:
        buffer: Buffer to fill.
        node: Node of the subscriptions.
        observe: Function called with the transforms that come.
    """

    def __init__(self, buffer: Buffer, node: Node, observe: Observe | None = None) -> None:
        self.buffer: Buffer = buffer
        self._node = node
        self._observe = observe
        self._topics = tuple(map(node.resolve, ("/tf", "/tf_static")))
        self._authorities: dict[bytes, str] = {}
        self._view: View | None = None
        self._remove_hook = node.clock.on_jump(lambda _: buffer.clear())
        self._subscriptions = [
            node.subscription(
                topic,
                TFMessage,
                partial(self._receive, static=static),
                queue_size=_QUEUE.depth,
                qos=qos,
                with_info=True,
            )
            for topic, static, qos in (("/tf", False, None), ("/tf_static", True, _STATIC_QUEUE))
        ]

    def _receive(self, message: TFMessage, info: MessageInfo, *, static: bool) -> None:
        # A message may arrive before the token of its publisher.
        authority = self.node_of(info.gid) or partial(self.node_of, info.gid)
        for transform in message.transforms:
            stamp = transform.header.stamp.sec * 10**9 + transform.header.stamp.nanosec
            try:
                self.buffer.set(
                    transform.header.frame_id,
                    transform.child_frame_id,
                    stamp,
                    pose_of(transform.transform),
                    static=static,
                    authority=authority,
                )
            except TransformArgument as error:
                self._node.log.warning("%s", error, throttle_identical=10.0)
        if self._observe is not None:
            self._observe(message.transforms, info.gid, static=static)

    def lookup(
        self, target: str, source: str, stamp: int = 0, *, timeout: float = 0.0
    ) -> tuple[Pose, int]:
        """Return the transform from one frame to another, and its time; see `Buffer.lookup`.

        Args:
            target: Frame to transform coordinates to.
            source: Frame of the coordinates.
            stamp: Time in nanoseconds; 0 for the latest time at which all transforms are known.
            timeout: Longest time to wait for the transform, in seconds of the node's clock.

        Raises:
            TransformError: The transform is not known.
            UsageError: The timeout is not a number.
        """
        if timeout:
            self.can_transform(target, source, stamp, timeout=timeout)
        return self.buffer.lookup(target, source, stamp)

    def can_transform(
        self, target: str, source: str, stamp: int = 0, *, timeout: float = 0.0
    ) -> bool:
        """Return whether a transform is known; the arguments are those of `lookup`."""
        limit = round(clamp_timeout(timeout) * 1e9)

        def known() -> bool:
            return not self.buffer.why_not(target, source, stamp)

        return self.buffer.wait(known, limit, self._node.clock) if limit else known()

    def transform(self, message: Any, target: str, *, timeout: float = 0.0) -> Any:
        """Return a stamped message in another frame; see `transform_message`.

        Args:
            message: A ``PointStamped``, ``PoseStamped``, ``Vector3Stamped``, ``WrenchStamped`` or
                ``PointCloud2``.
            target: Frame to transform it to.
            timeout: Longest time to wait for the transform, in seconds of the node's clock.

        Raises:
            TransformError: The transform is not known.
            UsageError: Messages of that type cannot be transformed.
        """
        header = message.header
        stamp = header.stamp.sec * 10**9 + header.stamp.nanosec
        pose, time = self.lookup(target, header.frame_id, stamp, timeout=timeout)
        moved = Header(stamp=Time.from_nsec(time), frame_id=target)
        return transform_message(message, pose, moved)

    def node_of(self, publisher: bytes) -> str:
        """Return the full name of the node of a publisher; empty if it is not known.

        Args:
            publisher: GID of the publisher.
        """
        authority = self._authorities.get(publisher)
        if authority is not None:
            return authority
        view = self._node.context.graph.view()
        if view is not self._view:  # a GID is computed from a token, which takes time
            self._view = view
            tokens = (token for topic in self._topics for token in view.publishers(topic))
            self._authorities |= {gid(format_token(token)): token.node_name for token in tokens}
        return self._authorities.get(publisher, "")

    def close(self) -> None:
        """Close the subscriptions."""
        self._remove_hook()
        for subscription in self._subscriptions:
            subscription.close()
