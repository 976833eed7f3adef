"""What replicas say to each other, in msgpack.

Whatever bytes arrive become a message or a `DecodeError`; values in them have been through the same
rules as values that a program sets.
"""

from __future__ import annotations

import datetime as dt
import struct
from collections.abc import Iterable
from typing import Any, Final, TypeVar

import msgspec

from rosz.errors import DecodeError, ParamError
from rosz.params.merge import Change
from rosz.params.paths import Path, joined
from rosz.params.tree import MISSING
from rosz.params.values import Value, normalise
from rosz.params.writes import DELETED, Write, delete, put

__all__ = (
    "Answer",
    "Batch",
    "Index",
    "Question",
    "Record",
    "Sync",
    "SyncAnswer",
    "decode",
    "decode_value",
    "encode",
    "encode_value",
    "join_path",
    "packed",
    "seal",
    "split_path",
    "unseal",
)

_MOMENT: Final = 1
_DATE: Final = 2
_PLAIN: Final = frozenset({bool, int, float, str, bytes})

_HEAD: Final = struct.Struct("<QB")

_Message = TypeVar("_Message", bound=msgspec.Struct)


class Batch(msgspec.Struct, array_like=True):
    """Writes under one stamp.

    Attributes:
        time: Nanoseconds.
        clock: The clock that the time is of.
        origin: Who made them, for people.
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
                batch.puts.append((join_path(path), packed(value)))
        return batch

    def writes(self) -> list[Write]:
        """Return the writes.

        Raises:
            DecodeError: A value or path in it is none.
        """
        stamp = _stamp(self.time, self.clock)
        origin = self.origin
        try:
            found = [
                put(split_path(path), stamp, normalise(value), origin) for path, value in self.puts
            ]
            if self.deletions:
                found += [delete(split_path(path), stamp, origin) for path in self.deletions]
        except ParamError as error:
            raise DecodeError("parameter batch", -1, str(error)) from error
        return found


class Record(msgspec.Struct, array_like=True):
    """One write as it is kept; the value is left out of a deletion."""

    path: str
    time: int
    clock: str
    origin: str
    value: list[Any]

    @classmethod
    def of(cls, write: Write) -> Record:
        """Return the record of a write."""
        value = [] if write.value is DELETED else [packed(write.value)]
        return cls(join_path(write.path), write.time, write.clock, write.origin, value)

    def write(self) -> Write:
        """Return the write.

        Raises:
            DecodeError: The value or path is none.
        """
        stamp = _stamp(self.time, self.clock)
        path = split_path(self.path)
        try:
            if not self.value:
                return delete(path, stamp, self.origin)
            return put(path, stamp, normalise(self.value[0]), self.origin)
        except ParamError as error:
            raise DecodeError("parameter record", -1, str(error)) from error


class Index(msgspec.Struct, array_like=True):
    """The writes of some buckets of a digest, without their values."""

    buckets: list[int]
    entries: list[tuple[str, int, str]]


class Sync(msgspec.Struct, omit_defaults=True):
    """What one replica tells another to find out, or settle, what differs between them.

    Attributes:
        digest: Of the asker's set of writes.
        index: Of the asker's writes in the buckets that differ.
        records: Writes that the other was found to lack.
    """

    digest: bytes | None = None
    index: Index | None = None
    records: list[Record] = []


class SyncAnswer(msgspec.Struct, omit_defaults=True):
    """What it hears back.

    Attributes:
        digest: Of the other's set of writes.
        ready: Whether the other has joined, or is itself still asking around.
        records: Writes that the asker lacks.
        wanted: Paths of writes that the other lacks.
    """

    digest: bytes = b""
    ready: bool = True
    records: list[Record] = []
    wanted: list[str] = []


class Question(msgspec.Struct, omit_defaults=True):
    """What somebody who is no replica asks of one.

    Attributes:
        verb: ``get``, ``names``, ``search``, ``stamp`` or ``write``.
        name: Global name, or the one searched for.
        node: Where a search starts.
        batch: What a write writes. Its stamp is the asker's own, so that it does no harm when two
            replicas, or one of them much later, do it again.
        timeout: Seconds to wait for the other replicas, for a write.
    """

    verb: str
    name: str = "/"
    node: str = "/"
    batch: Batch | None = None
    timeout: float = 0.0


class Answer(msgspec.Struct, omit_defaults=True):
    """What it hears back.

    Attributes:
        status: ``ok``, ``missing`` (no such parameter), ``joining`` (ask another), ``refused``.
        value: What was asked for.
        text: Why not.
        origin: Who set the value.
        slow: Replicas that did not acknowledge a write in time.
    """

    status: str = "ok"
    value: Any = None
    text: str = ""
    origin: str = ""
    slow: list[str] = []


def encode(message: msgspec.Struct) -> bytes:
    """Return a message as bytes."""
    return _ENCODER.encode(message)


def decode(data: bytes | memoryview, kind: type[_Message]) -> _Message:
    """Return the message that bytes hold.

    Raises:
        DecodeError: They hold none of that kind.
    """
    try:
        message: _Message = _DECODERS[kind].decode(data)
    except (msgspec.MsgspecError, RecursionError, ValueError) as error:
        raise DecodeError(f"{kind.__name__.lower()} of parameters", -1, str(error)) from error
    return message


def seal(sender: str, number: int, message: bytes) -> bytes:
    """Put in front of a message who is to hear that it has arrived.

    Args:
        sender: The session that sends it.
        number: Which of its messages it is.
        message: It.
    """
    return _HEAD.pack(number, len(sender)) + sender.encode() + message


def unseal(data: bytes) -> tuple[str, int, int]:
    """Return sender and number of a message, and where it begins.

    Raises:
        DecodeError: The bytes are none.
    """
    if len(data) < _HEAD.size or len(data) < _HEAD.size + data[_HEAD.size - 1]:
        raise DecodeError("message about parameters", 0, f"{len(data)} bytes, expected more")
    number, length = _HEAD.unpack_from(data)
    start = _HEAD.size + length
    sender = data[_HEAD.size : start]
    if not sender.isalnum():
        raise DecodeError("message about parameters", _HEAD.size, f"{sender!r}, expected a session")
    return sender.decode(), number, start


def encode_value(value: Value) -> bytes:
    """Return a value as the bytes under its key."""
    return _ENCODER.encode(packed(value))


def decode_value(data: bytes) -> Value:
    """Return the value that the bytes under a key hold.

    Raises:
        DecodeError: They hold none.
    """
    try:
        return normalise(_ANY.decode(data))
    except (msgspec.MsgspecError, ParamError, RecursionError, ValueError) as error:
        raise DecodeError("parameter value", -1, str(error)) from error


def join_path(path: Path) -> str:
    """Return a path as it is sent."""
    return "/".join(path)


def split_path(text: str) -> Path:
    """Return the path that was sent.

    Raises:
        DecodeError: It has an empty part.
    """
    path = tuple(text.split("/")) if text else ()
    if "" in path:
        raise DecodeError("parameter path", -1, f"'{text}', expected '{joined(path)[1:]}'")
    return path


def _stamp(time: int, clock: str) -> tuple[int, str]:
    if time <= 0:
        raise DecodeError("parameter stamp", -1, f"the time {time}, expected one after the epoch")
    return time, clock


def packed(value: Value) -> Any:
    """Return a value in types that msgpack has: moments with their zone are not among them."""
    return _replaced(value) if _has_moments(value) else value


def _has_moments(value: Value) -> bool:
    kind = type(value)
    if kind in _PLAIN:
        return False
    if kind is dict:
        return any(_has_moments(item) for item in value.values())
    if kind is list:
        return any(_has_moments(item) for item in value)
    return kind is not type(MISSING)


def _replaced(value: Value) -> Any:
    if type(value) is dict:
        return {key: _replaced(item) for key, item in value.items()}
    if type(value) is list:
        return [_replaced(item) for item in value]
    if type(value) is dt.datetime:
        return msgspec.msgpack.Ext(_MOMENT, value.isoformat().encode())
    if type(value) is dt.date:
        return msgspec.msgpack.Ext(_DATE, value.isoformat().encode())
    return value


def _extended(code: int, data: memoryview) -> Any:
    text = bytes(data).decode()
    if code == _MOMENT:
        return dt.datetime.fromisoformat(text)
    if code == _DATE:
        return dt.date.fromisoformat(text)
    raise ValueError(f"extension {code} is unknown; expected {_MOMENT} or {_DATE}")


_ENCODER: Final = msgspec.msgpack.Encoder()
_ANY: Final = msgspec.msgpack.Decoder(ext_hook=_extended)
_DECODERS: Final[dict[type, Any]] = {
    kind: msgspec.msgpack.Decoder(kind, ext_hook=_extended)
    for kind in (Batch, Sync, SyncAnswer, Question, Answer)
}
