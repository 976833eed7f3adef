"""Keys and messages of the parameter store on the network.

The protocol between replicas, and between a replica and its clients:

- **Write.** The writer applies a batch itself, then publishes it on ``change``, behind a header
  with its session and a number. Every replica that has applied it (and stored it, if it has
  storage) publishes an **acknowledgement**, that number and its own session, on ``ack`` of the
  writer. While a replica is at work on a large batch, it publishes the same with ``+`` before the
  session, which replicas that do not know of it ignore. A replica that does not acknowledge in time
  is sent the batch once more as a query on its ``write`` key (the barrier query), whose reply is
  the acknowledgement. A replica that refuses the batch, or cannot store it, adds the reason, which
  the writer raises.
  A replica that leaves publishes a batch with number 0 (`Departure`).
- **Exchange of differences.** A replica sends another its **digest** on the ``sync`` key of the
  other. If the digests differ, it sends the index (path and stamp) of its writes in the buckets
  that differ. The reply holds the writes that it lacks, and the paths of the writes that the other
  lacks, which it then sends on the ``tell`` key. A replica that joins has the empty digest, and
  gets all writes in the first reply. Deletions are writes as well (**tombstones**). A replica that
  has forgotten deletions which the other may not know replies with all its writes, for the other
  to merge (`rosz.params.history`).
  A replica that is a seed appoints another one with the digest that it sends.
- **Clients.** A process that has no replica reads on the ``ask`` key of a replica, and writes on
  its ``set`` key, with a stamp of its own.

Under ``@rosz/<domain>/``::

    param/<path>                 one key for each parameter: msgpack of the value, or deleted
    change                       batches that replicas publish to each other
    change/*[/<path>]            the same, where links need keys; each subscribes to change/<zid>/**
    ack/<zid>                    acknowledgements to the writer of that session
    store/<zid>/write[/<path>]   query to one replica: a batch that it has not acknowledged
    store/<zid>/sync             query to one replica: a digest, or the index of some buckets
    store/<zid>/tell[/<path>]    query to one replica: writes that it lacks
    store/<zid>/ask              query to one replica: read for a client
    store/<zid>/set[/<path>]     query to one replica: write for a client
    replica/<zid>/<start>/<who>  liveliness token of a replica
    elder/<zid>/<start>/<who>    a second one of a few replicas, which all others follow

Where links need keys, the key of a write names a path that all of the write lies at or below, so
that rules can tell who may write what. A replica accepts no write that reaches further than its
key.

The keys under ``param`` are for other Zenoh programs, such as storages. Replicas write them only
while somebody subscribes to them.

Messages are msgpack. Bytes that arrive become a message or a `DecodeError`, and values in a message
have passed the same checks as values that a program sets.
"""

from __future__ import annotations

import datetime as dt
import struct
from collections.abc import Iterable, Sequence
from typing import Any, ClassVar, Final, Literal, TypeVar

import msgspec

from rosz.errors import DecodeError, ParamError
from rosz.names import LONGEST_PATH
from rosz.params.paths import Path, common_path, from_key, joined, to_key
from rosz.params.values import Value, normalise
from rosz.params.writes import DELETED, Change, Write, put
from rosz.wire import own_key

BUCKETS: Final = 64
"""Buckets of a digest."""

_BUCKET: Final = struct.Struct("<BQ")
_REPLICA: Final = "replica"
_SEED: Final = "elder"  # the word on the network, which replicas of other versions know
_MOMENT: Final = 1
_DATE: Final = 2
_PLAIN: Final = frozenset({bool, int, float, str, bytes})
_HEADER: Final = struct.Struct("<QB")

_Message = TypeVar("_Message", bound=msgspec.Struct)


Purpose = Literal["write", "sync", "tell", "ask", "set"]
"""The purpose of a query to one replica, as in its key; see the list of keys above."""


class ReplicaMember(msgspec.Struct, frozen=True, order=True):
    """A replica, as described by its liveliness token; a younger replica is greater.

    Attributes:
        start: Time when it started, by its own clock, in nanoseconds.
        zid: Zenoh id of its session.
        label: Process, as shown to users.
    """

    start: int
    zid: str
    label: str


class Keys:
    """The keys of one domain.

    Args:
        domain: ROS domain.
        scoped: Whether the key of a write names the path that the write lies at or below.

    Attributes:
        scoped: The argument.
        params: Key of the root parameter.
        all_params: Key expression of all parameters, including the root.
        change: Key of batches, without a path.
        tokens: Key expression of the liveliness tokens of all replicas.
        seeds: Key expression of the second tokens of seeds.
    """

    def __init__(self, domain: int, *, scoped: bool = False) -> None:
        self.scoped = scoped
        self.params: str = own_key(domain, "param")
        self.all_params: str = f"{self.params}/**"
        self.change: str = own_key(domain, "change")
        self.tokens: str = own_key(domain, _REPLICA, "**")
        self.seeds: str = own_key(domain, _SEED, "**")
        self._domain = domain

    def param(self, path: Path) -> str:
        """Return the key of a parameter."""
        return f"{self.params}/{to_key(path)}" if path else self.params

    def path(self, key: str) -> Path:
        """Return the path of the parameter with a key.

        Raises:
            DecodeError: The key is not the key of a parameter.
        """
        return self.reach(key, self.params)

    def ack(self, zid: str) -> str:
        """Return the key of the acknowledgements to one writer."""
        return own_key(self._domain, "ack", zid)

    def of(self, zid: str, purpose: Purpose) -> str:
        """Return the key of queries to one replica."""
        return own_key(self._domain, "store", zid, purpose)

    def scoped_change(self, zid: str = "*") -> str:
        """Return the key of batches without a path, where the key of a write names its path.

        A writer uses the one for all replicas. A replica subscribes below one of its own, since
        Zenoh keeps memory for each session that declared a key expression with wildcards which
        others keep (`tests/upstream/memory.py`).
        """
        return f"{self.change}/{zid}"

    def change_reach(self, key: str) -> Path:
        """Return the path that the key of a batch names; the error is that of `reach`."""
        return () if key == self.change else self.reach(key, self.scoped_change())

    def scope(self, key: str, paths: Iterable[Path]) -> str:
        """Return the key for a write of some paths: with their common path if keys are scoped."""
        if not self.scoped:
            return key
        reach = to_key(common_path(paths))
        return f"{key}/{reach}" if reach else key

    def reach(self, key: str, base: str) -> Path:
        """Return the path that the key of a write names.

        Args:
            key: Key that the write arrived on.
            base: Start of the key.

        Raises:
            DecodeError: The key does not start with ``base``, or names no path.
        """
        if key != base and not key.startswith(f"{base}/"):
            raise DecodeError("parameter key", 0, f"'{key}', expected '{base}/**'")
        return from_key(key[len(base) + 1 :])

    def token(self, member: ReplicaMember, *, seed: bool = False) -> str:
        """Return the liveliness token of a replica, or the second one of a seed."""
        label = to_key((member.label or "-",))
        kind = _SEED if seed else _REPLICA
        return own_key(self._domain, kind, member.zid, str(member.start), label)

    def member(self, token: str) -> ReplicaMember:
        """Return the replica that one of its liveliness tokens describes.

        Raises:
            DecodeError: The text is not the token of a replica.
        """
        heads = [own_key(self._domain, kind) for kind in (_REPLICA, _SEED)]
        head, *chunks = token.rsplit("/", 3)
        if head not in heads or not chunks[1].isdecimal():
            raise DecodeError(
                "replica token", 0, f"'{token}', expected '{heads[0]}/<zid>/<start>/<who>'"
            )
        zid, start, label = chunks
        return ReplicaMember(int(start), zid, joined(from_key(label))[1:])


def check_reach(paths: Iterable[Path], reach: Path) -> None:
    """Refuse a write that reaches further than its key.

    Args:
        paths: Paths that are written.
        reach: Path that the key names.

    Raises:
        DecodeError: A path does not lie at or below ``reach``.
    """
    if not reach:
        return
    for path in paths:
        if path[: len(reach)] != reach:
            raise DecodeError(
                "parameter batch", -1, f"'{joined(path)}' on the key for '{joined(reach)}'"
            )


class Batch(msgspec.Struct, array_like=True):
    """Writes under one stamp.

    Attributes:
        time: Time of the stamp in nanoseconds.
        clock: Clock that gave the time.
        origin: Writer, as shown to users.
        puts: Path and value of each put.
        deletions: Path of each deletion.
    """

    time: int
    clock: str
    origin: str
    puts: list[tuple[str, Any]] = []
    deletions: list[str] = []

    @classmethod
    def of(cls, stamp: tuple[int, str], origin: str, changes: Iterable[Change]) -> Batch:
        """Return the message for changes under one stamp."""
        batch = cls(*stamp, origin)
        for path, value in changes:
            if value is DELETED:
                batch.deletions.append(join_path(path))
            else:
                batch.puts.append((join_path(path), pack_value(value)))
        return batch

    def writes(self) -> list[Write]:
        """Return the writes.

        Raises:
            DecodeError: The store cannot hold a value or path in the message.
        """
        stamp, origin = (self.time, self.clock), self.origin
        puts = [_read_write(path, stamp, value, origin) for path, value in self.puts]
        return puts + [_read_write(path, stamp, DELETED, origin) for path in self.deletions]


class Departure(Batch, array_like=True):
    """A batch without writes, by which a replica says that it leaves; its number is 0.

    Replicas that do not know of departures see a batch that changes nothing. Any `Batch` can be
    decoded as one, of kind 0.

    Attributes:
        kind: `LEAVES` or `RESTARTS`.
    """

    LEAVES: ClassVar[int] = 1
    RESTARTS: ClassVar[int] = 2
    kind: int = 0


class _BatchStart(msgspec.Struct, array_like=True):
    """The first field of a `Batch`."""

    time: int


class Record(msgspec.Struct, array_like=True):
    """One write.

    Attributes:
        path: Path that is written.
        time: Time of the stamp in nanoseconds.
        clock: Clock that gave the time.
        origin: Writer, as shown to users.
        value: One value, or nothing for a deletion.
    """

    path: str
    time: int
    clock: str
    origin: str
    value: list[Any]

    @classmethod
    def of(cls, write: Write) -> Record:
        """Return the record of a write."""
        value = [] if write.value is DELETED else [pack_value(write.value)]
        return cls(join_path(write.path), write.time, write.clock, write.origin, value)

    def write(self) -> Write:
        """Return the write.

        Raises:
            DecodeError: The store cannot hold the value or path.
        """
        value = self.value[0] if self.value else DELETED
        return _read_write(self.path, (self.time, self.clock), value, self.origin)


class Index(msgspec.Struct, array_like=True):
    """Path, time and clock of the writes in some buckets of a digest."""

    buckets: list[int]
    entries: list[tuple[str, int, str]]

    @classmethod
    def of(cls, buckets: list[int], writes: Iterable[Write]) -> Index:
        """Return the index of the writes in some buckets."""
        return cls(buckets, [(join_path(write.path), write.time, write.clock) for write in writes])

    def content(self) -> tuple[list[int], dict[Path, tuple[int, str]]]:
        """Return the buckets, and time and clock of each path.

        Raises:
            DecodeError: A path has an empty part.
        """
        return self.buckets, {split_path(path): (time, clock) for path, time, clock in self.entries}


def pack_digest(numbers: Sequence[int]) -> bytes:
    """Return a digest: the index and the number of each bucket whose number is not 0."""
    return b"".join(_BUCKET.pack(index, number) for index, number in enumerate(numbers) if number)


def read_digest(digest: bytes) -> list[int]:
    """Return the number of each bucket of a digest.

    Raises:
        DecodeError: The bytes are not a digest.
    """
    if len(digest) % _BUCKET.size:
        raise DecodeError("digest", 0, f"{len(digest)} bytes, expected {_BUCKET.size} each bucket")
    numbers = [0] * BUCKETS
    for at, (index, number) in enumerate(_BUCKET.iter_unpack(digest)):
        if index >= BUCKETS:
            raise DecodeError("digest", at * _BUCKET.size, f"bucket {index} of {BUCKETS}")
        numbers[index] = number
    return numbers


class SyncRequest(msgspec.Struct, omit_defaults=True):
    """A request of one replica to another, to find their differences or to remove them.

    Attributes:
        digest: Digest of the sender's writes.
        index: Index of the sender's writes in the buckets that differ.
        records: Writes that the receiver lacks.
        horizon: Time up to which the sender may have forgotten deletions.
        sender: Zenoh id of the sender's session.
        appoints: Whether the receiver has to become a seed.
    """

    digest: bytes | None = None
    index: Index | None = None
    records: list[Record] = []
    horizon: int = 0
    sender: str = ""
    appoints: bool = False


class SyncReply(msgspec.Struct, omit_defaults=True):
    """The reply to a `SyncRequest`.

    Attributes:
        digest: Digest of the responder's writes.
        ready: Whether the responder has joined; if not, it is still asking others itself.
        records: Writes that the sender of the request lacks.
        wanted: Paths of writes that the responder lacks.
        whole: Whether the records are all writes of the responder, which the sender has to merge
            because the responder may have forgotten deletions that the sender does not know.
        horizon: Time up to which the responder may have forgotten deletions.
    """

    digest: bytes = b""
    ready: bool = True
    records: list[Record] = []
    wanted: list[str] = []
    whole: bool = False
    horizon: int = 0


class ClientRequest(msgspec.Struct, omit_defaults=True):
    """A request of a process without a replica to a replica.

    Attributes:
        verb: ``get``, ``names``, ``search``, ``stamp`` or ``write``.
        name: Global name, or the name to search for.
        node: Name where a search starts.
        batch: Batch to write. Its stamp is the client's own, so that it does no harm if two
            replicas make the write, or one of them makes it much later.
        timeout: Time in seconds that a write waits for the other replicas.
        beats: Whether the time limit of a write counts from the last progress, and the replica
            replies ``working`` ten times a second until the end.
    """

    verb: str
    name: str = "/"
    node: str = "/"
    batch: Batch | None = None
    timeout: float = 0.0
    beats: bool = False


class ClientReply(msgspec.Struct, omit_defaults=True):
    """The reply to a `ClientRequest`.

    Attributes:
        status: ``ok``, ``missing`` (no such parameter), ``joining`` (ask another replica),
            ``refused``, or ``working`` if another reply follows.
        value: Result; if the parameter is missing, the names in its namespace.
        text: Reason if it is refused.
        origin: Writer of the value, as shown to users.
        slow: Replicas that did not acknowledge a write in time, or have not done so yet.
        holders: Number of replicas, beside the one that replies, that acknowledged a write.
        reasons: If a write stands, but not everywhere: the replicas that do not keep it, and why.
        what: The parameters of such a write, as shown to users.
    """

    status: str = "ok"
    value: Any = None
    text: str = ""
    origin: str = ""
    slow: list[str] = []
    holders: int = 0
    reasons: dict[str, str] = {}
    what: str = ""


def encode(message: msgspec.Struct) -> bytes:
    """Return a message as bytes."""
    return _ENCODER.encode(message)


def decode(data: bytes | memoryview, kind: type[_Message]) -> _Message:
    """Return the message that bytes hold.

    Raises:
        DecodeError: The bytes hold no message of this kind.
    """
    try:
        message: _Message = _DECODERS[kind].decode(data)
    except (msgspec.MsgspecError, RecursionError, ValueError) as error:
        raise DecodeError(f"{kind.__name__} of parameters", -1, str(error)) from error
    return message


def add_header(sender: str, number: int, message: bytes) -> bytes:
    """Return a message behind the header that tells where to acknowledge it.

    Args:
        sender: Zenoh id of the session that sends it.
        number: Number of the message.
        message: Encoded message.
    """
    return _HEADER.pack(number, len(sender)) + sender.encode() + message


def read_header(data: bytes) -> tuple[str, int, int]:
    """Return the sender and the number of a message, and the offset where it begins.

    Raises:
        DecodeError: The bytes do not start with a header.
    """
    if len(data) < _HEADER.size or len(data) < _HEADER.size + data[_HEADER.size - 1]:
        raise DecodeError("message about parameters", 0, f"{len(data)} bytes, expected more")
    number, length = _HEADER.unpack_from(data)
    start = _HEADER.size + length
    sender = data[_HEADER.size : start]
    if not sender.isalnum():
        raise DecodeError(
            "message about parameters", _HEADER.size, f"{sender!r}, expected a session"
        )
    return sender.decode(), number, start


def read_time(message: memoryview) -> int:
    """Return the time of an encoded `Batch`, without reading all of it.

    Raises:
        DecodeError: The bytes are not a batch.
    """
    return decode(message, _BatchStart).time


def encode_value(value: Value) -> bytes:
    """Return the payload of a parameter's own key."""
    return _ENCODER.encode(pack_value(value))


def decode_value(data: bytes) -> Value:
    """Return the value that the payload of a parameter's own key holds.

    Raises:
        DecodeError: The bytes hold no value.
    """
    try:
        return normalise(_ANY.decode(data))
    except (msgspec.MsgspecError, ParamError, RecursionError, ValueError) as error:
        raise DecodeError("parameter value", -1, str(error)) from error


def join_path(path: Path) -> str:
    """Return a path as it is sent and stored."""
    return "/".join(path)


def split_path(text: str) -> Path:
    """Return the path that `join_path` wrote.

    Raises:
        DecodeError: The path has an empty part, or is too long.
    """
    if len(text.encode()) >= LONGEST_PATH:
        raise DecodeError(
            "parameter path", -1, f"'{text[:60]}…' has more than {LONGEST_PATH} bytes"
        )
    path = tuple(text.split("/")) if text else ()
    if "" in path:
        raise DecodeError("parameter path", -1, f"'{text}', expected '{joined(path)[1:]}'")
    return path


def pack_value(value: Value) -> Any:
    """Return a value in msgpack's types, which have no timestamps with a time zone."""
    kind = type(value)
    if kind in _PLAIN:
        return value
    if kind is dict:
        return {key: pack_value(item) for key, item in value.items()}
    if kind is list:
        return [pack_value(item) for item in value]
    return msgspec.msgpack.Ext(
        _MOMENT if kind is dt.datetime else _DATE, value.isoformat().encode()
    )


def _read_write(path: str, stamp: tuple[int, str], value: Any, origin: str) -> Write:
    if stamp[0] <= 0:
        raise DecodeError(
            "parameter stamp", -1, f"the time {stamp[0]}, expected one after the epoch"
        )
    try:
        place = split_path(path)
        checked = value if value is DELETED else normalise(value, joined(place))
        return put(place, stamp, checked, origin)
    except ParamError as error:
        raise DecodeError("parameter write", -1, str(error)) from error


def _read_extension(code: int, data: memoryview) -> Any:
    text = bytes(data).decode()
    if code == _MOMENT:
        return dt.datetime.fromisoformat(text)
    if code == _DATE:
        return dt.date.fromisoformat(text)
    raise ValueError(f"extension {code} is unknown; expected {_MOMENT} or {_DATE}")


_ENCODER: Final = msgspec.msgpack.Encoder()
_ANY: Final = msgspec.msgpack.Decoder(ext_hook=_read_extension)
_DECODERS: Final[dict[type, Any]] = {
    kind: msgspec.msgpack.Decoder(kind, ext_hook=_read_extension)
    for kind in (Batch, Departure, _BatchStart, SyncRequest, SyncReply, ClientRequest, ClientReply)
}
