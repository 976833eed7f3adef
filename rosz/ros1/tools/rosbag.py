"""rosbag: bags for ROS 1's scripts (ROS wiki, rosbag/Code API).

Bags of MCAP and rosbag2 are read as well; a name that ends in ``.mcap`` is written as MCAP. The
position in a raw message is None. Bags are neither encrypted nor decrypted.
"""

from __future__ import annotations

import io
import os
import shutil
import tempfile
import time
from collections import namedtuple
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from rosz import bags
from rosz.bags.edit import Transfer
from rosz.bags.formats import Ros1Reader, ros1_definition
from rosz.errors import BagError, BagUnindexed, UsageError
from rosz.lifecycle import Closing
from rosz.names import short_type
from rosz.qos import LATCHED
from rosz.ros1.client.rospy import Time
from rosz.ros1.importer import type_store
from rosz.ros1.tool import Tool
from rosz.ros1.tools.rosgraph.names import canonicalize_name


class ROSBagException(Exception):
    """A bag cannot be read or written.

    Attributes:
        value: The reason.
    """

    def __init__(self, value: str | None = None) -> None:
        super().__init__(value)
        self.value = value

    def __str__(self) -> str:
        return str(self.value)


class ROSBagFormatException(ROSBagException):
    """A bag is damaged."""


class ROSBagUnindexedException(ROSBagException):
    """A bag has no index."""

    def __init__(self, *_args: object) -> None:
        super().__init__("Unindexed bag")


class ROSBagEncryptNotSupportedException(ROSBagException):
    """A bag is encrypted, or should be; rosz has no encryption."""


class ROSBagEncryptException(ROSBagException):
    """A bag could not be encrypted or decrypted."""


class Compression:
    """Names of compressions."""

    NONE = "none"
    BZ2 = "bz2"
    LZ4 = "lz4"


_CHUNK = 768 * 1024
_COMPRESSIONS = (Compression.NONE, Compression.BZ2, Compression.LZ4)
_NO_ENCRYPTOR = "rosbag/NoEncryptor"

BagMessage = namedtuple("BagMessage", "topic message timestamp")  # noqa: PYI024  # as in ROS 1
BagMessageWithConnectionHeader = namedtuple(  # noqa: PYI024  # as in ROS 1
    "BagMessageWithConnectionHeader", "topic message timestamp connection_header"
)


class TopicTuple(NamedTuple):
    """The messages of a topic, and their rate in Hz."""

    msg_type: str
    message_count: int
    connections: int
    frequency: float | None


class TypesAndTopicsTuple(NamedTuple):
    """The MD5 sums of types, and the topics."""

    msg_types: dict[str, str]
    topics: dict[str, TopicTuple]


class CompressionTuple(NamedTuple):
    """A compression, and the sizes without and with it."""

    compression: str
    uncompressed: int
    compressed: int


@contextmanager
def _translated() -> Iterator[None]:
    """Raise errors of bags as those of ROS 1."""
    try:
        yield
    except BagUnindexed as error:
        raise ROSBagUnindexedException from error
    except BagError as error:
        if error.reason.startswith("encrypted"):
            raise ROSBagEncryptNotSupportedException(str(error)) from error
        kind = ROSBagFormatException if error.reason.startswith("damaged") else ROSBagException
        raise kind(str(error)) from error


class Bag(Closing):
    """A bag.

    Args:
        f: Path of the bag, or a file object to read from.
        mode: ``r`` to read, ``w`` to write, ``a`` to append.
        compression: Compression of written messages.
        chunk_threshold: Bytes of messages that are compressed together.
        allow_unindexed: Whether a bag without an index may be opened.
        options: ``compression`` and ``chunk_threshold`` as a dictionary.
        skip_index: Whether the information on topics has no frequencies.

    Attributes:
        filename: Path of the bag; None for a stream.
        version: Version of ROS 1's format.

    Raises:
        ValueError: An argument is not valid.
        ROSBagException: The bag cannot be read.
        OSError: The file does not exist, or it cannot be created.
    """

    version = 200

    def __init__(  # noqa: PLR0917  # as in ROS 1
        self,
        f: Any,
        mode: str = "r",
        compression: str = Compression.NONE,
        chunk_threshold: int = _CHUNK,
        allow_unindexed: bool = False,
        options: dict[str, Any] | None = None,
        skip_index: bool = False,
    ) -> None:
        if options is not None:
            if not isinstance(options, dict):
                raise ValueError("options must be of type dict")
            compression = options.get("compression", compression)
            chunk_threshold = options.get("chunk_threshold", chunk_threshold)
        if compression not in _COMPRESSIONS:
            raise ValueError(f"compression must be one of: {', '.join(_COMPRESSIONS)}")
        if chunk_threshold < 0:
            raise ValueError("chunk_threshold must be greater than or equal to zero")
        if not f:
            raise ValueError("filename (or stream) is invalid")
        if mode not in {"r", "w", "a"}:
            raise ValueError(f'mode "{mode}" is invalid')
        self.compression = compression
        self.chunk_threshold = chunk_threshold
        self.mode = mode
        self._skip_index = skip_index
        self._types = type_store()
        self._reader: bags.BagReader | None = None
        self._writer: bags.BagWriter | None = None
        self._handles: dict[str, tuple[int, bool]] = {}
        self._temporary: Path | None = None
        self._stream: Any = None
        self._closed = False
        self.filename: str | None = os.fspath(f) if isinstance(f, str | os.PathLike) else None
        self._path = Path(self.filename) if self.filename is not None else self._spool(f)
        with _translated():
            if mode == "r":
                self._open_reader(allow_unindexed)
            else:
                self._open_writer(allow_unindexed)

    def _spool(self, stream: Any) -> Path:
        """Return a file with the contents of a stream, or for data that go to one."""
        if self.mode == "a" or isinstance(stream, io.TextIOBase):
            raise ROSBagException("In Python 3 the bag file must be opened in binary mode")
        name = getattr(stream, "name", None)
        if self.mode == "r" and isinstance(name, str) and Path(name).is_file():
            self.filename = name
            return Path(name)
        with tempfile.NamedTemporaryFile(prefix="rosz-bag-", suffix=".bag", delete=False) as file:
            if self.mode == "r":
                shutil.copyfileobj(stream, file)
            else:
                self._stream = stream
        self._temporary = Path(file.name)
        return self._temporary

    def _open_reader(self, allow_unindexed: bool) -> None:
        if self._path.is_file():
            self._path.open("rb").close()  # the error of a script is OSError
        elif not self._path.exists():
            raise FileNotFoundError(2, "No such file or directory", str(self._path))
        self._reader = self._open_indexed(allow_unindexed)

    def _open_indexed(self, allow_unindexed: bool) -> bags.BagReader:
        reader = bags.open_reader(self._path)
        if not reader.indexed and not allow_unindexed:
            reader.close()
            raise ROSBagUnindexedException
        return reader

    def _open_writer(self, allow_unindexed: bool) -> None:
        old = None
        if self.mode == "a" and self._path.exists() and self._path.stat().st_size:
            old = self._open_indexed(allow_unindexed)
            self._temporary = self._path.with_name(f"{self._path.name}.tmp{self._path.suffix}")
            if self.compression == Compression.NONE and old.chunks:
                self.compression = old.chunks[0].compression
        target = self._temporary or self._path
        suffix = target.suffix in {".bag", ".mcap"}
        try:
            self._writer = bags.create_file(
                target if suffix else target.with_name(f"{target.name}.bag"),
                compression=self.compression,  # type: ignore[arg-type]
                replace=True,
                chunk_size=max(self.chunk_threshold, 1),
            )
        except UsageError as error:
            raise ValueError(str(error)) from error
        except BagError as error:
            if isinstance(error.__cause__, OSError):
                raise error.__cause__ from error
            raise
        if not suffix:
            self._temporary = Path(self._writer.path)
        if old is not None:
            with old:
                transfer = Transfer(self._writer, self._types, _refuse)
                for entry in old.messages():
                    transfer.write(entry)

    def _check_open(self) -> None:
        if self._closed:
            raise ValueError("I/O operation on closed bag")

    @property
    def options(self) -> dict[str, Any]:
        """Compression and chunk threshold."""
        return {"compression": self.compression, "chunk_threshold": self.chunk_threshold}

    @property
    def size(self) -> int:
        """Size in bytes."""
        with self._view() as reader:
            return reader.size

    @contextmanager
    def _view(self) -> Iterator[bags.BagReader]:
        """Open the bag as it is so far."""
        self._check_open()
        with _translated():
            if self._reader is not None:
                yield self._reader
                return
            self.flush()
            written = self._temporary or self._path
            if written.stat().st_size:
                with bags.open_reader(written) as reader:
                    yield reader
                return
            # Nothing has been written, so there is no file header either.
            with tempfile.TemporaryDirectory(prefix="rosz-bag-") as folder:
                bags.create_file(Path(folder, "empty.bag")).close()
                with bags.open_reader(Path(folder, "empty.bag")) as reader:
                    yield reader

    def read_messages(
        self,
        topics: Any = None,
        start_time: Any = None,
        end_time: Any = None,
        connection_filter: Callable[..., Any] | None = None,
        raw: bool = False,
        return_connection_header: bool = False,
    ) -> Iterator[Any]:
        """Return messages, in the order of their times, as (topic, message, time).

        Args:
            topics: Name of a topic, or several; all when not given.
            start_time: Earliest time.
            end_time: Latest time.
            connection_filter: Function of topic, type, MD5 sum, definition and header that returns
                whether the messages of a connection are read.
            raw: Whether a message is (type, bytes in ROS 1's layout, MD5 sum, None, class).
            return_connection_header: Whether the header of the connection is the fourth value.

        Raises:
            ValueError: The bag is closed.
            ROSBagException: The bag is damaged.
        """
        self._check_open()
        wanted = None
        if topics:
            names = [topics] if isinstance(topics, str) else topics
            wanted = {canonicalize_name(name) for name in names}
        limits = [None if not time_ else time_.to_nsec() for time_ in (start_time, end_time)]
        return self._read(
            wanted, limits, connection_filter, raw=raw, with_header=return_connection_header
        )

    def _read(
        self,
        wanted: set[str] | None,
        limits: list[int | None],
        accept: Callable[..., Any] | None,
        *,
        raw: bool,
        with_header: bool,
    ) -> Iterator[Any]:
        with self._view() as reader:
            chosen: dict[int, tuple[bags.Channel, Callable[[Any], Any] | None, dict[str, Any]]] = {}
            for entry in reader.messages(wanted, *limits):
                channel = entry.channel
                if id(channel) not in chosen:
                    header = _header(reader, channel)
                    kind = short_type(channel.type)
                    taken = accept is None or accept(
                        channel.topic, kind, channel.md5, channel.definition, header
                    )
                    decode = bags.decoder_of(channel, self._types) if taken else None
                    chosen[id(channel)] = channel, decode, header
                _, decode, header = chosen[id(channel)]
                if decode is None:
                    continue
                message = _raw(entry, decode) if raw else decode(entry.data)
                stamp = Time(*divmod(entry.stamp, 1_000_000_000))
                if with_header:
                    yield BagMessageWithConnectionHeader(channel.topic, message, stamp, header)
                else:
                    yield BagMessage(channel.topic, message, stamp)

    def __iter__(self) -> Iterator[Any]:
        return self.read_messages()

    def get_message_count(self, topic_filters: Any = None) -> int:
        """Return the number of messages, of all topics or some.

        Raises:
            ROSBagException: The bag is damaged.
        """
        if topic_filters is not None:
            topics = self.get_type_and_topic_info(topic_filters).topics
            return sum(topic.message_count for topic in topics.values())
        with self._view() as reader:
            return reader.count()

    def get_start_time(self) -> float:
        """Return the time of the first message in seconds.

        Raises:
            ROSBagException: The bag has no message.
        """
        return self._time("start")

    def get_end_time(self) -> float:
        """Return the time of the last message in seconds; see `get_start_time`."""
        return self._time("end")

    def _time(self, name: str) -> float:
        with self._view() as reader:
            if not reader.count():
                raise ROSBagException("Bag contains no message")
            return Time(*divmod(getattr(reader, name), 1_000_000_000)).to_sec()

    def get_type_and_topic_info(self, topic_filters: Any = None) -> TypesAndTopicsTuple:
        """Return the types with their MD5 sums, and counts and rates of the topics.

        Args:
            topic_filters: Name of a topic, or a list of some; all when not given.
        """
        summary = self._summary()
        names = [topic_filters] if isinstance(topic_filters, str) else topic_filters
        topics = {
            topic.topic: TopicTuple(topic.type, topic.messages, topic.connections, topic.frequency)
            for topic in summary.topics
            if names is None or topic.topic in names
        }
        return TypesAndTopicsTuple(summary.types, topics)

    def get_compression_info(self) -> CompressionTuple:
        """Return the most frequent compression, and the sizes without and with it."""
        with self._view() as reader:
            compressions = bags.summarize("", reader).compressions
        if not compressions:
            return CompressionTuple(self.compression, 0, 0)
        whole = sum(each.uncompressed for each in compressions)
        return CompressionTuple(
            compressions[0].name, whole, sum(each.size for each in compressions)
        )

    def __str__(self) -> str:
        return bags.format_summary(self._summary())

    def _summary(self) -> bags.Summary:
        with self._view() as reader:
            return bags.summarize(self.filename or "", reader, frequencies=not self._skip_index)

    def _get_yaml_info(self, key: str | None = None) -> str:
        """Return what ``rosbag info --yaml`` prints; with a key, one value of it."""
        text = bags.format_yaml(self._summary())
        if key is None:
            return text
        import yaml

        return str(yaml.safe_load(text)[key])

    def write(
        self,
        topic: str,
        msg: Any,
        t: Any = None,
        raw: bool = False,
        connection_header: Mapping[str, Any] | None = None,
    ) -> None:
        """Write a message.

        Args:
            topic: Name of the topic.
            msg: The message; if raw, (type, bytes, MD5 sum, class), maybe with a position.
            t: Time of the message; now when not given.
            raw: Whether the message is encoded, in ROS 1's layout.
            connection_header: Fields of the publisher's connection.

        Raises:
            ValueError: An argument is not valid, or the bag is closed or only read.
            EncodeError: A value of the message does not fit its field.
            ROSBagException: The file cannot be written.
        """
        self._check_open()
        if not topic:
            raise ValueError("topic is invalid")
        if not msg:
            raise ValueError("msg is invalid")
        writer = self._writer
        if writer is None:
            raise ValueError("the bag was opened to be read: open it with mode 'w' or 'a'")
        with _translated():
            if topic not in self._handles:
                self._handles[topic] = self._add(writer, topic, msg, raw, connection_header)
            handle, cdr = self._handles[topic]
            stamp = time.time_ns() if t is None else t.to_nsec()
            if raw:
                data = msg[-1].from_ros1(msg[1]).to_cdr() if cdr else msg[1]
            else:
                data = msg.to_cdr() if cdr else msg.to_ros1()
            writer.write(handle, stamp, data)

    def _add(
        self,
        writer: bags.BagWriter,
        topic: str,
        msg: Any,
        raw: bool,
        header: Mapping[str, Any] | None,
    ) -> tuple[int, bool]:
        """Add the connection of a topic; return its handle, and whether it has CDR."""
        if raw and len(msg) not in (4, 5):
            raise ValueError("msg must be of length 4 or 5")
        cls = (msg[-1] or self._types.message(msg[0])) if raw else type(msg)
        cdr = writer.format != "rosbag"
        given = {name: _text(value) for name, value in (header or {}).items()}
        channel = bags.Channel(
            topic=topic,
            type=cls._type_name,
            encoding="cdr" if cdr else "ros1",
            definition=cls._full_text if cdr else ros1_definition(cls),
            md5=msg[2] if raw else cls._md5sum,
            type_hash=cls._type_hash if cdr else "",
            qos=(LATCHED,) if given.get("latching") == "1" else (),
            node=given.get("callerid", ""),
        )
        return writer.add(channel), cdr

    def set_encryptor(self, encryptor: str | None = None, param: str | None = None) -> None:
        """Choose no encryption; there is no other choice.

        Args:
            encryptor: ``rosbag/NoEncryptor``, or None.
            param: Ignored.

        Raises:
            ROSBagEncryptNotSupportedException: Another encryption is chosen.
        """
        del param
        if encryptor not in {None, _NO_ENCRYPTOR}:
            raise ROSBagEncryptNotSupportedException(
                f"rosz does not encrypt bags, got '{encryptor}'; 'rosbag encrypt' of ROS 1 does"
            )

    def flush(self) -> None:
        """Write everything so far to the file.

        Raises:
            ValueError: The bag is closed.
        """
        self._check_open()
        if self._writer is not None:
            with _translated():
                self._writer.flush()

    def reindex(self) -> Iterator[int]:
        """Yield the places of the chunks; the index of a bag to write is made when it is closed."""
        with self._view() as reader:
            yield from [chunk.offset for chunk in reader.chunks]

    def close(self) -> None:
        """Close the file; a second call has no effect."""
        if self._closed:
            return
        self._closed = True
        if self._reader is not None:
            self._reader.close()
        if self._writer is not None:
            with _translated():
                self._writer.close()
            if self._stream is not None:
                with self._path.open("rb") as file, self._stream:
                    shutil.copyfileobj(file, self._stream)
                self._path.unlink()
            elif self._temporary is not None:
                self._temporary.replace(self._path)
        elif self._temporary is not None:
            self._temporary.unlink()


def _refuse(reason: str) -> NoReturn:
    raise ROSBagException(reason)


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _header(reader: bags.BagReader, channel: bags.Channel) -> dict[str, Any]:
    if isinstance(reader, Ros1Reader):
        return {"topic": channel.topic.encode(), **reader.connection(channel).header}
    return {
        "topic": channel.topic.encode(),
        "type": short_type(channel.type).encode(),
        "md5sum": channel.md5.encode(),
        "message_definition": channel.definition.encode(),
        "callerid": channel.node.encode(),
    }


def _raw(entry: bags.Entry, decode: Callable[[Any], Any]) -> tuple[Any, ...]:
    channel = entry.channel
    message_type: Any = getattr(decode, "__self__", None)
    data = bytes(entry.data) if channel.encoding == "ros1" else decode(entry.data).to_ros1()
    return short_type(channel.type), data, channel.md5, None, message_type


rosbagmain = Tool("rosbag").main
