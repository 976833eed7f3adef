"""Small bags with a part that unpacks to gigabytes, or that says so."""

from __future__ import annotations

import bz2
import sqlite3
import struct
from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import lz4.frame
import zstandard

from rosz.bags import Channel
from rosz.bags.formats import mcap_records as mcap
from rosz.bags.formats.mcap_records import Op
from rosz.bags.formats.rosbag2_writer import Rosbag2Writer

__all__ = ("write_bombs",)

CHANNEL = Channel("/chatter", "std_msgs/msg/String", definition="string data\n")
PIECE = 1 << 24


def compressor_of(name: str) -> Any:
    if name == "bz2":
        return bz2.BZ2Compressor()
    if name == "lz4":
        made = lz4.frame.LZ4FrameCompressor()
        return _Lz4(made)
    return zstandard.ZstdCompressor(level=1).compressobj()


class _Lz4:
    def __init__(self, made: Any) -> None:
        self._made, self._begin = made, made.begin()

    def compress(self, data: bytes) -> bytes:
        begin, self._begin = self._begin, b""
        return bytes(begin + self._made.compress(data))

    def flush(self) -> bytes:
        return bytes(self._made.flush())


@lru_cache
def packed(name: str, head: bytes, size: int) -> bytes:
    """Return a head and zeros, compressed."""
    made = compressor_of(name)
    parts = [made.compress(head)]
    parts += [made.compress(bytes(PIECE)) for _ in range(size // PIECE)]
    return b"".join([*parts, made.flush()])


def mcap_bomb(path: Path, name: str, size: int, declared: int) -> None:
    """Write a file without an index, whose chunk has one large message."""
    head = mcap.record(Op.SCHEMA, mcap.schema_body(1, CHANNEL))
    head += mcap.record(Op.CHANNEL, mcap.channel_body(1, 1, CHANNEL))
    head += mcap.MESSAGE.pack(Op.MESSAGE, 22 + size, 1, 1, 5, 5)
    data = packed(name, head, size)
    chunk = mcap.CHUNK_HEAD.pack(5, 5, declared or len(head) + size, 0) + mcap.text(name)
    chunk += struct.pack("<Q", len(data)) + data
    header = mcap.record(Op.HEADER, mcap.text("ros2") + mcap.text(""))
    path.write_bytes(mcap.MAGIC + header + mcap.record(Op.CHUNK, chunk))


def bag_bomb(path: Path, name: str, size: int, declared: int) -> None:
    """Write a bag of ROS 1 without an index."""

    def fields(**values: bytes) -> bytes:
        rows = (key.encode() + b"=" + value for key, value in values.items())
        data = b"".join(struct.pack("<I", len(row)) + row for row in rows)
        return struct.pack("<I", len(data)) + data

    about = fields(topic=b"/c", type=b"std_msgs/String", md5sum=b"*", message_definition=b"")
    head = fields(op=b"\7", conn=bytes(4), topic=b"/c") + about
    head += fields(op=b"\2", conn=bytes(4), time=bytes(8)) + struct.pack("<I", size)
    data = packed(name, head, size)
    stated = struct.pack("<I", declared or len(head) + size)
    begin = fields(op=b"\3", index_pos=bytes(8), conn_count=bytes(4), chunk_count=bytes(4))
    chunk = fields(op=b"\5", compression=name.encode(), size=stated)
    whole = b"#ROSBAG V2.0\n" + begin + struct.pack("<I", 0) + chunk
    path.write_bytes(whole + struct.pack("<I", len(data)) + data)


def message_bomb(path: Path, size: int) -> None:
    """Write a folder with one message that was compressed alone."""
    with Rosbag2Writer(path, storage="sqlite3", compression="zstd") as writer:
        writer.write(writer.add(CHANNEL), 5, b"hello")
    with sqlite3.connect(path / f"{path.name}_0.db3") as database:
        database.execute("UPDATE messages SET data = ?", (packed("zstd", b"", size),))
    database.close()


def file_bomb(path: Path, size: int) -> None:
    """Write a folder whose file was compressed."""
    path.mkdir()
    (path / "a_0.mcap.zstd").write_bytes(packed("zstd", mcap.MAGIC, size))


def write_bombs(folder: Path, size: int) -> Iterator[Path]:
    """Write bags whose parts unpack to a number of bytes; yield their paths."""
    forms: dict[str, Callable[..., None]] = {"mcap": mcap_bomb, "bag": bag_bomb}
    for form, name in (("mcap", "zstd"), ("mcap", "lz4"), ("bag", "bz2"), ("bag", "lz4")):
        for declared in (0, 1000):
            path = folder / f"{name}-{declared}.{form}"
            forms[form](path, name, size, declared)
            yield path
    message_bomb(folder / "message", size)
    yield folder / "message"
    file_bomb(folder / "file", size)
    yield folder / "file"
