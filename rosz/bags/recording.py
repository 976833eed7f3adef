"""What is recorded, and the files that it is written to."""

from __future__ import annotations

import re
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, Self

import msgspec

from rosz.bags.bag import Channel, Compression, Payload
from rosz.bags.buffer import ROW_BYTES
from rosz.bags.opening import ACTIVE, create_file
from rosz.errors import BagError, UsageError
from rosz.wire import Kind, Token

if TYPE_CHECKING:
    from rosz.bags.chunk_writer import ChunkWriter
    from rosz.bags.ros1_form import FromCdr
    from rosz.typestore import TypeStore

__all__ = ("BagFiles", "RecordOptions", "Ring", "Selection", "Sink", "Track")

_SUFFIXES = (".mcap", ".bag")
_NEVER_FULL = 1 << 62
_MOST_WAITING = 8 << 20
"""Bytes that are handed to the thread that compresses and writes; more wait in the buffer, where
the oldest make room."""
_SERVICE_EVENT = "/_service_event"
_NOT_REPEATED = frozenset({"/rosout"})
"""Latched topics whose last message says nothing about the state of the robot."""


class RecordOptions(msgspec.Struct, frozen=True):
    """What rosbag's options mean.

    Attributes:
        name: Name of the bag, with or without suffix; empty for one made of ``prefix`` and date.
        prefix: Begin of the name.
        split: Whether a bag that reaches its limit is followed by another one.
        size: Largest size in bytes; 0 for no limit.
        duration: Longest duration in nanoseconds; 0 for no limit.
        max_splits: Number of bags to keep; older ones are deleted; 0 for all.
        buffer: Bytes that may wait to be written; 0 for no limit.
        chunk_size: Bytes that are written, and compressed, together.
        compression: Name of the compression.
    """

    name: str = ""
    prefix: str = ""
    split: bool = False
    size: int = 0
    duration: int = 0
    max_splits: int = 0
    buffer: int = 256 << 20
    chunk_size: int = 768 << 10
    compression: Compression = "none"

    @property
    def suffix(self) -> str:
        """The suffix of the files."""
        given = Path(self.name or self.prefix).suffix
        return given if given in _SUFFIXES else _SUFFIXES[0]

    @property
    def folder(self) -> str:
        """The folder of the files."""
        return str(Path(self.name or self.prefix or ".").parent)

    def target(self, index: int, now: datetime) -> Path:
        """Return the path of a bag.

        Args:
            index: Number of the bag, from 0.
            now: Time at which it begins.
        """
        given = self.name or self.prefix
        parts = [given.removesuffix(self.suffix)] if given else []
        if not self.name:
            parts.append(now.strftime("%Y-%m-%d-%H-%M-%S"))
        if self.split:
            parts.append(str(index))
        return Path("_".join(parts) + self.suffix)


class Selection:
    """The topics that are recorded.

    Args:
        topics: Full names of topics, or regular expressions that match whole names.
        every: Whether all topics are recorded.
        regex: Whether the topics are regular expressions.
        exclude: Regular expression of topics that are not recorded.
        node: Full name of a node whose subscribed topics are recorded.
        services: Whether the events of services that are introspected are recorded.

    Attributes:
        topics: As given.
        named: Whether only topics with the given names are recorded.

    Raises:
        UsageError: An expression is not valid.
    """

    def __init__(
        self,
        topics: tuple[str, ...] = (),
        *,
        every: bool = False,
        regex: bool = False,
        exclude: str = "",
        node: str = "",
        services: bool = False,
    ) -> None:
        self.topics = topics
        self.named: bool = not (every or regex or node or services)
        self._every = every
        self._patterns = [_compile(one) for one in topics] if regex else []
        self._names = frozenset() if regex else frozenset(topics)
        self._exclude = _compile(exclude) if exclude else None
        self._node = node
        self._services = services

    @property
    def at_once(self) -> list[str]:
        """The topics to subscribe to although they are not published yet."""
        return sorted(name for name in self._names if not self._is_excluded(name))

    def has(self, token: Token) -> bool:
        """Return whether an entity makes its topic one that is recorded."""
        name = token.name
        if token.kind not in {Kind.PUBLISHER, Kind.SUBSCRIPTION} or self._is_excluded(name):
            return False
        if token.kind is Kind.SUBSCRIPTION:
            return token.node_name == self._node
        if name in self._names or any(one.fullmatch(name) for one in self._patterns):
            return True
        if name.endswith(_SERVICE_EVENT):
            return self._services
        return self._every

    def _is_excluded(self, name: str) -> bool:
        return self._exclude is not None and self._exclude.fullmatch(name) is not None


def _compile(expression: str) -> re.Pattern[str]:
    try:
        return re.compile(expression)
    except re.error as error:
        raise UsageError(f"'{expression}' is not a regular expression: {error}") from error


class Track:
    """A channel while it is recorded.

    Args:
        channel: The channel.
        translate: Function that translates payloads for the format of the files.

    Attributes:
        channel: As given.
        translate: As given.
        count: Number of its messages.
        last: Its last message: payload, time of sending, sequence number.
    """

    __slots__ = ("channel", "count", "file", "handle", "last", "repeated", "translate")

    def __init__(self, channel: Channel, translate: FromCdr | None) -> None:
        self.channel = channel
        self.translate = translate
        self.count = 0
        self.handle = 0
        self.file: ChunkWriter | None = None
        self.repeated: bool = channel.latched and channel.topic not in _NOT_REPEATED
        self.last: tuple[Payload, int | None, int] | None = None


class Sink(Protocol):
    """What takes the messages of a recording: files, or a ring in memory.

    Attributes:
        count: Number of messages taken.
    """

    count: int

    @property
    def size(self) -> int:
        """Bytes of the messages."""

    @property
    def waiting(self) -> int:
        """Bytes that wait for the disk."""

    @property
    def unwritten(self) -> int:
        """Number of messages taken that no file has."""

    def track(self, channel: Channel, types: TypeStore) -> Track:
        """Begin to record a channel.

        Raises:
            RoszError: The definition cannot be translated for the format of the files.
        """

    def write(
        self, track: Track, stamp: int, data: Payload, sent: int | None, sequence: int
    ) -> int:
        """Take a message; return the number of messages that were lost by that.

        Raises:
            BagError: The file cannot be written.
            MessageError: The message cannot be translated for the format of the files.
        """

    def tick(self, now: int) -> None:
        """Do what is due.

        Raises:
            BagError: The file cannot be written.
        """

    def close(self) -> None:
        """Finish; a second call has no effect.

        Raises:
            BagError: The file cannot be written.
        """


class BagFiles:
    """The bags of one recording.

    A bag has the suffix ``.active`` until it is finished. No file is ever replaced.

    Args:
        options: Their names and limits.
        report: Function called with a sentence for the user.
        first: Number of the first bag, where they are numbered.

    Attributes:
        begin: Function called when a further bag has been opened, to write what each begins with.
        finished: Set when the limit of a bag that is not split has been reached.
        done: The bags that are finished.
        count: Number of messages in all bags.

    Raises:
        BagError: The first bag cannot be created.
        UsageError: The compression is not known.
    """

    def __init__(
        self,
        options: RecordOptions,
        report: Callable[[str], object],
        first: int = 0,
    ) -> None:
        self._options = options
        self._report = report
        self.begin: Callable[[BagFiles], object] | None = None
        self._lock = threading.RLock()
        self._tracks: list[Track] = []
        self._index = count(first)
        self._start = 0
        self._written = 0
        self._count_before = 0  # messages in the bags before this one
        self._closed = False
        self._beginning = False
        self.finished: threading.Event = threading.Event()
        self.done: list[Path] = []
        self.count: int = 0
        self._open()

    @property
    def path(self) -> Path:
        """The bag that is being written, as it will be named."""
        return self._target

    @property
    def size(self) -> int:
        """Bytes of all bags."""
        return self._written + self._writer.size

    @property
    def waiting(self) -> int:
        """Bytes that wait for the disk."""
        return self._writer.waiting

    @property
    def unwritten(self) -> int:
        """Number of messages taken that no file has."""
        return self.count - self._count_before - self._writer.written

    def _open(self) -> None:
        self._target, self._writer = _create(self._options, next(self._index))
        self._report(f"Recording to '{self._target}'.")
        if self.begin is not None:
            self._beginning = True
            try:
                self.begin(self)
            finally:
                self._beginning = False

    def track(self, channel: Channel, types: TypeStore) -> Track:
        """Begin to record a channel.

        Raises:
            RoszError: The definition cannot be translated for the format of the files.
        """
        translate = None
        if self._writer.format == "rosbag":
            from rosz.bags.ros1_form import to_ros1  # MCAP needs no types

            channel, translate = to_ros1(channel, types)
        track = Track(channel, translate)
        self._tracks.append(track)
        return track

    def add_metadata(self, name: str, texts: dict[str, str]) -> None:
        """Write named texts into the bag.

        Raises:
            BagError: The file cannot be written.
        """
        self._writer.add_metadata(name, texts)

    def write(
        self, track: Track, stamp: int, data: Payload, sent: int | None, sequence: int
    ) -> int:
        """Write a message, when there is room for it."""
        if track.translate is not None:
            data = track.translate(data, sequence)
        options = self._options
        self._writer.wait_for_room(min(_MOST_WAITING, options.buffer // 4 or _MOST_WAITING))
        with self._lock:
            if self._closed:
                return 0
            writer = self._writer
            if self._beginning:  # what each bag begins with does not end it
                self._put(writer, track, stamp, data, sent, sequence)
                return 0
            self._start = self._start or stamp
            if options.duration and stamp - self._start >= options.duration:
                if not self._next_bag(stamp):
                    return 0
                writer = self._writer
            self._put(writer, track, stamp, data, sent, sequence)
            if track.repeated:
                track.last = data, sent, sequence
            if options.size and writer.size >= options.size:
                self._next_bag(stamp)
            return 0

    def _put(
        self,
        writer: ChunkWriter,
        track: Track,
        stamp: int,
        data: Payload,
        sent: int | None,
        sequence: int,
    ) -> None:
        if track.file is not writer:
            track.handle = writer.add(track.channel)
            track.file = writer
        writer.write(track.handle, stamp, data, sent, sequence)
        track.count += 1
        self.count += 1

    def _next_bag(self, stamp: int) -> bool:
        """End the bag, and begin the next one; return whether there is to be one.

        It begins with the last message of every latched channel, so that it can be used alone.
        """
        if not self._options.split:
            self.finished.set()
            return False
        self._finish()
        self._written += self._writer.size
        self._count_before = self.count
        self._start = stamp
        self._open()
        for track in self._tracks:
            if track.last is not None:
                self._put(self._writer, track, stamp, *track.last)
        most = self._options.max_splits
        while most and len(self.done) >= most:
            oldest = self.done.pop(0)
            oldest.unlink(missing_ok=True)
            self._report(f"Deleted '{oldest}', the oldest of {most} bags.")
        return True

    def tick(self, now: int) -> None:
        """Flush to the file what has been written, and end a bag whose time is over.

        Args:
            now: Current time, in nanoseconds.

        Raises:
            BagError: The file cannot be written.
        """
        with self._lock:
            if self._closed:
                return
            self._writer.start_flush()
            self._start = self._start or now
            over = now - self._start >= self._options.duration
            if self._options.duration and over and not self._options.split:
                self.finished.set()

    def close(self) -> None:
        """Finish the bag; a second call has no effect.

        Raises:
            BagError: The file cannot be written.
        """
        with self._lock:
            if not self._closed:
                self._closed = True
                self._finish()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc_info: object) -> None:
        self.close()

    def _finish(self) -> None:
        active = self._writer.path
        try:
            self._writer.close()
        except BagError:
            if self._writer.complete:
                self._report(f"'{self._target}' has {self._writer.written} messages.")
            raise
        finally:
            if self._writer.complete:
                if self._target.exists():
                    raise BagError(f"'{self._target}' has appeared meanwhile", str(active))
                active.rename(self._target)
                self.done.append(self._target)


def _create(options: RecordOptions, index: int) -> tuple[Path, ChunkWriter]:
    """Return the path of a new bag, and its writer."""
    now = datetime.now().astimezone()
    wanted = options.target(index, now)
    for number in count():
        target = wanted.with_stem(f"{wanted.stem}-{number}") if number else wanted
        active = target.with_name(target.name + ACTIVE)
        taken = next((one for one in (target, active) if one.exists()), None)
        if taken is not None and options.name:
            hint = "'rosz bag reindex' finishes it" if taken == active else "choose another name"
            raise BagError(f"it exists already, and nothing is overwritten; {hint}", str(taken))
        if taken is None:
            with suppress(FileExistsError):
                return target, create_file(
                    active,
                    compression=options.compression,
                    chunk_size=min(options.chunk_size, options.buffer // 4 or _NEVER_FULL),
                    capacity=_NEVER_FULL,
                    # They take longer than receiving and writing uncompressed messages.
                    checksums=options.compression != "none",
                )
    raise AssertionError  # count() has no end


class Ring:
    """The messages of the last seconds, which become a bag when that is asked for.

    Args:
        options: Name and limits of the bags.
        duration: Time that is kept, in nanoseconds.
        report: Function called with a sentence for the user.

    Attributes:
        end: Function called with each bag that is asked for, to write what it ends with.
    """

    def __init__(
        self, options: RecordOptions, duration: int, report: Callable[[str], object]
    ) -> None:
        self._options = options
        self._duration = duration
        self._report = report
        self._lock = threading.Lock()
        self._rows: deque[tuple[Track, int, Payload, int | None, int]] = deque()
        self._bytes = 0
        self._tracks: dict[Track, TypeStore] = {}
        self._saved = 0
        self.end: Callable[[BagFiles], object] | None = None
        self.count: int = 0

    @property
    def size(self) -> int:
        """Bytes of memory of the messages that are kept."""
        return self._bytes

    @property
    def waiting(self) -> int:
        """Nothing waits for the disk."""
        return 0

    @property
    def unwritten(self) -> int:
        """Nothing is lost with a file."""
        return 0

    def track(self, channel: Channel, types: TypeStore) -> Track:
        """Begin to record a channel."""
        track = Track(channel, None)
        with self._lock:
            self._tracks[track] = types
        return track

    def write(
        self, track: Track, stamp: int, data: Payload, sent: int | None, sequence: int
    ) -> int:
        """Keep a message, and let go of old ones; return how many of these were not too old."""
        with self._lock:
            self.count += 1
            track.count += 1
            self._rows.append((track, stamp, data, sent, sequence))
            self._bytes += len(data) + ROW_BYTES
            return self._trim(stamp)

    def tick(self, now: int) -> None:
        """Let go of old messages."""
        with self._lock:
            self._trim(now)

    def close(self) -> None:
        """Let go of all messages."""
        with self._lock:
            self._rows.clear()
            self._bytes = 0

    def _trim(self, now: int) -> int:
        rows, most, lost = self._rows, self._options.buffer, 0
        while rows and (now - rows[0][1] > self._duration or (most and self._bytes > most)):
            track, stamp, data, sent, sequence = rows.popleft()
            self._bytes -= len(data) + ROW_BYTES
            lost += now - stamp <= self._duration
            if track.repeated:
                track.last = data, sent, sequence
        return lost

    def save(self, now: int) -> Path:
        """Write what is kept into a bag, which begins with the last latched messages before it.

        From the second one on, bags whose name is given are numbered.

        Args:
            now: Current time, in nanoseconds.

        Returns:
            The bag.

        Raises:
            BagError: The file cannot be written.
        """
        with self._lock:
            self._trim(now)
            rows, tracks = list(self._rows), dict(self._tracks)
            latched = [(track, track.last) for track in tracks if track.last is not None]
        split = self._options.split or bool(self._options.name and self._saved)
        options = msgspec.structs.replace(self._options, duration=0, size=0, buffer=0, split=split)
        with BagFiles(options, self._report, self._saved) as files:
            made = {track: files.track(track.channel, types) for track, types in tracks.items()}
            for track, last in latched:
                files.write(made[track], rows[0][1] if rows else now, *last)
            for track, stamp, data, sent, sequence in rows:
                files.write(made[track], stamp, data, sent, sequence)
            if self.end is not None:
                self.end(files)
        self._saved += 1
        return files.done[-1]
