"""rclpy.publisher: sources of messages."""

from __future__ import annotations

from typing import Any

from rosz.node import Publisher as RoszPublisher

__all__ = ("Publisher",)


class Publisher:
    """A source of messages on a topic; made by ``Node.create_publisher``."""

    def __init__(self, publisher: RoszPublisher[Any], qos_profile: Any) -> None:
        self._publisher = publisher
        self.msg_type = publisher.message_type
        self.qos_profile = qos_profile

    def publish(self, msg: Any) -> None:
        """Send a message, or bytes that are one already.

        Raises:
            EncodeError: A field has a value that does not fit.
            ClosedError: The publisher is destroyed, or its context is shut down.
        """
        if isinstance(msg, bytes):
            self._publisher.publish_raw(msg)
        else:
            self._publisher.publish(msg)

    @property
    def topic(self) -> str:
        """Full name of the topic."""
        return self._publisher.name

    topic_name = topic

    def get_subscription_count(self) -> int:
        """Return how many subscriptions hear it."""
        return len(self._publisher.subscribers())

    def destroy(self) -> None:
        """End it."""
        self._publisher.close()
