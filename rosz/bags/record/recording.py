"""The files that a recording is written to."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from rosz.bags.bag import Channel, FileErrors, Payload
from rosz.bags.opening import ACTIVE, create_file
from rosz.bags.record.selection import RecordOptions
from rosz.errors import BagError
from rosz.lifecycle import Closing

if TYPE_CHECKING:
    from rosz.bags.formats.chunk_writer import ChunkWriter
    from rosz.bags.formats.ros1_form import FromCdr
    from rosz.typestore import TypeStore

_NOT_REPEATED = frozenset({"/rosout"})
"""Latched topics whose last message says nothing about the state of the robot."""


class Track:
    """A channel while it is recorded.

    Attributes:
        translate: Function that translates payloads for the format of the files.
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
    """The destination of recorded messages: files, or a ring in memory.

    Attributes:
        count: Number of messages taken.
        chunk_size: Bytes of messages that are in memory until they are written together.
    """

    count: int
    chunk_size: int

    @property
    def size(self) -> int:
        """Bytes of the messages."""

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
        """Flush messages, and apply limits of time.

        Raises:
            BagError: The file cannot be written.
        """

    def close(self) -> None:
        """Finish; a second call has no effect.

        Raises:
            BagError: The file cannot be written.
        """


class BagFiles(Closing):
    """The bags of one recording.

    A bag has the suffix ``.active`` until it is finished. No file is ever replaced.

    Args:
        options: Their names and limits.
        report: Function called with a sentence for the user.
        first: Number of the first bag, where they are numbered.

    Attributes:
        begin: Function called when a further bag has been opened, to write the parameters into it.
        finished: Set when the limit of a bag that is not split has been reached.
        done: The bags that are finished.
        count: Number of messages in all bags.
        chunk_size: Bytes of messages that are written together.

    Raises:
        BagError: The first bag cannot be created.
        UsageError: The compression is not known.
    """

    def __init__(
        self, options: RecordOptions, report: Callable[[str], object], first: int = 0
    ) -> None:
        self._options = options
        self._report = report
        self.begin: Callable[[BagFiles], object] | None = None
        self._lock = threading.RLock()
        self._tracks: list[Track] = []
        self._index = count(first)
        self._start = 0
        self._closed = False
        self._beginning = False
        self.finished: threading.Event = threading.Event()
        self.done: list[Path] = []
        self.count: int = 0
        self.chunk_size: int = options.largest_chunk
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
    def unwritten(self) -> int:
        """Number of messages taken that no file has."""
        return self.count - self._count_before - self._writer.message_count

    def _open(self, written: int = 0) -> None:
        """Begin a bag after those that have so many bytes."""
        self._target, self._writer = _create(self._options, next(self._index))
        self._written = written
        self._count_before = self.count  # messages in the bags before this one
        self._report(f"Recording to '{self._target}'.")
        if self.begin is not None:
            self._beginning = True
            try:
                self.begin(self)
            finally:
                self._beginning = False

    def track(self, channel: Channel, types: TypeStore) -> Track:
        """Begin to record a channel; see `Sink.track`."""
        translate = None
        if self._writer.format == "rosbag":
            from rosz.bags.formats.ros1_form import to_ros1  # MCAP needs no types

            channel, translate = to_ros1(channel, types)
        track = Track(channel, translate)
        self._tracks.append(track)
        return track

    def add_metadata(self, name: str, texts: dict[str, str]) -> None:
        """Write named texts into the bag."""
        self._writer.add_metadata(name, texts)

    def write(
        self, track: Track, stamp: int, data: Payload, sent: int | None, sequence: int
    ) -> int:
        """Write a message."""
        if track.translate is not None:
            data = track.translate(data, sequence)
        options = self._options
        with self._lock:
            if self._closed:
                return 0
            if self._beginning:  # what each bag begins with does not end it
                self._put(track, stamp, data, sent, sequence)
                return 0
            self._start = self._start or stamp
            over = options.duration and stamp - self._start >= options.duration
            if over and not self._next_bag(stamp):
                return 0
            self._put(track, stamp, data, sent, sequence)
            if track.repeated:
                track.last = data, sent, sequence
            if options.size and self._writer.size >= options.size:
                self._next_bag(stamp)
            return 0

    def _put(
        self, track: Track, stamp: int, data: Payload, sent: int | None, sequence: int
    ) -> None:
        writer = self._writer
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
        self._open(self.size)
        self._start = stamp
        for track in self._tracks:
            if track.last is not None:
                self._put(track, stamp, *track.last)
        most = self._options.max_splits
        while most and len(self.done) >= most:
            oldest = self.done.pop(0)
            with FileErrors(oldest, "cannot delete it"):
                oldest.unlink(missing_ok=True)
            self._report(f"Deleted '{oldest}', the oldest of {most} bags.")
        return True

    def tick(self, now: int) -> None:
        """Flush messages to the file, and end the recording in time; see `Sink.tick`."""
        with self._lock:
            if self._closed:
                return
            self._writer.flush()
            self._start = self._start or now
            over = now - self._start >= self._options.duration
            if self._options.duration and over and not self._options.split:
                self.finished.set()

    def close(self) -> None:
        """Finish the bag; a second call has no effect."""
        with self._lock:
            if not self._closed:
                self._closed = True
                self._finish()

    def _finish(self) -> None:
        active = self._writer.path
        try:
            self._writer.close()
        except BagError:
            if self._writer.complete:
                self._report(f"'{self._target}' has {self._writer.message_count} messages.")
            raise
        finally:
            if self._writer.complete and self._target not in self.done:
                if self._target.exists():
                    raise BagError(f"'{self._target}' has appeared meanwhile", str(active))
                with FileErrors(active, f"cannot rename it to '{self._target}'"):
                    active.rename(self._target)
                self.done.append(self._target)


def _create(options: RecordOptions, index: int) -> tuple[Path, ChunkWriter]:
    """Return the path of a new bag, and its writer."""
    now = datetime.now().astimezone()
    wanted = options.target(index, now)
    for number in count():
        target = wanted.with_stem(f"{wanted.stem}-{number}") if number else wanted
        active = target.with_name(target.name + ACTIVE)
        taken = next((path for path in (target, active) if path.exists()), None)
        if taken is not None and options.name:
            hint = "'rosz bag reindex' finishes it" if taken == active else "choose another name"
            raise BagError(f"it exists already, and nothing is overwritten; {hint}", str(taken))
        if taken is None:
            with suppress(FileExistsError):
                return target, create_file(
                    active,
                    compression=options.compression,
                    chunk_size=options.largest_chunk,
                    # Checksums take longer than receiving and writing uncompressed messages.
                    checksums=options.compression != "none",
                )
    raise AssertionError  # count() has no end
