"""Messages between the nodes of one process, which do not pass through the session.

In a container, a publisher passes its messages straight to the subscriptions of its process; the
session sends them only to other processes. It passes the message itself, or its bytes, from which
each subscription decodes a message of its own. Latched messages that were published before a
subscription existed come from the session, as between processes.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

import msgspec

from rosz.lifecycle import Registration
from rosz.wire import Token


class LocalSample(msgspec.Struct, gc=False):
    """A message on its way to subscriptions of the same process.

    Attributes:
        key: Key expression of the publisher's data.
        sequence: Sequence number.
        stamp: Time of publication in nanoseconds since the Unix epoch.
        gid: 16 bytes that identify the publisher.
        message: The message itself; None if each subscription is to decode its own.
        encoded: Encoded message, or a function that encodes it.
        attachment: None: its parts are attributes of this class.
    """

    attachment: ClassVar[None] = None

    key: str
    sequence: int
    stamp: int
    gid: bytes
    message: Any
    encoded: bytes | Callable[[Any], bytes]

    @property
    def payload(self) -> bytes:
        """The encoded message."""
        encoded = self.encoded
        return encoded if isinstance(encoded, bytes) else encoded(self.message)

    @property
    def size(self) -> int:
        """Length of the encoded message in bytes; 0 if it is not encoded."""
        return len(self.encoded) if isinstance(self.encoded, bytes) else 0


class LocalReceiver(NamedTuple):
    """A subscription, as publishers of its process see it.

    Attributes:
        matches: Function that returns whether it receives the samples of a publisher.
        receive: Function that takes a sample, and does not wait.
        expect_replay: Function called with the GID of each latching publisher.
    """

    matches: Callable[[Token], bool]
    receive: Callable[[LocalSample], None]
    expect_replay: Callable[[bytes], object]


class LocalDelivery:
    """The subscriptions of a process, by topic.

    Args:
        by_reference: Whether publishers of rospy pass on the message itself too, not its bytes.

    Attributes:
        by_reference: As given.
        version: Number that grows with each change.
    """

    def __init__(self, *, by_reference: bool = False) -> None:
        self.by_reference = by_reference
        self.version: int = 0
        self._lock = threading.RLock()  # a signal handler may subscribe in between
        self._receivers: dict[str, tuple[LocalReceiver, ...]] = {}

    def register(self, topic: str, receiver: LocalReceiver) -> Registration:
        """Pass the messages of a topic that this process publishes to a subscription."""
        with self._lock:
            self._receivers[topic] = (*self._receivers.get(topic, ()), receiver)
            self.version += 1

        def unregister() -> None:
            with self._lock:
                others = tuple(
                    other for other in self._receivers.get(topic, ()) if other is not receiver
                )
                self._receivers[topic] = others
                if not others:
                    del self._receivers[topic]
                self.version += 1

        return Registration(unregister)

    def find(self, publisher: Token) -> tuple[LocalReceiver, ...]:
        """Return the subscriptions that receive the samples of a publisher."""
        receivers = self._receivers.get(publisher.name, ())
        return tuple(receiver for receiver in receivers if receiver.matches(publisher))
