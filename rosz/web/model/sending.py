"""Publishing messages from a page, once or at a rate, and calling services."""

from __future__ import annotations

import threading
import time
from functools import partial
from typing import Any

from rosz.access import PagePolicy
from rosz.graph import View
from rosz.introspect import find_server
from rosz.message import strify_message
from rosz.node import Node, Publisher
from rosz.node.ros2 import request_type
from rosz.web.model.forms import read_form
from rosz.worker import Worker, run_task

_TIMEOUT = 30.0


class Sending:
    """Publishes messages of a page on one topic, until closed.

    Args:
        node: The node that publishes.
        permission: The changes that the page may make.
        topic: Full name of the topic.
        type_name: Type of its messages.

    Attributes:
        topic: Full name of the topic.
        named: The topic and the type.
        sent: Number of messages that were published.

    Raises:
        InvalidName: The name of the topic is not legal.
        TypeNotFound: The type does not exist.
        UsageError: The page may not publish the topic.
    """

    def __init__(self, node: Node, permission: PagePolicy, topic: str, type_name: str) -> None:
        self.topic: str = node.resolve(topic)
        self.named: tuple[str, str] = (self.topic, type_name)
        permission.check("publish", self.topic)
        self._node = node
        self._cls = node.context.types.message(type_name)
        self._publisher: Publisher[Any] = node.publisher(self.topic, self._cls, queue_size=10)
        self._worker = Worker("rosz-web-publish", run_task)
        self._lock = threading.Lock()
        self._message: Any = None
        self._period = 0.0
        self._due = 0.0
        self._repeats = 0
        self.sent: int = 0

    @property
    def repeats(self) -> bool:
        """Whether a message is being published at a rate."""
        return self._message is not None

    def send(self, text: str) -> None:
        """Publish a message once; errors are those of `read_form`."""
        self._publisher.publish(read_form(self._cls, text, self._node.now()))
        self.sent += 1

    def repeat(self, text: str, rate: float) -> None:
        """Publish a message at a rate in hertz; errors are those of `read_form`."""
        message = read_form(self._cls, text, self._node.now())
        with self._lock:
            self._message, self._period, self._due = message, 1 / rate, time.monotonic()
            self._repeats += 1
            turn = partial(self._turn, self._repeats)
        self._worker.submit(turn)

    def stop(self) -> None:
        """Stop publishing at a rate."""
        with self._lock:
            self._message = None

    def _turn(self, repeat: int) -> None:
        with self._lock:
            message = self._message
            # A turn of an earlier call of `repeat` may still be waiting for its time.
            if message is None or repeat != self._repeats:
                return
            # Missed turns are dropped, so that no burst follows a late turn.
            self._due = max(self._due + self._period, time.monotonic())
            wait = self._due - time.monotonic()
        self._publisher.publish(message)
        self.sent += 1
        self._worker.later(wait, partial(self._turn, repeat))

    def close(self) -> None:
        """Stop publishing, and close the publisher."""
        self.stop()
        self._worker.close()
        self._publisher.close()


def call_service(node: Node, permission: PagePolicy, view: View, name: str, text: str) -> str:
    """Call a service, and return its response as text.

    Args:
        node: The node that calls the service.
        permission: The rights of the page.
        view: The graph, in which the server is looked up.
        name: Full name of the service.
        text: The request in YAML.

    Raises:
        NotFoundError: No node has the service.
        UsageError: The text is not YAML, or the page may not call the service.
        EncodeError: A value does not fit the request.
        ServiceError: The server raised an error.
        WaitTimeout: The server did not reply in time.
    """
    permission.check("call", name)
    cls = request_type(node, find_server(view, name))
    request = read_form(cls.Request, text, node.now())
    with node.client(name, cls, timeout=_TIMEOUT) as client:
        response = client.call(request)
    return strify_message(response) if response.__slots__ else ""
