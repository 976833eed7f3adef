"""rclpy.subscription: sinks of messages."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rosz.node import Node as RoszNode
from rosz.node import Subscription as RoszSubscription
from rosz.qos import QoS
from rosz.ros2.rclpy.callback_groups import CallbackGroup

if TYPE_CHECKING:
    from rosz.message import Message

__all__ = ("Subscription",)


class Subscription:
    """A sink of messages of a topic; made by ``Node.create_subscription``.

    As many messages as the profile is deep wait until an executor spins; newer ones push older ones
    out.
    """

    def __init__(
        self,
        node: RoszNode,
        topic: str,
        msg_type: type[Message],
        callback: Callable[[Any], Any],
        qos: QoS,
        *,
        raw: bool,
        group: CallbackGroup,
        wake: Callable[[], None],
    ) -> None:
        self.msg_type = msg_type
        self.callback = callback
        self.callback_group = group
        self._wake = wake
        depth = None if qos.history == "keep_all" else max(qos.depth, 1)
        self._waiting: deque[Any] = deque(maxlen=depth)
        self._subscription: RoszSubscription[Any] = node.subscription(
            topic, msg_type, self._arrived, qos=qos, raw=raw
        )

    def _arrived(self, message: Any) -> None:
        self._waiting.append(message)
        self._wake()

    def take(self) -> Callable[[], Any] | None:
        """Return what to call with the oldest message, if there is one."""
        try:
            message = self._waiting.popleft()
        except IndexError:
            return None
        return lambda: self.callback(message)

    @property
    def topic_name(self) -> str:
        """Full name of the topic."""
        return self._subscription.name

    def get_publisher_count(self) -> int:
        """Return how many publishers it hears."""
        return len(self._subscription.publishers())

    def destroy(self) -> None:
        """End it."""
        self._subscription.close()
        self._waiting.clear()
