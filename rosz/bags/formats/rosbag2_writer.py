"""Writing of rosbag2's bags: a folder with ``metadata.yaml``, and a file of SQLite or MCAP.

Both are those of ROS 2 Jazzy. What a bag holds beside messages is where rosbag2 has a place for it:
named texts are in the MCAP file, or in the ``custom_data`` of the metadata.
"""

from __future__ import annotations

import os
import sqlite3
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from rosz.bags import bag
from rosz.bags.formats.channel_text import format_profiles, profile_rows
from rosz.bags.formats.mcap_reader import McapReader
from rosz.bags.formats.mcap_writer import McapWriter
from rosz.bags.formats.rosbag2_reader import METADATA, METADATA_RECORD, Storage
from rosz.bags.formats.writing import BagUnfinished
from rosz.errors import BagError, ClosedError, UsageError
from rosz.lifecycle import Closing

_VERSION = 9
_DISTRIBUTION = "jazzy"
_LATEST = (1 << 63) - 1
_BATCH = 1 << 20
_SCHEMA = """
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
CREATE TABLE metadata(
    id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
CREATE TABLE topics(
    id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
    serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL,
    type_description_hash TEXT NOT NULL);
CREATE TABLE message_definitions(
    id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL,
    encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);
CREATE TABLE messages(
    id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
    data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
INSERT INTO schema VALUES (4, 'jazzy');
"""


class _SqliteWriter(Closing):
    """The file of a bag that SQLite writes; see `rosz.bags.BagWriter`.

    The compression is ``none``, or ``zstd`` for messages that are compressed one by one.
    """

    format = "rosbag2"

    def __init__(self, path: Path, compression: bag.Compression) -> None:
        if compression not in {"none", "zstd"}:
            raise UsageError(
                f"rosbag2's SQLite storage has no compression '{compression}'; it has zstd and none"
            )
        self._compress: Any = None
        if compression == "zstd":
            self._compress = bag.compression_library("zstd").ZstdCompressor(level=1).compress
        self.path = path
        self._rows: list[tuple[int, int, bag.Payload]] = []
        self._waiting = self._written = 0
        self._channels: list[bag.Channel] = []
        self._defined: set[str] = set()
        try:
            self._database = sqlite3.connect(path, check_same_thread=False)
            self._database.executescript(_SCHEMA)
        except sqlite3.Error as error:
            raise BagError(f"cannot create it: {error}", str(path)) from error

    @property
    def size(self) -> int:
        return self._written + self._waiting

    def _execute(self, query: str, rows: list[Any]) -> None:
        try:
            with self._database:
                self._database.executemany(query, rows)
        except sqlite3.Error as error:
            raise BagUnfinished(str(error), str(self.path)) from error

    def add(self, channel: bag.Channel) -> int:
        self._channels.append(channel)
        handle = len(self._channels)
        qos = format_profiles(channel.qos, names=True).strip()
        row = (handle, channel.topic, channel.type, channel.encoding, qos, channel.type_hash)
        self._execute("INSERT INTO topics VALUES (?, ?, ?, ?, ?, ?)", [row])
        if channel.definition and channel.type not in self._defined:
            self._defined.add(channel.type)
            text = channel.language or "ros2msg", channel.definition, channel.type_hash
            self._execute(
                "INSERT INTO message_definitions(topic_type, encoding, encoded_message_definition,"
                " type_description_hash) VALUES (?, ?, ?, ?)",
                [(channel.type, *text)],
            )
        return handle

    def write(
        self, handle: int, stamp: int, data: bag.Payload, sent: int | None = None, sequence: int = 0
    ) -> None:
        del sent, sequence  # the format has no place for them
        packed = data if self._compress is None else self._compress(data)
        self._rows.append((handle, stamp, packed))
        self._waiting += len(packed)
        if self._waiting >= _BATCH:
            self.flush()

    def flush(self) -> None:
        rows, self._rows = self._rows, []
        self._written, self._waiting = self.size, 0
        self._execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", rows)

    def add_metadata(self, name: str, texts: Mapping[str, str]) -> None:
        (row,) = texts.values()  # the folder keeps those of other names in its own metadata
        del name
        query = "INSERT INTO metadata(metadata_version, metadata) VALUES (?, ?)"
        self._execute(query, [(_VERSION, row)])

    def add_attachment(self, attachment: bag.Attachment) -> None:
        """Leave it out: the format has no place for it."""

    def close(self) -> None:
        try:
            self.flush()
        finally:
            self._database.close()


class Rosbag2Writer(Closing):
    """A folder of rosbag2 that is written; see `rosz.bags.BagWriter`.

    The folder must not exist, or be empty. Channels have the encoding ``cdr``; publishers of a
    topic that offer the same are one. Compressions are ``none``, ``zstd``, and ``lz4`` in MCAP.
    """

    format = "rosbag2"

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        storage: Storage = "mcap",
        compression: bag.Compression = "none",
    ) -> None:
        self.path = Path(path)
        self._storage = storage
        self._by_message = storage == "sqlite3" and compression == "zstd"
        self._lock = threading.Lock()
        self._handles: dict[bag.Channel, int] = {}
        self._counts: dict[int, int] = {}
        self._custom: dict[str, str] = {}
        self._start, self._end = _LATEST, 0
        self._closed = False
        made = not self.path.exists()
        with bag.FileErrors(path, "cannot create it"):
            self.path.mkdir(parents=True, exist_ok=True)
            if any(self.path.iterdir()):
                raise BagError("cannot create it: the folder exists, and is not empty", str(path))
        suffix = ".mcap" if storage == "mcap" else ".db3"
        file = self.path / f"{self.path.absolute().name}_0{suffix}"
        try:
            self._part: bag.BagWriter = (
                McapWriter(file, compression=compression)
                if storage == "mcap"
                else _SqliteWriter(file, compression)
            )
        except (BagError, UsageError):
            with suppress(OSError):
                if made:
                    self.path.rmdir()
            raise

    @property
    def size(self) -> int:
        """Bytes written so far, and those that wait for the disk."""
        return self._part.size

    def add(self, channel: bag.Channel) -> int:
        """Add a channel; one that differs from an earlier one in the node only is the same."""
        if channel.encoding == "ros1":
            raise BagError(
                f"a bag of rosbag2 cannot hold messages of '{channel.topic}' as ros1; 'rosz bag"
                " convert' translates them",
                str(self.path),
            )
        form = msgspec.structs.replace(channel, node="", md5="")
        with self._lock:
            self._check()
            handle = self._handles.get(form)
            if handle is None:
                handle = self._handles[form] = self._part.add(form)
                self._counts[handle] = 0
            return handle

    def write(
        self, handle: int, stamp: int, data: bag.Payload, sent: int | None = None, sequence: int = 0
    ) -> None:
        """Write a message; see `rosz.bags.BagWriter.write`."""
        with self._lock:
            self._check()
            self._part.write(handle, stamp, data, sent, sequence)
            self._counts[handle] += 1
            self._start, self._end = min(self._start, stamp), max(self._end, stamp)

    def add_metadata(self, name: str, texts: Mapping[str, str]) -> None:
        """Write named texts."""
        if self._storage == "mcap":
            self._part.add_metadata(name, texts)
        else:
            self._custom |= {f"{name}/{key}": text for key, text in texts.items()}

    def add_attachment(self, attachment: bag.Attachment) -> None:
        """Write a file into the bag, which only MCAP can hold; SQLite leaves it out."""
        self._part.add_attachment(attachment)

    def flush(self) -> None:
        """Write everything so far to the file."""
        with self._lock:
            self._check()
            self._part.flush()

    def close(self) -> None:
        """Finish the file, and write the metadata."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
        import yaml  # slow to import, and most bags do without

        information = self._information()
        try:
            inner = yaml.safe_dump(information, sort_keys=False, allow_unicode=True)
            self._part.add_metadata(METADATA_RECORD, {"serialized_metadata": inner})
        finally:
            self._part.close()
        _write_file(self.path / METADATA, information)

    def _check(self) -> None:
        if self._closed:
            raise ClosedError(f"the bag '{self.path}' is closed")

    def _information(self) -> dict[str, Any]:
        counts = {channel: self._counts[handle] for channel, handle in self._handles.items()}
        part = _Part(self._part.path.name, self._start, self._end, counts)
        compressed = {"compression_format": "zstd", "compression_mode": "MESSAGE"}
        more = compressed if self._by_message else {}
        return _describe(self._storage, [part]) | more | {"custom_data": self._custom or None}


class _Part(NamedTuple):
    """A file of a bag: its name, the times of its first and last message, and their numbers."""

    name: str
    start: int
    end: int
    counts: Mapping[bag.Channel, int]

    @property
    def covered(self) -> dict[str, Any]:
        return {
            "duration": {"nanoseconds": max(0, self.end - self.start)},
            "starting_time": {"nanoseconds_since_epoch": self.start},
            "message_count": sum(self.counts.values()),
        }


def _describe(storage: Storage, parts: Sequence[_Part]) -> dict[str, Any]:
    """Return the metadata of a bag of some files."""
    counts: dict[bag.Channel, int] = {}
    for part in parts:
        for channel, count in part.counts.items():
            counts[channel] = counts.get(channel, 0) + count
    start, end = min(part.start for part in parts), max(part.end for part in parts)
    return {
        "version": _VERSION,
        "storage_identifier": storage,
        **_Part("", start, end, counts).covered,
        "topics_with_message_count": [
            {"topic_metadata": _topic_row(channel), "message_count": count}
            for channel, count in counts.items()
        ],
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [part.name for part in parts],
        "files": [{"path": part.name, **part.covered} for part in parts],
        "custom_data": None,
        "ros_distro": _DISTRIBUTION,
    }


def write_metadata(folder: Path) -> None:
    """Write the metadata of a folder of MCAP files, which makes it a bag of rosbag2.

    Raises:
        BagError: A file cannot be read, or the metadata cannot be written.
    """
    parts: list[_Part] = []
    for file in sorted(folder.glob("*.mcap")):
        with McapReader(file) as reader:
            counts: dict[bag.Channel, int] = {}
            for channel in reader.channels:
                form = msgspec.structs.replace(channel, node="", md5="")
                counts[form] = counts.get(form, 0) + reader.count(channel)
            parts.append(_Part(file.name, reader.start, reader.end, counts))
    _write_file(folder / METADATA, _describe("mcap", parts))


def _write_file(file: Path, information: Mapping[str, Any]) -> None:
    import yaml  # slow to import, and most bags do without

    whole = {"rosbag2_bagfile_information": information}
    with bag.FileErrors(file, "cannot write it"):
        text = yaml.safe_dump(whole, sort_keys=False, allow_unicode=True)
        file.write_text(text, encoding="utf-8")


def _topic_row(channel: bag.Channel) -> dict[str, Any]:
    return {
        "name": channel.topic,
        "type": channel.type,
        "serialization_format": channel.encoding,
        "offered_qos_profiles": profile_rows(channel.qos, names=True),
        "type_description_hash": channel.type_hash,
    }
