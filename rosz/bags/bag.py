"""The values that bags hold, and what a reader and a writer of each format offers.

All times are nanoseconds since the Unix epoch. A payload is the message as it was on the wire: CDR
with its header of four bytes, or ROS 1's layout, as the encoding of the channel says.
"""

from __future__ import annotations

import math
import os
from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from heapq import heappop, heappush
from itertools import zip_longest
from pathlib import Path
from typing import Any, Literal, NoReturn, Protocol, Self, TypeAlias, TypeVar

import msgspec

from rosz.errors import BagError, UsageError
from rosz.lifecycle import Closable
from rosz.qos import QoS

T = TypeVar("T")
R = TypeVar("R", bound=tuple[Any, ...])

Compression: TypeAlias = Literal["none", "lz4", "zstd", "bz2"]
Payload: TypeAlias = bytes | bytearray | memoryview

SMALL = 1024
"""Size in bytes below which a copy of a payload costs less than a view of it, and keeps less."""


@lru_cache
def compression_library(name: str) -> Any:
    """Return the library of a compression, ``lz4`` or ``zstd``.

    Raises:
        UsageError: It is not installed.
    """
    from importlib import import_module

    try:
        return import_module({"lz4": "lz4.frame", "zstd": "zstandard"}[name])
    except ImportError as error:
        raise UsageError(
            f"the compression {name} needs a library: pip install 'rosz[bag]' ({error})"
        ) from error


class FileErrors:
    """A context that raises the system's errors about a file as `BagError`, behind a text."""

    def __init__(self, file: str | os.PathLike[str], text: str = "cannot write to it") -> None:
        self._file = file
        self._text = text

    def __enter__(self) -> None: ...

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, OSError):
            raise BagError(f"{self._text}: {error.strerror or error}", str(self._file)) from error


class Channel(msgspec.Struct, frozen=True):
    """The messages of one publisher on one topic.

    Attributes:
        topic: Full name of the topic.
        type: ``pkg/msg/Name``.
        encoding: The layout of the payloads: ``cdr``, ``ros1``, or one that rosz does not decode.
        definition: Text of the type's definition; those of the types in it follow, each behind a
            line of ``=`` and a line ``MSG: pkg/Name``. Empty if unknown.
        md5: Hash of the type in ROS 1; empty if unknown.
        type_hash: Hash of the type in ROS 2, ``RIHS01_…``; empty if unknown.
        qos: What the publisher offers; several where a bag joins the publishers of a topic.
        node: Full name of the publisher's node; empty if unknown.
        language: Language of the definition if it is not that of .msg files, such as ``protobuf``.
    """

    topic: str
    type: str
    encoding: str = "cdr"
    definition: str = ""
    md5: str = ""
    type_hash: str = ""
    qos: tuple[QoS, ...] = ()
    node: str = ""
    language: str = ""

    @property
    def latched(self) -> bool:
        """Whether late joiners receive earlier messages."""
        return any(qos.latched for qos in self.qos)


def count_by_channel(
    counts: Mapping[int, int], channels: Mapping[int, Channel]
) -> Counter[Channel]:
    """Return the number of messages of each channel, from that of each number in a file."""
    totals: Counter[Channel] = Counter()
    for number, channel in channels.items():
        totals[channel] += counts.get(number, 0)
    return totals


class Entry(msgspec.Struct, frozen=True, gc=False):
    """One recorded message, encoded.

    Attributes:
        channel: The channel that it belongs to.
        stamp: Time at which it was received.
        sent: Time at which it was published; ``None`` if unknown.
        sequence: Number that the publisher gave it; 0 if unknown.
        data: The payload. A view stays valid while it is referenced.
    """

    channel: Channel
    stamp: int
    data: Payload
    sent: int | None = None
    sequence: int = 0


class Chunk(msgspec.Struct, frozen=True):
    """A part of a bag that is compressed as a whole.

    Attributes:
        offset: Place in the file, in bytes.
        compression: Name of the compression.
        size: Bytes in the file.
        uncompressed: Bytes of the records in it.
        start: Stamp of its earliest message.
        end: Stamp of its latest message.
    """

    offset: int
    compression: Compression
    size: int
    uncompressed: int
    start: int
    end: int


class Attachment(msgspec.Struct, frozen=True):
    """A file within a bag.

    Attributes:
        name: Name of the file.
        media_type: MIME type, such as ``text/plain``.
        stamp: Time at which it was recorded.
        data: Its bytes.
    """

    name: str
    media_type: str
    stamp: int
    data: bytes


def in_order(
    spans: Iterable[tuple[int, int, T]], rows_of: Callable[[T], list[R]], *, reverse: bool
) -> Iterator[list[R]]:
    """Yield the rows of spans in order, in runs; those of spans that overlap are merged.

    A span comes with its earliest and its latest stamp; a row begins with its stamp and its place.
    """
    sign = -1 if reverse else 1
    ordered = sorted(spans, key=lambda span: -span[1] if reverse else span[0])
    waiting: list[tuple[int, int, R]] = []  # heap; sorting all again took quadratic time
    for (_, _, span), following in zip_longest(ordered, ordered[1:]):
        limit = (-following[1] if reverse else following[0]) if following else math.inf
        run = sorted(rows_of(span), reverse=reverse)
        cut = bisect_left(run, limit, key=lambda row: sign * row[0])
        for row in run[cut:]:
            heappush(waiting, (sign * row[0], sign * row[1], row))
        del run[cut:]
        while waiting and waiting[0][0] < limit:
            run.append(heappop(waiting)[2])
        run.sort(reverse=reverse)
        yield run


DamageReport: TypeAlias = Callable[[BagError], object]
"""Function called with the error of each damaged part, which is then left out."""


def refuse_damage(error: BagError) -> NoReturn:
    """Raise the error of a damaged part, where nobody wants to read the rest."""
    raise error


class OpenBag(Closable, Protocol):
    """A bag that is open.

    Attributes:
        path: The file or folder.
        format: ``mcap``, ``rosbag`` (ROS 1) or ``rosbag2``.
    """

    path: Path
    format: str

    @property
    def size(self) -> int:
        """Size in bytes; in a bag that is written, with those that wait for the disk."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *exc_info: object) -> None: ...


class BagReader(OpenBag, Protocol):
    """A bag that is read by its index, lazily.

    Attributes:
        version: Version of the format, such as ``2.0``; empty if it has none.
        indexed: Whether the bag has its index. Without one, as after a recorder was killed, the
            index is made by reading through the file.
        start: Stamp of the earliest message; 0 in a bag without messages.
        end: Stamp of the latest message; 0 in a bag without messages.
    """

    version: str
    indexed: bool
    start: int
    end: int

    @property
    def channels(self) -> Sequence[Channel]:
        """All channels, in the order of the file."""

    @property
    def chunks(self) -> Sequence[Chunk]:
        """All chunks; empty in a format that has none."""

    @property
    def metadata(self) -> Mapping[str, Mapping[str, str]]:
        """Named texts by name of the record."""

    @property
    def problems(self) -> Sequence[BagError]:
        """The errors that were found when the bag was opened."""

    def count(self, channel: Channel | None = None) -> int:
        """Return the number of messages of a channel, or of all."""

    def messages(
        self,
        topics: Collection[str] | None = None,
        start: int | None = None,
        end: int | None = None,
        *,
        reverse: bool = False,
        damaged: DamageReport | None = None,
    ) -> Iterator[Entry]:
        """Yield messages in the order of their stamps.

        Args:
            topics: Full names of the topics; all when not given.
            start: Earliest stamp.
            end: Latest stamp; messages of this stamp are included.
            reverse: Whether to begin with the latest.
            damaged: Function called with each damaged part, which is left out; the first one is
                raised when not given.

        Raises:
            BagError: A part of the file is damaged.
        """

    def attachments(self) -> Iterator[Attachment]:
        """Yield the files within the bag.

        Raises:
            BagError: A part of the file is damaged.
        """


class BagWriter(OpenBag, Protocol):
    """A bag that is written."""

    def add(self, channel: Channel) -> int:
        """Add a channel; one that equals an earlier one is the same.

        Returns:
            Its handle, for `write`.

        Raises:
            BagError: The format cannot hold messages of such a channel.
        """

    def write(
        self, handle: int, stamp: int, data: Payload, sent: int | None = None, sequence: int = 0
    ) -> None:
        """Write a message.

        Args:
            handle: What `add` returned for its channel.
            stamp: Time at which it was received.
            data: The payload, in the encoding of the channel; must not change afterwards.
            sent: Time at which it was published; the stamp when not given.
            sequence: Number that the publisher gave it.

        Raises:
            BagError: The file cannot be written; also for earlier messages.
        """

    def add_metadata(self, name: str, texts: Mapping[str, str]) -> None:
        """Write named texts; a format that has none leaves them out.

        Raises:
            BagError: The file cannot be written.
        """

    def add_attachment(self, attachment: Attachment) -> None:
        """Write a file into the bag; a format that has none leaves it out.

        Raises:
            BagError: The file cannot be written.
        """

    def flush(self) -> None:
        """Write everything so far to the file.

        Raises:
            BagError: The file cannot be written.
        """

    def close(self) -> None:
        """Finish the file with its index; a second call has no effect.

        Raises:
            BagError: The file cannot be written.
        """
