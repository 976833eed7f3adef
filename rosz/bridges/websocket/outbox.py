"""The outgoing queue of one client: answers, and the newest messages of its subscriptions.

Messages wait as they came from the network, shared by all clients, and are encoded when their turn
comes. So a client that does not read costs neither processor time nor memory beyond the limit.
"""

from __future__ import annotations

import threading
import time
import weakref
from collections import deque
from collections.abc import Callable
from typing import Any, TypeAlias

import msgspec

from rosz.bridges.logs import is_log, to_ros1_log
from rosz.bridges.websocket.operations import Compression, Subscribe
from rosz.bridges.websocket.plain import Spelling, converter

__all__ = ("Encodings", "Feed", "Form", "Message", "Outbox")

Form: TypeAlias = tuple[Compression, Spelling]
"""Encoding of a message, and the spelling of its fields."""

_COMPRESSIONS: tuple[Compression, ...] = ("none", "png", "cbor", "cbor-raw")
"""The last one that a subscription asks for holds for all."""


class Encodings:
    """The encodings of messages that other clients may need too: the newest ones.

    Args:
        limit: Largest number of their bytes.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._size = 0
        self._lock = threading.Lock()
        self._known: deque[tuple[weakref.ref[Message], Form, int]] = deque()

    def keep(self, message: Message, form: Form, size: int) -> None:
        """Note that a message keeps an encoding; the oldest ones are dropped if there are too many.

        Args:
            message: The message.
            form: The form.
            size: Number of bytes.
        """
        with self._lock:
            self._known.append((weakref.ref(message), form, size))
            self._size += size
            while self._size > self._limit and len(self._known) > 1:
                reference, old, freed = self._known.popleft()
                self._size -= freed
                if (known := reference()) is not None:
                    known.drop(old)


class Message:
    """A message of a topic, as the network brought it; it keeps its encodings.

    Args:
        encodings: Encodings of all messages.
        topic: Name of the topic.
        cls: Class of the message.
        data: Its CDR.
        received: When it came, by the clock of the node, in nanoseconds.

    Attributes:
        data: Its CDR.
        received: When it came, in nanoseconds.
        size: Number of bytes.
    """

    def __init__(
        self, encodings: Encodings, topic: str, cls: type[Any], data: bytes, received: int
    ) -> None:
        self.data = data
        self.received = received
        self.size: int = len(data)
        self._encodings = encodings
        self._topic = topic
        self._cls = cls
        self._lock = threading.Lock()
        self._encoded: dict[Form, bytes] = {}

    def encode(self, form: Form) -> bytes:
        """Return the operation ``publish`` with the message.

        Raises:
            DecodeError: The bytes are not a message of the type.
            EncodeError: ROS 1 has no such message.
            ImportError: The library of the encoding is not installed.
        """
        with self._lock:
            encoded = self._encoded.get(form)
            if encoded is not None:
                return encoded
            encoded = self._encoded[form] = self._encode(*form)
        self._encodings.keep(self, form, len(encoded))
        return encoded

    def drop(self, form: Form) -> None:
        """Drop an encoding; it is made again if it is needed."""
        self._encoded.pop(form, None)

    def _encode(self, compression: Compression, spelling: Spelling) -> bytes:
        if compression == "cbor-raw":
            return self._cbor(self._raw(spelling))
        message = self._message(spelling)
        if compression == "cbor":
            from cbor2 import CBORTag

            return self._cbor(converter(type(message), spelling, CBORTag)(message))
        plain = converter(type(message), spelling)(message)
        return msgspec.json.encode({"op": "publish", "topic": self._topic, "msg": plain})

    def _raw(self, spelling: Spelling) -> dict[str, Any]:
        seconds, rest = divmod(self.received, 1_000_000_000)
        if spelling == "ros2":
            return {
                "sec": seconds,
                "nanosec": rest,
                "secs": seconds,
                "nsecs": rest,
                "bytes": self.data,
            }
        data = self._message(spelling).to_ros1()
        return {"secs": seconds, "nsecs": rest, "bytes": data}

    def _message(self, spelling: Spelling) -> Any:
        message = self._cls.from_cdr(self.data)
        if spelling == "ros1" and is_log(self._topic, self._cls):
            return to_ros1_log(message)
        return message

    def _cbor(self, message: dict[str, Any]) -> bytes:
        import cbor2

        return cbor2.dumps({"op": "publish", "topic": self._topic, "msg": message})


class Feed:
    """The messages of one topic that wait for one client.

    A client may subscribe to a topic several times; it gets each message once.

    Attributes:
        requests: Its subscriptions by their ids. Only `adapt` changes it and what follows from it.
        form: How messages are encoded.
        period: Shortest time between two of them, in seconds.
        depth: Largest number of them; 0 for as many as the outbox holds, or one with a period.
        fragment_size: Largest number of characters of a text; None for no limit.
        messages: Messages that wait, the oldest first; only the outbox changes it.
        due: When the next one may be sent, by the monotonic clock.
        closed: Whether the outbox has dropped it.
    """

    def __init__(self) -> None:
        self.requests: dict[str, Subscribe] = {}
        self.form: Form = ("none", "ros1")
        self.period: float = 0.0
        self.depth: int = 0
        self.fragment_size: float | None = None
        self.closed: bool = False
        self.messages: deque[Message] = deque()
        self.due: float = 0.0

    def adapt(self, requests: dict[str, Subscribe], spelling: Spelling) -> None:
        """Do what all subscriptions of a topic need, as rosbridge_suite does.

        Args:
            requests: The subscriptions by their ids, one at least.
            spelling: Whose names the fields have.
        """
        found = requests.values()
        sizes = [one.fragment_size for one in found if one.fragment_size is not None]
        compressions = [one.compression or "none" for one in found]
        self.requests = requests
        self.form = (max(compressions, key=_COMPRESSIONS.index), spelling)
        period = max(0.0, min(one.throttle_rate for one in found) / 1000)
        self.due += period - self.period
        self.period = period
        self.depth = max(0, min(one.queue_length for one in found))
        self.fragment_size = min(sizes, default=None)

    @property
    def most(self) -> int:
        """Largest number of messages; 0 for no limit."""
        return max(self.depth, 1) if self.period else self.depth


class Outbox:
    """The outgoing queue of one client.

    Args:
        limit: Largest number of bytes that wait. The oldest messages of a topic give way to newer
            ones, except the newest. When answers pass the limit, the next one ends the connection.
        wake: Function that is called when there is something to send.
        overflow: Function that is called when there are too many answers.
    """

    def __init__(
        self, limit: int, wake: Callable[[], object], overflow: Callable[[], object]
    ) -> None:
        self._limit = limit
        self._wake = wake
        self._overflow = overflow
        self._lock = threading.Lock()
        self._answers: deque[bytes] = deque()
        self._ready: deque[Feed] = deque()
        self._answered = 0
        self._size = 0
        self._closed = False

    def put(self, answer: bytes) -> None:
        """Add an answer, which is sent before messages."""
        with self._lock:
            if self._closed:
                return
            full = self._answered > self._limit  # so that a large one alone is sent
            if full:
                self._closed = True
            else:
                self._answers.append(answer)
                self._answered += len(answer)
        (self._overflow if full else self._wake)()

    def offer(self, feed: Feed, message: Message) -> None:
        """Add a message; older ones of its topic give way if there are too many."""
        with self._lock:
            if self._closed or feed.closed:
                return
            messages = feed.messages
            if not messages:
                self._ready.append(feed)
            messages.append(message)
            self._size += message.size
            while len(messages) > 1 and (
                self._size > self._limit or (feed.most and len(messages) > feed.most)
            ):
                self._size -= messages.popleft().size
        self._wake()

    def next(self) -> tuple[bytes | Message | None, Feed | None, float]:
        """Return what to send next.

        Returns:
            An answer, or a message with its feed, or neither; then seconds until a message is due.
        """
        with self._lock:
            if self._answers:
                answer = self._answers.popleft()
                self._answered -= len(answer)
                return answer, None, 0.0
            now, earliest = time.monotonic(), float("inf")
            for _ in range(len(self._ready)):
                feed = self._ready.popleft()
                if feed.due > now:
                    self._ready.append(feed)
                    earliest = min(earliest, feed.due)
                    continue
                message = feed.messages.popleft()
                self._size -= message.size
                feed.due = now + feed.period
                if feed.messages:
                    self._ready.append(feed)
                return message, feed, 0.0
            return None, None, earliest - now

    def drop(self, feed: Feed) -> None:
        """Forget a feed and its messages."""
        with self._lock:
            feed.closed = True
            self._size -= sum(message.size for message in feed.messages)
            if feed.messages:
                self._ready.remove(feed)
                feed.messages.clear()

    def close(self) -> None:
        """Forget everything."""
        with self._lock:
            self._closed = True
            self._answers.clear()
            for feed in self._ready:
                feed.messages.clear()
            self._ready.clear()
            self._size = 0
