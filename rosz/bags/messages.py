"""Bags as programs use them: with messages that are decoded by the types in the bag."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

from rosz.bags.bag import Attachment, BagReader, BagWriter, Channel, Entry, Payload
from rosz.bags.formats.channel_text import event_definition
from rosz.errors import DefinitionError, TypeNotFound
from rosz.lifecycle import Closing
from rosz.message import Message

if TYPE_CHECKING:
    from rosz.typestore import TypeStore  # slow to import: see `rosz.bags.opening.open`

_PARSED = frozenset({"", "ros1msg", "ros2msg"})


def class_of(channel: Channel, types: TypeStore) -> type[Message]:
    """Return the class of a channel's messages, by the definition in the bag.

    Args:
        channel: The channel.
        types: Types for channels without a definition, and for those that are equal to one here.

    Raises:
        TypeNotFound: Neither the bag nor this machine has a definition of the type.
        DefinitionError: The definition is not well-formed.
    """
    if channel.encoding == "ros1" and channel.md5:
        try:
            local = types.message(channel.type)
        except (TypeNotFound, DefinitionError):
            local = None
        if local is not None and local._md5sum == channel.md5:
            return local  # with what ROS 2 has added to the type
    if channel.definition and channel.language in _PARSED:
        text = event_definition(channel.type, channel.definition)
        return types.message_from_text(channel.type, text)
    return types.message(channel.type)


def described(cls: type[Message]) -> dict[str, Any]:
    """Return the attributes of a channel that describe the class of its messages."""
    return {"definition": cls._full_text, "md5": cls._md5sum, "type_hash": cls._type_hash}


def decoder_of(channel: Channel, types: TypeStore) -> Callable[[Payload], Message]:
    """Return the function that makes messages of a channel's payloads.

    Raises:
        TypeNotFound: Neither the bag nor this machine has a definition of the type, or the payloads
            are in neither CDR nor ROS 1's layout.
        DefinitionError: The definition is not well-formed.
    """
    if channel.encoding == "ros1":
        return class_of(channel, types).from_ros1
    if channel.encoding == "cdr":
        return class_of(channel, types).from_cdr
    raise TypeNotFound(
        channel.type, f"topic '{channel.topic}' is encoded as '{channel.encoding}', not as CDR"
    )


class BagMessage:
    """One message of a bag, which is decoded when it is asked for.

    Attributes:
        entry: The message as it is in the bag, with its channel.
        topic: Full name of the topic.
        stamp: Time at which it was received, in nanoseconds since the Unix epoch.
        raw: The payload.
    """

    def __init__(self, entry: Entry, bag: Bag) -> None:
        self.entry = entry
        self.topic: str = entry.channel.topic
        self.stamp: int = entry.stamp
        self.raw: Payload = entry.data
        self._bag = bag

    @cached_property
    def message(self) -> Message:
        """The message.

        Raises:
            DecodeError: The payload is not a message of the type.
            TypeNotFound: The bag has no definition of the type, and it is not known here.
            DefinitionError: The definition in the bag is not well-formed.
        """
        message = self._bag.decoder(self.entry.channel)(self.raw)
        if self.entry.channel.encoding == "cdr" and type(message)._has_header:
            message.header.seq = self.entry.sequence  # type: ignore[attr-defined]
        return message


class Bag(Closing):
    """A bag that is read.

    Args:
        reader: Reader of its format.
        types: Types for channels without a definition.
    """

    def __init__(self, reader: BagReader, types: TypeStore) -> None:
        self.reader = reader
        self._types = types
        self._decoders: dict[Channel, Callable[[Payload], Message]] = {}

    @property
    def channels(self) -> Sequence[Channel]:
        """All channels, in the order of the file."""
        return self.reader.channels

    @property
    def topics(self) -> dict[str, str]:
        """The types of the topics by name, sorted."""
        return dict(
            sorted({channel.topic: channel.type for channel in self.reader.channels}.items())
        )

    @property
    def start(self) -> int:
        """Stamp of the earliest message, in nanoseconds; 0 in a bag without messages."""
        return self.reader.start

    @property
    def end(self) -> int:
        """Stamp of the latest message, in nanoseconds; 0 in a bag without messages."""
        return self.reader.end

    @property
    def metadata(self) -> Mapping[str, Mapping[str, str]]:
        """Named texts by name of the record."""
        return self.reader.metadata

    def count(self, topics: str | Iterable[str] | None = None) -> int:
        """Return the number of messages of some topics, or of all."""
        if topics is None:
            return self.reader.count()
        wanted = {topics} if isinstance(topics, str) else set(topics)
        return sum(
            self.reader.count(channel) for channel in self.channels if channel.topic in wanted
        )

    def messages(
        self,
        topics: str | Iterable[str] | None = None,
        start: int | None = None,
        end: int | None = None,
        *,
        reverse: bool = False,
    ) -> Iterator[BagMessage]:
        """Yield messages in the order of their stamps, read as they are asked for.

        Args:
            topics: Full name of a topic, or several; all when not given.
            start: Earliest stamp, in nanoseconds since the Unix epoch.
            end: Latest stamp; messages of this stamp are included.
            reverse: Whether to begin with the latest.

        Raises:
            BagError: A part of the file is damaged.
        """
        wanted = {topics} if isinstance(topics, str) else None if topics is None else set(topics)
        for entry in self.reader.messages(wanted, start, end, reverse=reverse):
            yield BagMessage(entry, self)

    def __iter__(self) -> Iterator[BagMessage]:
        return self.messages()

    def attachments(self) -> Iterator[Attachment]:
        """Yield the files within the bag."""
        return self.reader.attachments()

    def decoder(self, channel: Channel) -> Callable[[Payload], Message]:
        """Return the function that makes messages of a channel's payloads.

        Raises:
            TypeNotFound: The bag has no definition of the type, and it is not known here.
            DefinitionError: The definition in the bag is not well-formed.
        """
        decoder = self._decoders.get(channel)
        if decoder is None:
            decoder = self._decoders[channel] = decoder_of(channel, self._types)
        return decoder

    def close(self) -> None:
        """Close the file; a second call has no effect."""
        self.reader.close()


class BagOutput(Closing):
    """A bag that is written.

    Args:
        writer: Writer of its format.
        now: Function that returns the time of messages without a stamp.
        to_ros1: Function that translates channels, for a bag that holds ROS 1's layout.
    """

    def __init__(
        self,
        writer: BagWriter,
        now: Callable[[], int],
        to_ros1: Callable[[Channel], Channel] | None = None,
    ) -> None:
        self.writer = writer
        self._now = now
        self._to_ros1 = to_ros1
        self._handles: dict[tuple[str, Any], int] = {}

    def write(self, topic: str, message: Message, stamp: int | None = None) -> None:
        """Write a message.

        Args:
            topic: Full name of the topic.
            message: The message.
            stamp: Time of the message, in nanoseconds since the Unix epoch; now when not given.

        Raises:
            EncodeError: A value of the message does not fit its field.
            BagError: The file cannot be written.
        """
        cls = type(message)
        handle = self._handles.get((topic, cls))
        if handle is None:
            channel = Channel(topic, cls._type_name, **described(cls))
            if self._to_ros1 is not None:
                channel = self._to_ros1(channel)
            handle = self._handles[topic, cls] = self.writer.add(channel)
        data = message.to_cdr() if self._to_ros1 is None else message.to_ros1()
        self.writer.write(handle, self._now() if stamp is None else stamp, data)

    def close(self) -> None:
        """Finish the file with its index; a second call has no effect.

        Raises:
            BagError: The file cannot be written.
        """
        self.writer.close()
