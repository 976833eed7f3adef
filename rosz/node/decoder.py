"""Decoding: from Zenoh's samples to messages, with their origins and the number of lost ones."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import msgspec

from rosz.errors import DecodeError, RoszError
from rosz.node.fetch import FetchedSample
from rosz.node.local_delivery import LocalSample
from rosz.session import Reply, Sample
from rosz.wire import NO_HASH, read_attachment, ros_type

if TYPE_CHECKING:
    from rosz.message import Message
    from rosz.node.entity import Entity

AnySample = Sample | Reply | FetchedSample | LocalSample
"""A sample, however it came."""

_KINDS_OF_DAMAGE = 10
_PUBLISHERS = 1000
"""Publishers to remember; the oldest is forgotten, because nothing tells when that is safe."""


class MessageInfo(msgspec.Struct, frozen=True):
    """The origin of a message.

    Attributes:
        source_time: Time of publication by the sender's clock, in nanoseconds since the Unix epoch;
            0 if unknown.
        reception_time: Time of dispatch here, in nanoseconds since the Unix epoch.
        sequence: Number within its publisher, from 1; 0 if unknown, or if the message was sent to
            this subscription alone.
        gid: 16 bytes that identify the publisher; empty if unknown.
        lost: Samples of that publisher missing right before this one: lost, or pushed out of the
            queue by newer ones.
        type_name: ``pkg/msg/Name``.
        type_hash: ``RIHS01_…``, the hash of the type's definition.
        size: Length of the message as it was sent, in bytes; 0 if it was not encoded, as between
            nodes of one process.
    """

    source_time: int
    reception_time: int
    sequence: int
    gid: bytes
    lost: int
    type_name: str
    type_hash: str = ""
    size: int = 0


Received = tuple[Any, MessageInfo | None]
"""A message with its info, if that is wanted."""


class _Publisher:
    """The sequence numbers received from a publisher, for missing and repeated samples."""

    __slots__ = ("_before", "_late", "_replayed", "events", "last", "oldest", "replays")

    def __init__(self) -> None:
        self.last = self.oldest = self._late = 0
        self.replays = self.events = False
        # The first sample of a replay that no live one has followed yet, and the last before it.
        self._replayed = self._before = 0

    def advance(self, sequence: int, *, replayed: bool) -> int | None:
        """Return the number of samples missing before one; ``None`` if that is a repetition.

        A replay comes on a way of its own, and may overtake live samples that wait to be decoded.
        """
        last, first, before = self.last, self._replayed, self._before
        # A live sample may overtake an older event, which is new nevertheless; a value is outdated.
        if replayed and self.events and self._late < sequence < self.oldest:
            self._late = sequence
            return 0
        if sequence <= last and (replayed or sequence >= first):
            return None
        self.last = sequence
        if replayed:
            self._late = sequence
            if not first:
                self._replayed, self._before = sequence, last
            return 0
        self._replayed, self.oldest = 0, self.oldest or sequence
        if first and sequence > last:
            return sequence - last - 1 + (first - before - 1 if before else 0)
        if first:
            last = before
        return max(sequence - last - 1, 0) if last else 0


class SampleDecoder:
    """Decode samples, count lost ones, and drop damaged and repeated ones.

    Args:
        topic: Name of the topic, for the log.
        type_name: ``pkg/msg/Name``.
        type_hash: ``RIHS01_…``.
        decode: Function that decodes a message; when not given, the encoded bytes are the messages.
        message_type: Class of the messages; a header gets the sequence number.
        log: Logger for damage, which is logged once per kind.
        report_lost: Function called with the number of samples that are missing before one.
        with_info: Whether to make a `MessageInfo` for each message.
    """

    def __init__(
        self,
        topic: str,
        type_name: str,
        type_hash: str,
        decode: Callable[[bytes], Any] | None,
        log: logging.Logger,
        report_lost: Callable[[int], object],
        *,
        message_type: type[Message] | None,
        with_info: bool,
    ) -> None:
        self._topic = topic
        self._type_name = type_name
        self._type_hash = type_hash
        self._decode = decode
        self._message_type = message_type
        self._taken = None if decode is None else message_type
        self._has_header = message_type is not None and bool(message_type._has_header)
        self._log = log
        self._report_lost = report_lost
        self._with_info = with_info
        self._publishers: dict[bytes, _Publisher] = {}
        self._reported: set[str] = set()

    def expect_replay(self, gid: bytes, *, events: bool = False) -> None:
        """Expect the samples of a publisher twice: live, and from its cache.

        That holds beyond the publisher's end, because replies of its cache may still be on the way.
        ``events`` tells that each sample counts, and not only the newest value.
        """
        publisher = self._publisher(gid)
        publisher.replays, publisher.events = True, publisher.events or events

    def last(self, gid: bytes) -> int:
        """Return the sequence number of the latest sample of a publisher; 0 if there is none."""
        publisher = self._publishers.get(gid)
        return 0 if publisher is None else publisher.last

    def decode(self, sample: AnySample) -> Received | None:
        """Decode one sample; ``None`` if it is damaged or a repetition."""
        if isinstance(sample, LocalSample) and type(sample.message) is self._taken:
            return self._take(sample)
        sequence, source_time, gid, lost = 0, 0, b"", 0
        try:
            if isinstance(sample, LocalSample):
                sequence, source_time, gid = sample.sequence, sample.stamp, sample.gid
            elif (attachment := sample.attachment) is not None:
                sequence, source_time, gid = read_attachment(attachment)
            if sequence > 0:
                lost = self._advance(gid, sequence, replayed=isinstance(sample, Reply))
                if lost < 0:
                    return None
            payload = sample.payload
            message: Any = payload if self._decode is None else self._decode(payload)
        except DecodeError as error:
            self._report(error)
            return None
        if self._has_header:
            # ROS 1 code reads the sequence number from there.
            message.header.seq = sequence
        return message, self._info(sequence, source_time, gid, lost, len(payload))

    def _take(self, sample: LocalSample) -> Received | None:
        """Return a message of this process itself; ``None`` if it is a repetition."""
        gid, sequence, lost = sample.gid, sample.sequence, 0
        publisher = self._publishers.get(gid)
        if publisher and sequence == publisher.last + 1 and not publisher.replays:
            publisher.last = sequence  # as nearly always, and without a further call
        else:
            lost = self._advance(gid, sequence, replayed=False)
            if lost < 0:
                return None
        if not self._with_info:
            return sample.message, None
        return sample.message, self._info(sequence, sample.stamp, gid, lost, sample.size)

    def _advance(self, gid: bytes, sequence: int, *, replayed: bool) -> int:
        """Return the number of samples missing before one; -1 if it is a repetition."""
        publisher = self._publishers.get(gid) or self._publisher(gid)
        last, lost = publisher.last, 0
        # All latching publishers of a session reply to a request for one of them.
        publisher.replays |= replayed
        if publisher.replays:
            missing = publisher.advance(sequence, replayed=replayed)
            if missing is None:
                return -1
            lost = missing
        else:
            publisher.last, publisher.oldest = sequence, publisher.oldest or sequence
            if last and sequence > last:
                lost = sequence - last - 1
        if lost:
            self._report_lost(lost)
        return lost

    def _info(  # called for each message
        self, sequence: int, source_time: int, gid: bytes, lost: int, size: int
    ) -> MessageInfo | None:
        if not self._with_info:
            return None
        return MessageInfo(
            source_time, time.time_ns(), sequence, gid, lost, self._type_name, self._type_hash, size
        )

    def _publisher(self, gid: bytes) -> _Publisher:
        publisher = self._publishers.get(gid)
        if publisher is None:
            if len(self._publishers) >= _PUBLISHERS:
                self._publishers.pop(next(iter(self._publishers)), None)
            publisher = self._publishers[gid] = _Publisher()
        return publisher

    def _report(self, error: DecodeError) -> None:
        """Log damage once per kind, so that a broken sender does not fill the disk."""
        kind = f"{error.type_name}: {error.reason}"
        if kind not in self._reported and len(self._reported) < _KINDS_OF_DAMAGE:
            self._reported.add(kind)
            self._log.warning(
                "dropping damaged samples on '%s' (told once): %.300s", self._topic, error
            )


class TypeDecoders:
    """The decoders of a subscription of any type, by the types of the samples.

    Args:
        subscription: The subscription.
        report_lost: Function called with a type and its hash, and the number of samples that are
            missing.
        raw: Whether the encoded bytes are the messages.
        with_info: Whether to make a `MessageInfo` for each message.
    """

    def __init__(
        self,
        subscription: Entity,
        report_lost: Callable[[tuple[str, str], int], object],
        *,
        raw: bool,
        with_info: bool,
    ) -> None:
        self._topic = subscription.name
        self._context = subscription.node.context
        self._log = subscription.node.log
        self._report_lost = report_lost
        self._raw = raw
        self._with_info = with_info
        self._decoders: dict[tuple[str, str], SampleDecoder | None] = {}
        self._lock = threading.RLock()  # a signal handler may come in between

    @property
    def types(self) -> list[str]:
        """The types received or seen so far, in the order of appearance."""
        return list(dict.fromkeys(name for name, _ in list(self._decoders)))

    def of_sample(self, sample: AnySample) -> SampleDecoder | None:
        """Return the decoder for a sample whose key tells its type."""
        *_, dds_name, type_hash = sample.key.split("/")
        try:
            return self.of_type(ros_type(dds_name), type_hash)
        except DecodeError:
            return None  # a key of Zenoh itself below the name of the topic

    def of_type(self, type_name: str, type_hash: str) -> SampleDecoder | None:
        """Return the decoder for a type; ``None``, after one warning, if it cannot be decoded."""
        kind = (type_name, type_hash)
        with self._lock:
            if kind not in self._decoders:
                self._decoders[kind] = self._find(*kind)
            return self._decoders[kind]

    def make(self, type_name: str, type_hash: str, message_type: type[Message]) -> SampleDecoder:
        """Return a new decoder for messages of a class."""
        return self._make(type_name, type_hash, None if self._raw else message_type)

    def _find(self, type_name: str, type_hash: str) -> SampleDecoder | None:
        if self._raw:
            return self._make(type_name, type_hash, None)
        try:
            message_type: type[Message] = self._context.types.message(type_name)
        except RoszError as error:
            self._log.warning("cannot decode what comes on '%s': %s", self._topic, error)
            return None
        if type_hash not in {message_type._type_hash, NO_HASH}:
            self._log.warning(
                "cannot decode what comes on '%s': its definition of '%s' (%.15s…) is not the one"
                " known here (%.15s…); put the sender's package on ROSZ_PACKAGE_PATH",
                self._topic,
                type_name,
                type_hash,
                message_type._type_hash,
            )
            return None
        return self._make(type_name, type_hash, message_type)

    def _make(
        self, type_name: str, type_hash: str, message_type: type[Message] | None
    ) -> SampleDecoder:
        return SampleDecoder(
            self._topic,
            type_name,
            type_hash,
            None if message_type is None else self._context.decoder(message_type),
            self._log,
            partial(self._report_lost, (type_name, type_hash)),
            message_type=message_type,
            with_info=self._with_info,
        )
