"""The topics that one client publishes and subscribes to."""

from __future__ import annotations

import threading
from typing import Any

from rosz.bridges.rosbridge import operations as ops
from rosz.bridges.rosbridge.encoded import SubscribedQueue
from rosz.bridges.rosbridge.messages import build_from_json
from rosz.bridges.rosbridge.state import ClientState
from rosz.introspect import is_log, to_ros2_log
from rosz.msgs.rosgraph_msgs.msg import Log
from rosz.node import Publisher


class TopicOperations:
    """Performs the operations of a client with topics."""

    def __init__(self, state: ClientState) -> None:
        self._state = state
        self._shared = state.shared
        self._topics = state.shared.topics
        self._lock = threading.RLock()
        self._closed = False
        self._queues: dict[str, SubscribedQueue] = {}
        self._publishers: dict[str, Publisher[Any]] = {}
        self._advertisements: dict[str, set[str]] = {}

    def advertise(self, operation: ops.Advertise) -> None:
        """Publish a topic.

        Raises:
            RoszError: The client may not, or the type is not known or another one.
        """
        self._state.spelling_of(operation.type)
        topic = self._shared.node.resolve(operation.topic)
        self._shared.policy.check("publish", topic)
        if topic not in self._publishers:
            self._shared.limits.check("advertisements", len(self._publishers))
        cls = self._topics.message_class(topic, operation.type)
        with self._lock:
            if not self._closed:
                self._advertisements.setdefault(topic, set()).add(str(operation.id))
                self._publishers[topic] = self._topics.advertise(
                    topic, cls, latch=operation.latch, client=self
                )
        self._shared.gateways.want(topic, cls, self)

    def unadvertise(self, operation: ops.Unadvertise) -> None:
        """Publish a topic no longer."""
        topic = self._shared.node.resolve(operation.topic)
        others = self._advertisements.get(topic, set())
        if operation.id is not None and others - {str(operation.id)}:
            others.discard(str(operation.id))
            return
        self._advertisements.pop(topic, None)
        self._publishers.pop(topic, None)
        if not self._topics.unadvertise(self, topic):
            text = f"unadvertise: '{topic}' is not advertised"
            self._state.report("warning", text, operation.id)

    def publish(self, operation: ops.Publish) -> None:
        """Publish a message.

        Raises:
            RoszError: The client may not, or the message does not fit.
        """
        topic = self._shared.node.resolve(operation.topic)
        if topic not in self._publishers:
            type_name = operation.type or self._topics.type_of(topic)
            spelling = self._state.spelling
            self.advertise(ops.Advertise(topic=topic, type=type_name, latch=operation.latch))
            if not operation.type:
                self._state.spelling = spelling
        publisher, spelling = self._publishers[topic], self._state.spelling
        cls, now = publisher.message_type, self._shared.node.now()
        self._shared.gateways.want(topic, cls, self)
        if spelling == "ros1" and is_log(topic, cls):
            publisher.publish(to_ros2_log(build_from_json(Log, operation.msg, spelling, now)))
        else:
            publisher.publish(build_from_json(cls, operation.msg, spelling, now))

    def subscribe(self, operation: ops.Subscribe) -> None:
        """Subscribe to a topic.

        Raises:
            RoszError: The client may not, or the type is not known or another one.
        """
        spelling = self._state.spelling_of(operation.type)
        topic = self._shared.node.resolve(operation.topic)
        self._shared.policy.check("subscribe", topic)
        if topic not in self._queues:
            self._shared.limits.check("subscriptions", len(self._queues))
        cls = self._topics.message_class(topic, operation.type) if operation.type else None
        queue = self._queues.get(topic) or SubscribedQueue()
        queue.adapt({**queue.requests, str(operation.id): operation}, spelling)
        self._topics.subscribe(topic, cls, queue, self._state.queue.offer)
        with self._lock:
            if not self._closed:
                self._queues[topic] = queue
                return
        self._topics.unsubscribe(queue)

    def unsubscribe(self, operation: ops.Unsubscribe) -> None:
        """End one subscription of a topic, or all without an id."""
        topic = self._shared.node.resolve(operation.topic)
        number = None if operation.id is None else str(operation.id)
        queue = self._queues.get(topic)
        if queue is None or (number is not None and number not in queue.requests):
            text = f"unsubscribe: '{topic}' is not subscribed"
            self._state.report("warning", text, operation.id)
            return
        others = {key: kept for key, kept in queue.requests.items() if number not in (None, key)}
        if others:
            queue.adapt(others, queue.form[1])
            return
        with self._lock:
            self._queues.pop(topic, None)
        self._topics.unsubscribe(queue)
        self._state.queue.drop(queue)

    def close(self) -> None:
        """End all subscriptions and publishers."""
        with self._lock:
            self._closed = True
            queues = list(self._queues.values())
            self._queues.clear()
        for queue in queues:
            self._topics.unsubscribe(queue)
        self._topics.unadvertise(self)
        self._shared.gateways.leave(self)
