"""Writing ROS 1's bags (ROS wiki, Bags/Format/2.0)."""

from __future__ import annotations

import bz2
import os
import struct
from typing import Any

from rosz.bags.bag import Channel, Payload, compression_library
from rosz.bags.formats import ros1_records as ros1
from rosz.bags.formats.chunk_writer import ChunkWriter, FilledChunk
from rosz.errors import BagError, UsageError

_HEADER_SIZE = 4096
"""Bytes of the first record without its lengths; it is written again at the end."""
_SECOND = 1_000_000_000
_LATEST = (1 << 32) * _SECOND - 1
_STAMP = struct.Struct("<II")
_INDEX = struct.Struct("<III")
_U64 = struct.Struct("<Q")
_VERSION = ros1.LENGTH.pack(1)


class Ros1Writer(ChunkWriter):
    """A bag of ROS 1 that is written; see `rosz.bags.BagWriter`.

    Its channels have the encoding ``ros1``, and their definitions are those of ROS 1.
    """

    format = "rosbag"
    latest = _LATEST

    def _prepare(self, compression: str) -> None:
        self._places: list[tuple[int, FilledChunk]] = []
        self._connections: list[bytes] = []
        if compression not in {"none", "bz2", "lz4"}:
            raise UsageError(
                f"ROS 1's bags have no compression '{compression}'; they have bz2 and lz4"
            )
        if compression == "lz4":
            compression_library("lz4")

    def _define(self, handle: int, channel: Channel) -> None:
        if channel.encoding != "ros1":
            raise BagError(
                f"a bag of ROS 1 cannot hold messages of '{channel.topic}' as {channel.encoding};"
                " 'rosz bag convert' translates them",
                str(self.path),
            )
        package, _, base = channel.type.partition("/msg/")
        texts = {
            "topic": channel.topic,
            "type": f"{package}/{base}" if base else channel.type,
            "md5sum": channel.md5 or "*",
            "message_definition": channel.definition,
        }
        if channel.node:
            texts["callerid"] = channel.node
        if channel.latched:
            texts["latching"] = "1"
        about = _fields(**{name: value.encode() for name, value in texts.items()})
        head = {"op": bytes([ros1.OP_CONNECTION]), "conn": ros1.LENGTH.pack(handle)}
        record = _record(about, **head, topic=channel.topic.encode())
        self._connections.append(record)
        self._chunk.add(record)

    def _message_head(self, handle: int, stamp: int, size: int, sent: int, sequence: int) -> bytes:
        del sent, sequence  # the format has no place for them
        return (
            b"\x26\0\0\0\x04\0\0\0op=\x02\x09\0\0\0conn="
            + ros1.LENGTH.pack(handle)
            + b"\x0d\0\0\0time="
            + _STAMP.pack(*divmod(stamp, _SECOND))
            + ros1.LENGTH.pack(size)
        )

    def _header(self) -> bytes:
        return ros1.MAGIC + _bag_record(0, 0, 0)

    def _write_chunk(self, chunk: FilledChunk) -> None:
        parts, size = chunk.parts, chunk.size
        if self._compression != "none":
            packed = _compress(self._compression, b"".join(parts))
            parts, size = [packed], len(packed)
        head = _fields(
            op=bytes([ros1.OP_CHUNK]),
            compression=self._compression.encode(),
            size=ros1.LENGTH.pack(chunk.size),
        )
        indexes = [_index_record(handle, index) for handle, index in chunk.index.items()]
        offset = self._offset
        self._append(ros1.LENGTH.pack(len(head)), head, ros1.LENGTH.pack(size), *parts, *indexes)
        chunk.parts = []
        self._places.append((offset, chunk))

    def _tail(self) -> list[bytes]:
        self._index_place = self._offset
        return self._connections + [_chunk_info(*place) for place in self._places]

    def _finish(self) -> None:
        head = _bag_record(self._index_place, len(self._connections), len(self._places))
        try:
            os.pwrite(self._file, head, len(ros1.MAGIC))
        except OSError as error:
            reason = f"cannot write its index: {error.strerror}"
            raise BagError(reason, str(self.path), len(ros1.MAGIC)) from error


def _fields(**fields: bytes) -> bytes:
    rows = (name.encode() + b"=" + value for name, value in fields.items())
    return b"".join(ros1.LENGTH.pack(len(row)) + row for row in rows)


def _record(data: bytes, **fields: bytes) -> bytes:
    head = _fields(**fields)
    return ros1.LENGTH.pack(len(head)) + head + ros1.LENGTH.pack(len(data)) + data


def _bag_record(index_place: int, connections: int, chunks: int) -> bytes:
    head = {
        "op": bytes([ros1.OP_BAG]),
        "index_pos": _U64.pack(index_place),
        "conn_count": ros1.LENGTH.pack(connections),
        "chunk_count": ros1.LENGTH.pack(chunks),
    }
    return _record(b" " * (_HEADER_SIZE - len(_fields(**head))), **head)


def _index_record(handle: int, index: Any) -> bytes:
    rows = zip(index[::2], index[1::2], strict=True)
    data = b"".join(_INDEX.pack(*divmod(stamp, _SECOND), place) for stamp, place in rows)
    head = {"ver": _VERSION, "conn": ros1.LENGTH.pack(handle)}
    count = ros1.LENGTH.pack(len(data) // _INDEX.size)
    return _record(data, op=bytes([ros1.OP_INDEX]), **head, count=count)


def _chunk_info(offset: int, chunk: FilledChunk) -> bytes:
    rows = [(handle, len(index) // 2) for handle, index in chunk.index.items()]
    return _record(
        b"".join(_STAMP.pack(*row) for row in rows),
        op=bytes([ros1.OP_CHUNK_INFO]),
        ver=_VERSION,
        chunk_pos=_U64.pack(offset),
        start_time=_STAMP.pack(*divmod(chunk.start, _SECOND)),
        end_time=_STAMP.pack(*divmod(chunk.end, _SECOND)),
        count=ros1.LENGTH.pack(len(rows)),
    )


def _compress(name: str, data: Payload) -> bytes:
    if name == "bz2":
        return bz2.compress(data)
    library = compression_library("lz4")
    # roslz4 reads frames of independent blocks only.
    packed: bytes = library.compress(
        data,
        block_size=library.BLOCKSIZE_MAX4MB,
        block_linked=False,
        content_checksum=True,
        block_checksum=False,
        store_size=False,
    )
    return packed
