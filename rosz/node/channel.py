"""What samples of one topic and type become: messages, and where they come from."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import msgspec

from rosz.errors import DecodeError
from rosz.node.logger import NodeLogger
from rosz.wire import read

if TYPE_CHECKING:
    from rosz.message import Message
    from rosz.session import Reply, Sample

__all__ = ("Channel", "MessageInfo", "Taken")

_KINDS_OF_DAMAGE = 10
_SENDERS = 1000
"""Publishers remembered at most; the oldest are forgotten, for nothing tells when it is safe."""


class MessageInfo(msgspec.Struct, frozen=True):
    """Where a message comes from.

    Attributes:
        source_time: Nanoseconds since the Unix epoch when it was published, by the sender's clock;
            0 where unknown.
        reception_time: Nanoseconds since the Unix epoch when it was dispatched here.
        sequence: Number within its publisher, from 1; 0 where unknown, or for what was sent to this
            subscription alone.
        gid: 16 bytes that identify the publisher; empty where unknown.
        lost: Samples of that publisher missing right before this one: lost, or pushed out of the
            queue by newer ones.
        type_name: ``pkg/msg/Name``.
    """

    source_time: int
    reception_time: int
    sequence: int
    gid: bytes
    lost: int
    type_name: str


Taken = tuple[Any, MessageInfo | None]
"""A message with its info, where that is wanted."""


class _Sender:
    """What is remembered of a publisher."""

    __slots__ = ("last", "replays")

    def __init__(self) -> None:
        self.last = 0
        self.replays = False


class Channel:
    """Decodes samples, numbers them, and drops what is damaged or was there before.

    Args:
        topic: For the log.
        type_name: ``pkg/msg/Name``.
        message_type: Class to decode into; bytes are passed on as they are when not given.
        log: Told of damage, once per kind.
        with_info: Whether anybody wants to know where messages come from.
    """

    def __init__(
        self,
        topic: str,
        type_name: str,
        message_type: type[Message] | None,
        log: NodeLogger,
        *,
        with_info: bool = True,
    ) -> None:
        self._topic = topic
        self._type_name = type_name
        self._decode: Callable[[bytes], Any] | None = None
        self._has_header = False
        if message_type is not None:
            self._decode = message_type._decode
            self._has_header = message_type._has_header
        self._log = log
        self._with_info = with_info
        self._senders: dict[bytes, _Sender] = {}
        self._complained: set[str] = set()

    def expect_replay(self, gid: bytes) -> None:
        """Take note that samples of a publisher may come twice: live, and from its cache.

        That holds beyond its end: what its cache answered may still be on the way.
        """
        self._sender(gid).replays = True

    def take(self, sample: Sample | Reply) -> Taken | None:
        """Decode one sample; ``None`` when it is damaged or was there before."""
        sequence, source_time, gid, lost = 0, 0, b"", 0
        try:
            attachment = sample.attachment
            if attachment is not None:
                sequence, source_time, gid = read(attachment)
                if sequence > 0:
                    sender = self._senders.get(gid) or self._sender(gid)
                    last = sender.last
                    if sequence <= last and sender.replays:
                        return None
                    sender.last = sequence
                    if last and sequence > last:
                        lost = sequence - last - 1
            payload = sample.payload
            message: Any = payload if self._decode is None else self._decode(payload)
        except DecodeError as error:
            self._complain(error)
            return None
        if self._has_header:
            # ROS 1 code reads the sequence number from there.
            message.header.seq = sequence
        if not self._with_info:
            return message, None
        now = time.time_ns()
        return message, MessageInfo(source_time, now, sequence, gid, lost, self._type_name)

    def _sender(self, gid: bytes) -> _Sender:
        sender = self._senders.get(gid)
        if sender is None:
            if len(self._senders) >= _SENDERS:
                self._senders.pop(next(iter(self._senders)), None)
            sender = self._senders[gid] = _Sender()
        return sender

    def _complain(self, error: DecodeError) -> None:
        """Log damage once per kind, so that a broken sender does not fill the disk."""
        kind = f"{error.type_name}: {error.reason}"
        if kind not in self._complained and len(self._complained) < _KINDS_OF_DAMAGE:
            self._complained.add(kind)
            self._log.warning(
                "dropping damaged samples on '%s' (told once): %.300s", self._topic, error
            )
