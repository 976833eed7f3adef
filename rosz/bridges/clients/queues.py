"""The outgoing queue of a client: answers, and the newest messages of its subscriptions.

The queues of all clients share the messages as received. A message is encoded when it is sent, so a
client that does not read takes no processor time, and no memory beyond the limit.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from rosz.queue import BoundedQueue

M = TypeVar("M", bound="TopicMessage")


class TopicMessage:
    """A message of a topic as received from the network.

    Attributes:
        data: CDR of the message.
        received: Time of its arrival on the clock of the node, in nanoseconds.
        size: Size of the CDR in bytes.
    """

    def __init__(self, topic: str, cls: type[Any], data: bytes, received: int) -> None:
        self.data = data
        self.received = received
        self.size: int = len(data)
        self._topic = topic
        self._cls = cls


class TopicQueue(Generic[M]):
    """The messages of one topic that wait for one client.

    Args:
        depth: Largest number of messages. 0 means 1 if there is a period, otherwise as many as
            the outgoing queue holds.

    Attributes:
        period: Shortest time between two messages, in seconds; 0 for no limit.
        messages: Messages that wait, the oldest first; only the outgoing queue changes it.
        due: Earliest time to send the next message, on the monotonic clock.
        closed: Whether the outgoing queue has dropped this queue.
    """

    def __init__(self, depth: int = 0) -> None:
        self.depth = depth
        self.period: float = 0.0
        self.messages: BoundedQueue[M] = BoundedQueue()
        self.due: float = 0.0
        self.closed: bool = False


class OutgoingQueue(Generic[M]):
    """The outgoing queue of one client.

    Args:
        limit: Largest number of bytes of the messages that wait, and of the answers. Beyond it,
            the oldest messages of a topic are dropped, but never its newest. If the answers exceed
            it, the next answer ends the connection.
        wake: Function called when there is something to send.
        overflow: Function called when there are too many answers.
    """

    def __init__(
        self, limit: int, wake: Callable[[], object], overflow: Callable[[], object]
    ) -> None:
        self._limit = limit
        self._wake = wake
        self._overflow = overflow
        self._lock = threading.Lock()
        self._answers: deque[bytes] = deque()
        self._ready: deque[TopicQueue[M]] = deque()
        self._answered = 0
        self._size = 0
        self._closed = False

    def put(self, answer: bytes) -> None:
        """Add an answer; answers are sent before messages."""
        with self._lock:
            if self._closed:
                return
            full = self._answered > self._limit  # without `answer`: one may exceed the limit
            if full:
                self._closed = True
            else:
                self._answers.append(answer)
                self._answered += len(answer)
        (self._overflow if full else self._wake)()

    def offer(self, topic: TopicQueue[M], message: M) -> None:
        """Add a message; drop the oldest ones of its topic if there are too many."""
        with self._lock:
            if self._closed or topic.closed:
                return
            messages = topic.messages
            if not messages:
                self._ready.append(topic)
            others = self._size - messages.size
            messages.most = max(topic.depth, 1) if topic.period else topic.depth
            messages.most_bytes = max(1, self._limit - others)  # 0 would be no limit
            messages.put(message, message.size)
            self._size = others + messages.size
        self._wake()

    def next(self) -> tuple[bytes | M | None, TopicQueue[M] | None, float]:
        """Return the next item to send.

        Returns:
            An answer, a message or None; the topic of a message or None; and the seconds until a
            message is due.
        """
        with self._lock:
            if self._answers:
                answer = self._answers.popleft()
                self._answered -= len(answer)
                return answer, None, 0.0
            now, earliest = time.monotonic(), float("inf")
            for _ in range(len(self._ready)):
                topic = self._ready.popleft()
                if topic.due > now:
                    self._ready.append(topic)
                    earliest = min(earliest, topic.due)
                    continue
                message = topic.messages.pop()
                self._size -= message.size
                topic.due = now + topic.period
                if topic.messages:
                    self._ready.append(topic)
                return message, topic, 0.0
            return None, None, earliest - now

    def drop(self, topic: TopicQueue[M]) -> None:
        """Remove a topic and its messages."""
        with self._lock:
            topic.closed = True
            self._size -= topic.messages.size
            if topic.messages:
                self._ready.remove(topic)
                topic.messages.clear()

    def close(self) -> None:
        """Remove all answers and messages, and accept no more."""
        with self._lock:
            self._closed = True
            self._answers.clear()
            for topic in self._ready:
                topic.messages.clear()
            self._ready.clear()
            self._size = 0
