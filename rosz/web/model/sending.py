"""Publishing from a page: once, or at a rate until it stops or closes."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING, Any

from rosz.web.model.forms import read_form
from rosz.web.model.permission import Permission
from rosz.worker import Worker, run_task

if TYPE_CHECKING:
    from rosz.node import Node, Publisher

__all__ = ("Sending",)


class Sending:
    """Publishes messages of a page on one topic, until it is closed.

    Args:
        node: The node that publishes.
        permission: What the page may change.
        topic: Full name of the topic.
        type_name: Type of its messages.

    Attributes:
        topic: Full name of the topic.
        named: The topic and the type.
        sent: Number of messages that were published.

    Raises:
        InvalidName: The name is not legal.
        TypeNotFound: The type does not exist.
        UsageError: The page may not publish it.
    """

    def __init__(self, node: Node, permission: Permission, topic: str, type_name: str) -> None:
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
        self.sent: int = 0

    @property
    def repeats(self) -> bool:
        """Whether it publishes at a rate."""
        return self._message is not None

    def send(self, text: str) -> None:
        """Publish a message once; errors are those of `read_form`."""
        self._publisher.publish(read_form(self._cls, text, self._node.now()))
        self.sent += 1

    def repeat(self, text: str, rate: float) -> None:
        """Publish a message at a rate in hertz; errors are those of `read_form`."""
        message = read_form(self._cls, text, self._node.now())
        with self._lock:
            running, self._message = self._message is not None, message
            self._period = 1 / rate
            self._due = time.monotonic()
        if not running:
            self._worker.submit(self._turn)

    def stop(self) -> None:
        """Publish no more."""
        with self._lock:
            self._message = None

    def _turn(self) -> None:
        with self._lock:
            message = self._message
            if message is None:
                return
            # A turn that comes late does not make the next one early.
            self._due = max(self._due + self._period, time.monotonic())
            wait = self._due - time.monotonic()
        self._publisher.publish(message)
        self.sent += 1
        self._worker.later(wait, self._turn)

    def close(self) -> None:
        """Publish no more, and withdraw the publisher."""
        self.stop()
        self._worker.close()
        self._publisher.close()
