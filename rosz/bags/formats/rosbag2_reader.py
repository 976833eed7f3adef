"""Reading of rosbag2's bags: folders with ``metadata.yaml``, and files of SQLite or MCAP in them.

The files of a bag are read one after the other, merged where they overlap in time. The contents
count, not what ``metadata.yaml`` says of them, which is missing where a recorder was killed.
"""

from __future__ import annotations

import heapq
import os
import sqlite3
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from functools import cached_property, partial
from itertools import chain
from pathlib import Path
from typing import Any, Literal, TypeAlias
from urllib.parse import quote

from rosz.bags import bag
from rosz.bags.formats.channel_text import parse_profiles
from rosz.bags.formats.chunks import ChunkError, unpack_file, unpack_message
from rosz.bags.formats.mcap_reader import McapReader
from rosz.errors import BagError
from rosz.lifecycle import Closing

Storage: TypeAlias = Literal["mcap", "sqlite3"]
STORAGES: tuple[Storage, ...] = ("mcap", "sqlite3")
METADATA = "metadata.yaml"
METADATA_RECORD = "rosbag2"
"""Name of the record in MCAP that has the metadata too."""
_SUFFIXES = (".db3", ".mcap")
_DAMAGE = (sqlite3.Error, ValueError)
"""Errors that the sqlite3 module raises for a damaged file; a ValueError if a text is damaged."""
_COMPUTED = (
    "SELECT name FROM sqlite_master WHERE type = 'view' OR type = 'table' AND rootpage = 0"
    " UNION ALL SELECT t.name FROM sqlite_master AS t JOIN pragma_table_xinfo(t.name) AS c"
    " WHERE t.type = 'table' AND c.hidden > 0"
)
"""Query for views, virtual tables, and tables with columns that are computed."""
_ZSTD_FRAME = b"\x28\xb5\x2f\xfd"


class SqliteReader(Closing):
    """A file that rosbag2's SQLite storage has written."""

    format = "rosbag2"
    metadata: Mapping[str, Mapping[str, str]] = {}
    chunks: Sequence[bag.Chunk] = ()

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self.version = ""
        self.problems: Sequence[BagError] = ()
        if not self.path.is_file():
            raise BagError("there is no such file", str(path))
        self.size: int = self.path.stat().st_size
        address = f"file:{quote(str(self.path.absolute()))}?mode=ro"
        self._database = sqlite3.connect(address, uri=True, check_same_thread=False)
        self._database.text_factory = partial(str, encoding="utf-8", errors="replace")
        self._damage: list[tuple[int, int, int]] | None = None
        try:
            self._read()
        except BaseException:
            self._database.close()
            raise

    def _read(self) -> None:
        try:
            self._channels = self._read_channels()
            counts = self._rows("SELECT topic_id, COUNT(*) FROM messages GROUP BY topic_id")
            first, last = self._read_times()
            indexes = self._rows("SELECT 1 FROM sqlite_master WHERE name = 'timestamp_idx'")
        except BagError as error:
            # With this, SQLite reads a file that has less pages than its header says.
            self._database.execute("PRAGMA writable_schema = ON")
            try:
                self._channels = self._read_channels()
            except BagError:
                raise error from None
            self.problems = (error,)
            self._damage = self._find_rows()
            stamps = [stamp for stamp, _, _ in self._damage]
            counts = list(Counter(key for _, key, _ in self._damage).items())
            first, last, indexes = min(stamps, default=0), max(stamps, default=0), []
        self._counts: dict[int, int] = {
            key: number for key, number in counts if key in self._channels
        }
        self.start: int = first
        self.end: int = last
        self.indexed = bool(indexes)

    def _read_times(self) -> tuple[int, int]:
        ((first, last),) = self._rows("SELECT MIN(timestamp), MAX(timestamp) FROM messages")
        if not all(_is_stamp(stamp or 0) for stamp in (first, last)):
            raise BagError("damaged: the time of a message is none", str(self.path))
        return first or 0, last or 0

    def _find_rows(self) -> list[tuple[int, int, int]]:
        """Return stamp, topic and place of the messages before and after the damage."""
        rows: set[tuple[int, int, int]] = set()
        for order in ("ASC", "DESC"):
            query = (
                "SELECT timestamp, topic_id, id FROM messages NOT INDEXED"  # noqa: S608  # no values
                f" ORDER BY id {order}"
            )
            try:
                for row in self._database.execute(query):
                    stamp, key, place = row
                    if _is_stamp(stamp) and key in self._channels and isinstance(place, int):
                        rows.add(row)
            except _DAMAGE:
                continue  # the problem has been noted
        return sorted(rows)

    @property
    def channels(self) -> Sequence[bag.Channel]:
        """All channels, in the order of the file."""
        return list(self._channels.values())

    def _rows(self, query: str) -> list[Any]:
        try:
            return self._database.execute(query).fetchall()
        except _DAMAGE as error:
            raise BagError(f"not a bag of rosbag2, or damaged: {error}", str(self.path)) from error

    def _read_channels(self) -> dict[int, bag.Channel]:
        for (name,) in self._rows(_COMPUTED):
            reason = f"its '{name}' is computed, perhaps without end; expected a table of values"
            raise BagError(reason, str(self.path))
        tables = {name for (name,) in self._rows("SELECT name FROM sqlite_master")}
        columns = [row[1] for row in self._rows("PRAGMA table_info(topics)")]
        definitions: dict[str, tuple[str, str]] = {}
        if "message_definitions" in tables:
            definitions = {
                name: (text, encoding)
                for name, encoding, text in self._rows(
                    "SELECT topic_type, encoding, encoded_message_definition"
                    " FROM message_definitions"
                )
            }
        channels = {}
        needed = {"id", "name", "type", "serialization_format"}
        for row in self._rows("SELECT * FROM topics"):
            topic = dict(zip(columns, row, strict=True))
            texts = [value for name, value in topic.items() if name != "id"]
            if not (needed <= topic.keys() and all(isinstance(text, str | None) for text in texts)):
                raise BagError("damaged: its table of topics", str(self.path))
            text, language = definitions.get(topic["type"], ("", ""))
            channels[topic["id"]] = bag.Channel(
                topic=topic["name"],
                type=topic["type"],
                encoding=topic["serialization_format"],
                definition=text,
                type_hash=topic.get("type_description_hash") or "",
                qos=parse_profiles(topic.get("offered_qos_profiles") or ""),
                language="" if language in {"", "unknown", "ros2msg"} else language,
            )
        return channels

    def count(self, channel: bag.Channel | None = None) -> int:
        """Return the number of messages of a channel, or of all."""
        return sum(self._counts.values()) if channel is None else self._totals[channel]

    @cached_property
    def _totals(self) -> Counter[bag.Channel]:
        return bag.count_by_channel(self._counts, self._channels)

    def messages(
        self,
        topics: Collection[str] | None = None,
        start: int | None = None,
        end: int | None = None,
        *,
        reverse: bool = False,
        damaged: bag.DamageReport | None = None,
    ) -> Iterator[bag.Entry]:
        """Yield messages in the order of their stamps; see `rosz.bags.BagReader`."""
        keys = [
            key
            for key, channel in self._channels.items()
            if topics is None or channel.topic in topics
        ]
        limits = (start or 0, (1 << 63) - 1 if end is None else end)
        if self._damage is not None:
            rows = [row for row in self._damage if limits[0] <= row[0] <= limits[1]]
            chosen = [row for row in rows if row[1] in keys]
            yield from self._fetch(reversed(chosen) if reverse else chosen, damaged)
            return
        order = "DESC" if reverse else "ASC"
        query = (
            "SELECT topic_id, timestamp, data FROM messages"  # noqa: S608  # values are parameters
            f" WHERE topic_id IN ({','.join('?' * len(keys))}) AND timestamp BETWEEN ? AND ?"
            f" ORDER BY timestamp {order}, id {order}"
        )
        try:
            for key, stamp, data in self._database.execute(query, (*keys, *limits)):
                if isinstance(data, bytes) and _is_stamp(stamp):
                    yield bag.Entry(self._channels[key], stamp, data)
                else:
                    text = f"damaged: the message at {stamp} has no payload, or no time"
                    (damaged or bag.refuse_damage)(BagError(text, str(self.path)))
        except _DAMAGE as error:
            (damaged or bag.refuse_damage)(BagError(f"damaged: {error}", str(self.path)))

    def _fetch(
        self, rows: Iterable[tuple[int, int, int]], damaged: bag.DamageReport | None
    ) -> Iterator[bag.Entry]:
        """Yield messages one by one, of a file that is damaged."""
        for stamp, key, place in rows:
            try:
                query = "SELECT data FROM messages WHERE id = ?"
                ((data,),) = self._database.execute(query, (place,))
                data = memoryview(data).tobytes()
            except (*_DAMAGE, TypeError) as error:
                text = f"damaged: message {place}: {error}"
                (damaged or bag.refuse_damage)(BagError(text, str(self.path)))
            else:
                yield bag.Entry(self._channels[key], stamp, data)

    def attachments(self) -> Iterator[bag.Attachment]:
        """Yield nothing: the format has no files within."""
        return iter(())

    def close(self) -> None:
        """Close the file; a second call has no effect."""
        self._database.close()


def _is_stamp(value: object) -> bool:
    return isinstance(value, int) and value >= 0


class Rosbag2Reader(Closing):
    """A folder of rosbag2; see `rosz.bags.BagReader`."""

    format = "rosbag2"

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self._stack = ExitStack()
        self.problems: list[BagError] = []
        metadata = self._read_metadata()
        self.version = str(metadata.get("version", ""))
        self._custom = metadata.get("custom_data")
        compressed = str(metadata.get("compression_mode", "")).lower()
        self._compressed = compressed not in {"", "none"}
        self._by_message = compressed == "message" and metadata.get("compression_format") == "zstd"
        self._parts: list[bag.BagReader] = []
        try:
            for file in self._files(metadata):
                self._open(file)
        except BaseException:
            self.close()
            raise
        if not self._parts:
            text = f"the folder has no {METADATA}, and no .db3 or .mcap file"
            raise self.problems[-1] if self.problems else BagError(text, str(self.path))
        self.indexed = (self.path / METADATA).exists() and all(part.indexed for part in self._parts)
        counted = [part for part in self._parts if part.count()]
        self.start: int = min((part.start for part in counted), default=0)
        self.end: int = max((part.end for part in counted), default=0)

    def _read_metadata(self) -> dict[str, Any]:
        import yaml  # slow to import, and most bags do without

        file = self.path / METADATA
        try:
            tree = yaml.safe_load(file.read_text("utf-8", "replace"))
            information = tree["rosbag2_bagfile_information"]
            return dict(information)
        except FileNotFoundError:
            return {}
        except (OSError, yaml.YAMLError, LookupError, TypeError, ValueError) as error:
            self.problems.append(
                BagError(f"damaged, not used: {' '.join(str(error).split())}", str(file))
            )
            return {}

    def _files(self, metadata: Mapping[str, Any]) -> list[Path]:
        """Return the files of the bag: those that the metadata has, or else all that are there."""
        named = metadata.get("relative_file_paths")
        if isinstance(named, list) and named:
            # Older versions wrote the name of the folder too.
            paths = [self.path / str(name) for name in named]
            return [path if path.exists() else self.path / path.name for path in paths]
        with bag.FileErrors(self.path, "cannot open it"):
            there = sorted(self.path.iterdir())
        return [file for file in there if file.suffix in (*_SUFFIXES, ".zstd")]

    def _open(self, file: Path) -> None:
        try:
            plain = self._decompress(file) if file.suffix == ".zstd" else file
            part: bag.BagReader = (
                McapReader(plain) if plain.suffix == ".mcap" else SqliteReader(plain)
            )
        except BagError as error:
            self.problems.append(error)
            return
        self._stack.callback(part.close)
        self._parts.append(part)
        self.problems += part.problems

    def _decompress(self, file: Path) -> Path:
        """Return a temporary file with the contents of a compressed one."""
        import tempfile

        folder = self._stack.enter_context(tempfile.TemporaryDirectory(prefix="rosz-bag-"))
        plain = Path(folder, file.stem)
        try:
            with file.open("rb") as source, plain.open("wb") as target:
                unpack_file(source, file.stat().st_size, target)
        except (OSError, ChunkError) as error:
            self.problems.append(BagError(f"damaged: {error}", str(file)))
        return plain

    @property
    def storage(self) -> Storage:
        """The storage plugin that reads the files."""
        return "mcap" if self._parts[0].format == "mcap" else "sqlite3"

    @property
    def compression(self) -> bag.Compression:
        """The compression of the first chunk, or of the files or messages."""
        chunks = self._parts[0].chunks
        return "zstd" if self._compressed else chunks[0].compression if chunks else "none"

    @property
    def size(self) -> int:
        """Size of all files in bytes."""
        return sum(file.stat().st_size for file in self.path.iterdir() if file.is_file())

    @cached_property
    def metadata(self) -> Mapping[str, Mapping[str, str]]:
        """Named texts by name of the record; those of ``custom_data`` are named ``NAME/KEY``."""
        outer = {
            name: texts
            for part in self._parts
            for name, texts in part.metadata.items()
            if name != METADATA_RECORD
        }
        texts: dict[str, dict[str, str]] = {}
        for key, text in (self._custom if isinstance(self._custom, dict) else {}).items():
            name, _, rest = str(key).rpartition("/")
            texts.setdefault(name or "custom_data", {})[rest] = str(text)
        return {**outer, **texts}

    @cached_property
    def channels(self) -> Sequence[bag.Channel]:
        """All channels, in the order of the files."""
        return list(dict.fromkeys(channel for part in self._parts for channel in part.channels))

    @property
    def chunks(self) -> Sequence[bag.Chunk]:
        """None: offsets would be those of several files."""
        return ()

    def count(self, channel: bag.Channel | None = None) -> int:
        """Return the number of messages of a channel, or of all."""
        return sum(part.count(channel) for part in self._parts)

    def messages(
        self,
        topics: Collection[str] | None = None,
        start: int | None = None,
        end: int | None = None,
        *,
        reverse: bool = False,
        damaged: bag.DamageReport | None = None,
    ) -> Iterator[bag.Entry]:
        """Yield messages in the order of their stamps; see `rosz.bags.BagReader`."""
        parts = [
            part.messages(topics, start, end, reverse=reverse, damaged=damaged)
            for part in self._parts
        ]
        merged = heapq.merge(*parts, key=lambda entry: entry.stamp, reverse=reverse)
        if not self._by_message:
            return merged
        return self._unpacked(merged, damaged or bag.refuse_damage)

    def _unpacked(
        self, entries: Iterable[bag.Entry], damaged: bag.DamageReport
    ) -> Iterator[bag.Entry]:
        """Yield messages that were compressed one by one."""
        for entry in entries:
            data = bytes(entry.data)
            try:
                plain = unpack_message(data) if data.startswith(_ZSTD_FRAME) else data
            except ChunkError as error:
                place = f"message of '{entry.channel.topic}' at {entry.stamp}"
                damaged(BagError(f"damaged: {place}: {error}", str(self.path)))
            else:
                yield bag.Entry(entry.channel, entry.stamp, plain)

    def attachments(self) -> Iterator[bag.Attachment]:
        """Yield the files within the bag, which only those of MCAP have."""
        return chain.from_iterable(part.attachments() for part in self._parts)

    def close(self) -> None:
        """Close the files; a second call has no effect."""
        self._stack.close()
