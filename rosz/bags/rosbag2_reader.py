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
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Any, Literal, Protocol, Self, TypeAlias
from urllib.parse import quote

from rosz.bags.bag import (
    Attachment,
    Channel,
    Chunk,
    Compression,
    DamageReport,
    Entry,
    Payload,
)
from rosz.bags.mcap_reader import McapReader
from rosz.bags.qos_text import parse_profiles
from rosz.errors import BagError, UsageError

__all__ = (
    "METADATA",
    "METADATA_RECORD",
    "STORAGES",
    "Rosbag2Reader",
    "SqliteReader",
    "Storage",
    "zstandard_library",
)

Storage: TypeAlias = Literal["mcap", "sqlite3"]
STORAGES: tuple[Storage, ...] = ("mcap", "sqlite3")
METADATA = "metadata.yaml"
METADATA_RECORD = "rosbag2"
"""Name of the record in MCAP that has the metadata too."""
_SUFFIXES = (".db3", ".mcap")
_ZSTD_FRAME = b"\x28\xb5\x2f\xfd"


class _Part(Protocol):
    """A file of a bag."""

    format: str
    start: int
    end: int
    indexed: bool

    @property
    def chunks(self) -> Sequence[Chunk]: ...
    @property
    def channels(self) -> Sequence[Channel]: ...
    @property
    def metadata(self) -> Mapping[str, Mapping[str, str]]: ...
    @property
    def problems(self) -> Sequence[BagError]: ...
    def attachments(self) -> Iterator[Attachment]: ...
    def count(self, channel: Channel | None = None) -> int: ...
    def messages(
        self,
        topics: Collection[str] | None = None,
        start: int | None = None,
        end: int | None = None,
        *,
        reverse: bool = False,
        damaged: DamageReport | None = None,
    ) -> Iterator[Entry]: ...
    def close(self) -> None: ...


class SqliteReader:
    """A file that rosbag2's SQLite storage has written.

    Args:
        path: The file.

    Raises:
        BagError: The file cannot be read, or is none of rosbag2.
    """

    format = "rosbag2"
    metadata: Mapping[str, Mapping[str, str]] = {}
    chunks: Sequence[Chunk] = ()

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self.version = ""
        self.problems: Sequence[BagError] = ()
        if not self.path.is_file():
            raise BagError("there is no such file", str(path))
        self.size: int = self.path.stat().st_size
        address = f"file:{quote(str(self.path.absolute()))}?mode=ro"
        self._database = sqlite3.connect(address, uri=True, check_same_thread=False)
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
            ((first, last),) = self._rows("SELECT MIN(timestamp), MAX(timestamp) FROM messages")
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
        self._counts: dict[int, int] = dict(counts)
        self.start: int = first or 0
        self.end: int = last or 0
        self.indexed = bool(indexes)

    def _find_rows(self) -> list[tuple[int, int, int]]:
        """Return stamp, topic and place of the messages before and after what is damaged."""
        found: set[tuple[int, int, int]] = set()
        for order in ("ASC", "DESC"):
            query = (
                "SELECT timestamp, topic_id, id FROM messages NOT INDEXED"  # noqa: S608  # no values
                f" ORDER BY id {order}"
            )
            try:
                for row in self._database.execute(query):
                    if all(isinstance(one, int) for one in row) and row[1] in self._channels:
                        found.add(row)
            except sqlite3.Error:
                continue  # the problem has been noted
        return sorted(found)

    @property
    def channels(self) -> Sequence[Channel]:
        """All channels, in the order of the file."""
        return list(self._channels.values())

    def _rows(self, query: str) -> list[Any]:
        try:
            return self._database.execute(query).fetchall()
        except sqlite3.Error as error:
            raise BagError(f"not a bag of rosbag2, or damaged: {error}", str(self.path)) from error

    def _read_channels(self) -> dict[int, Channel]:
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
        found = {}
        for row in self._rows("SELECT * FROM topics"):
            topic = dict(zip(columns, row, strict=True))
            text, language = definitions.get(topic["type"], ("", ""))
            found[topic["id"]] = Channel(
                topic=topic["name"],
                type=topic["type"],
                encoding=topic["serialization_format"],
                definition=text,
                type_hash=topic.get("type_description_hash") or "",
                qos=parse_profiles(topic.get("offered_qos_profiles") or ""),
                language="" if language in {"", "unknown", "ros2msg"} else language,
            )
        return found

    def count(self, channel: Channel | None = None) -> int:
        """Return the number of messages of a channel, or of all."""
        return sum(
            number
            for key, number in self._counts.items()
            if channel is None or self._channels.get(key) == channel
        )

    def messages(
        self,
        topics: Collection[str] | None = None,
        start: int | None = None,
        end: int | None = None,
        *,
        reverse: bool = False,
        damaged: DamageReport | None = None,
    ) -> Iterator[Entry]:
        """Yield messages in the order of their stamps; see `rosz.bags.BagReader`.

        Raises:
            BagError: The file is damaged.
        """
        keys = [key for key, one in self._channels.items() if topics is None or one.topic in topics]
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
                yield Entry(self._channels[key], stamp, data)
        except sqlite3.Error as error:
            problem = BagError(f"damaged: {error}", str(self.path))
            if damaged is None:
                raise problem from error
            damaged(problem)

    def _fetch(
        self, rows: Iterable[tuple[int, int, int]], damaged: DamageReport | None
    ) -> Iterator[Entry]:
        """Yield messages one by one, of a file that is damaged."""
        for stamp, key, place in rows:
            try:
                query = "SELECT data FROM messages WHERE id = ?"
                ((data,),) = self._database.execute(query, (place,))
            except (sqlite3.Error, ValueError) as error:
                problem = BagError(f"damaged: message {place}: {error}", str(self.path))
                if damaged is None:
                    raise problem from error
                damaged(problem)
            else:
                yield Entry(self._channels[key], stamp, data)

    def attachments(self) -> Iterator[Attachment]:
        """Yield nothing: the format has no files within."""
        return iter(())

    def close(self) -> None:
        """Close the file; a second call has no effect."""
        self._database.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc_info: object) -> None:
        self.close()


class Rosbag2Reader:
    """A folder of rosbag2; see `rosz.bags.BagReader`.

    Args:
        path: The folder.

    Raises:
        BagError: The folder is not a bag, or a file in it cannot be read.
        UsageError: The bag is compressed, and the library for it is not installed.
    """

    format = "rosbag2"

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self._stack = ExitStack()
        self.problems: list[BagError] = []
        found = self._read_metadata()
        self.version = str(found.get("version", ""))
        self._custom = found.get("custom_data")
        compressed = str(found.get("compression_mode", "")).lower()
        self._compressed = compressed not in {"", "none"}
        self._by_message = compressed == "message" and found.get("compression_format") == "zstd"
        self._parts: list[_Part] = []
        try:
            for file in self._files(found):
                self._open(file)
        except BaseException:
            self.close()
            raise
        if not self._parts:
            raise self.problems[-1] if self.problems else self._no_bag()
        self.indexed = (self.path / METADATA).exists() and all(one.indexed for one in self._parts)
        counted = [one for one in self._parts if one.count()]
        self.start: int = min((one.start for one in counted), default=0)
        self.end: int = max((one.end for one in counted), default=0)

    def _read_metadata(self) -> dict[str, Any]:
        import yaml  # slow to import, and most bags do without

        file = self.path / METADATA
        try:
            found = yaml.safe_load(file.read_text("utf-8", "replace"))
            information = found["rosbag2_bagfile_information"]
            return dict(information)
        except FileNotFoundError:
            return {}
        except (OSError, yaml.YAMLError, LookupError, TypeError, ValueError) as error:
            self.problems.append(
                BagError(f"damaged, not used: {' '.join(str(error).split())}", str(file))
            )
            return {}

    def _files(self, found: Mapping[str, Any]) -> list[Path]:
        """Return the files of the bag: those that the metadata has, or else all that are there."""
        named = found.get("relative_file_paths")
        if isinstance(named, list) and named:
            # Older versions wrote the name of the folder too.
            paths = [self.path / str(one) for one in named]
            return [one if one.exists() else self.path / one.name for one in paths]
        try:
            there = sorted(self.path.iterdir())
        except OSError as error:
            raise BagError(f"cannot open it: {error.strerror}", str(self.path)) from error
        return [one for one in there if one.suffix in _SUFFIXES or one.suffixes[-1:] == [".zstd"]]

    def _no_bag(self) -> BagError:
        return BagError(f"the folder has no {METADATA}, and no .db3 or .mcap file", str(self.path))

    def _open(self, file: Path) -> None:
        try:
            plain = self._decompress(file) if file.suffix == ".zstd" else file
            part: _Part = McapReader(plain) if plain.suffix == ".mcap" else SqliteReader(plain)
        except BagError as error:
            self.problems.append(error)
            return
        self._stack.callback(part.close)
        self._parts.append(part)
        self.problems += part.problems

    def _decompress(self, file: Path) -> Path:
        """Return a temporary file with the contents of a compressed one."""
        import tempfile

        zstandard = zstandard_library()
        folder = self._stack.enter_context(tempfile.TemporaryDirectory(prefix="rosz-bag-"))
        plain = Path(folder, file.stem)
        try:
            with file.open("rb") as source, plain.open("wb") as target:
                zstandard.ZstdDecompressor().copy_stream(source, target)
        except (OSError, zstandard.ZstdError) as error:
            self.problems.append(BagError(f"damaged: {error}", str(file)))
        return plain

    @property
    def storage(self) -> Storage:
        """The storage plugin that reads the files."""
        return "mcap" if self._parts[0].format == "mcap" else "sqlite3"

    @property
    def compression(self) -> Compression:
        """The compression of the first chunk, or of the files or messages."""
        chunks = self._parts[0].chunks
        return "zstd" if self._compressed else chunks[0].compression if chunks else "none"

    @property
    def size(self) -> int:
        """Size of all files in bytes."""
        return sum(one.stat().st_size for one in self.path.iterdir() if one.is_file())

    @cached_property
    def metadata(self) -> Mapping[str, Mapping[str, str]]:
        """Named texts by name of the record; those of ``custom_data`` are named ``NAME/KEY``."""
        found = {
            name: texts
            for part in self._parts
            for name, texts in part.metadata.items()
            if name != METADATA_RECORD
        }
        texts: dict[str, dict[str, str]] = {}
        for key, text in (self._custom if isinstance(self._custom, dict) else {}).items():
            name, _, rest = str(key).rpartition("/")
            texts.setdefault(name or "custom_data", {})[rest] = str(text)
        return {**found, **texts}

    @cached_property
    def channels(self) -> Sequence[Channel]:
        """All channels, in the order of the files."""
        return list(dict.fromkeys(one for part in self._parts for one in part.channels))

    @property
    def chunks(self) -> Sequence[Chunk]:
        """None: offsets would be those of several files."""
        return ()

    def count(self, channel: Channel | None = None) -> int:
        """Return the number of messages of a channel, or of all."""
        return sum(part.count(channel) for part in self._parts)

    def messages(
        self,
        topics: Collection[str] | None = None,
        start: int | None = None,
        end: int | None = None,
        *,
        reverse: bool = False,
        damaged: DamageReport | None = None,
    ) -> Iterator[Entry]:
        """Yield messages in the order of their stamps; see `rosz.bags.BagReader`.

        Raises:
            BagError: A part of the bag is damaged.
        """
        parts = [
            part.messages(topics, start, end, reverse=reverse, damaged=damaged)
            for part in self._parts
        ]
        merged = heapq.merge(*parts, key=lambda one: one.stamp, reverse=reverse)
        if not self._by_message:
            return merged
        unpack = zstandard_library().ZstdDecompressor().decompress

        def plain(data: Payload) -> bytes:
            found: bytes = unpack(data) if bytes(data[:4]) == _ZSTD_FRAME else bytes(data)
            return found

        return (Entry(one.channel, one.stamp, plain(one.data)) for one in merged)

    def attachments(self) -> Iterator[Attachment]:
        """Yield the files within the bag, which only those of MCAP have."""
        return chain.from_iterable(part.attachments() for part in self._parts)

    def close(self) -> None:
        """Close the files; a second call has no effect."""
        self._stack.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc_info: object) -> None:
        self.close()


def zstandard_library() -> Any:
    """Return the module zstandard.

    Raises:
        UsageError: It is not installed.
    """
    try:
        import zstandard
    except ImportError as error:
        raise UsageError("bags compressed by zstd need: pip install 'rosz[bag]'") from error
    return zstandard
