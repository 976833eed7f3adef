"""Recording into memory, of which the last seconds become a bag."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

import msgspec

from rosz.bags.bag import Channel, Payload
from rosz.bags.record.queue import ROW_BYTES
from rosz.bags.record.recording import BagFiles, Track
from rosz.bags.record.selection import RecordOptions
from rosz.queue import BoundedQueue
from rosz.typestore import TypeStore

_RingRow: TypeAlias = tuple[Track, int, Payload, int | None, int]
"""Track, stamp, payload, time of sending, sequence number."""


class Ring:
    """The messages of the last seconds, which become a bag when that is asked for.

    Args:
        options: Name and limits of the bags.
        duration: Time that is kept, in nanoseconds.
        report: Function called with a sentence for the user.

    Attributes:
        end: Function called with each saved bag, to write the parameters into it.
    """

    def __init__(
        self, options: RecordOptions, duration: int, report: Callable[[str], object]
    ) -> None:
        self._options = options
        self._duration = duration
        self._report = report
        self._lock = threading.Lock()
        self._rows: BoundedQueue[_RingRow] = BoundedQueue(most_bytes=options.buffer)
        self._tracks: dict[Track, TypeStore] = {}
        self._saved = 0
        self.end: Callable[[BagFiles], object] | None = None
        self.count: int = 0
        self.chunk_size: int = 0

    @property
    def size(self) -> int:
        """Bytes of memory of the messages that are kept."""
        return self._rows.size

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
            row = track, stamp, data, sent, sequence
            dropped = self._rows.put(row, len(data) + ROW_BYTES)
            for old in dropped:
                _remember(old)
            self._trim(stamp)
            return sum(stamp - old[1] <= self._duration for old in dropped)

    def tick(self, now: int) -> None:
        """Let go of old messages."""
        with self._lock:
            self._trim(now)

    def close(self) -> None:
        """Let go of all messages."""
        with self._lock:
            self._rows.clear()

    def _trim(self, now: int) -> None:
        while self._rows and now - self._rows.oldest[1] > self._duration:
            _remember(self._rows.pop())

    def save(self, now: int) -> Path:
        """Write the messages into a bag, behind the last latched ones from before them.

        From the second one on, bags whose name is given are numbered.

        Args:
            now: Current time, in nanoseconds.

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


def _remember(row: _RingRow) -> None:
    """Keep the last message of a latched channel that the ring lets go."""
    track, _, data, sent, sequence = row
    if track.repeated:
        track.last = data, sent, sequence
