"""Messages of topics as clients of the rosbridge protocol get them, in the form that they want."""

from __future__ import annotations

import threading
import weakref
from typing import Any, TypeAlias

import msgspec

from rosz.bridges.clients import TopicMessage, TopicQueue
from rosz.bridges.rosbridge.operations import Compression, Subscribe
from rosz.bridges.rosbridge.plain import Spelling, converter
from rosz.introspect import is_log, to_ros1_log
from rosz.queue import BoundedQueue

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
        self._lock = threading.Lock()
        self._kept: BoundedQueue[tuple[weakref.ref[EncodedMessage], Form]]
        self._kept = BoundedQueue(most_bytes=max(1, limit))  # 0 would be no limit

    def keep(self, message: EncodedMessage, form: Form, size: int) -> None:
        """Note that a message keeps an encoding; the oldest ones are dropped beyond the limit."""
        with self._lock:
            for reference, old in self._kept.put((weakref.ref(message), form), size):
                if (other := reference()) is not None:
                    other.drop(old)


class EncodedMessage(TopicMessage):
    """A message of a topic that keeps its encodings."""

    def __init__(
        self, encodings: Encodings, topic: str, cls: type[Any], data: bytes, received: int
    ) -> None:
        super().__init__(topic, cls, data, received)
        self._encodings = encodings
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
        stamp = {"secs": seconds, "nsecs": rest}
        if spelling == "ros2":
            return {"sec": seconds, "nanosec": rest, **stamp, "bytes": self.data}
        return {**stamp, "bytes": self._message(spelling).to_ros1()}

    def _message(self, spelling: Spelling) -> Any:
        message = self._cls.from_cdr(self.data)
        if spelling == "ros1" and is_log(self._topic, self._cls):
            return to_ros1_log(message)
        return message

    def _cbor(self, message: dict[str, Any]) -> bytes:
        import cbor2

        return cbor2.dumps({"op": "publish", "topic": self._topic, "msg": message})


class SubscribedQueue(TopicQueue[EncodedMessage]):
    """The messages of a topic for a client, which may subscribe to the topic several times.

    Attributes:
        requests: Its subscriptions by their ids. Only `adapt` changes it and what follows from it.
        form: How messages are encoded.
        fragment_size: Largest number of characters of a text; None for no limit.
    """

    def __init__(self) -> None:
        super().__init__()
        self.requests: dict[str, Subscribe] = {}
        self.form: Form = ("none", "ros1")
        self.fragment_size: float | None = None

    def adapt(self, requests: dict[str, Subscribe], spelling: Spelling) -> None:
        """Adapt to all subscriptions of a topic, as rosbridge_suite does.

        Args:
            requests: The subscriptions by their ids, one at least.
            spelling: Whose names the fields have.
        """
        wanted = requests.values()
        sizes = [request.fragment_size for request in wanted if request.fragment_size is not None]
        compressions = [request.compression or "none" for request in wanted]
        self.requests = requests
        self.form = (max(compressions, key=_COMPRESSIONS.index), spelling)
        period = max(0.0, min(request.throttle_rate for request in wanted) / 1000)
        self.due += period - self.period
        self.period = period
        self.depth = max(0, min(request.queue_length for request in wanted))
        self.fragment_size = min(sizes, default=None)
