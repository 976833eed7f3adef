"""A strict reader of the kind of PNG that turtlesim writes."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from typing import NamedTuple

Color = tuple[int, int, int]


class Image(NamedTuple):
    """A picture with three bytes per pixel."""

    width: int
    height: int
    rows: list[bytes]

    def at(self, x: int, y: int) -> Color:
        """Return the color of a pixel."""
        red, green, blue = self.rows[y][3 * x : 3 * x + 3]
        return red, green, blue

    def colors(self) -> set[Color]:
        """Return all colors of the picture."""
        return {self.at(x, y) for y in range(self.height) for x in range(self.width)}


def read(data: bytes) -> Image:
    """Read a picture."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    chunks = list(_chunks(data))
    assert [kind for kind, _ in chunks] == [b"IHDR", b"IDAT", b"IEND"]
    width, height, *form = struct.unpack(">2I5B", chunks[0][1])
    assert form == [8, 2, 0, 0, 0]
    raw = zlib.decompress(chunks[1][1])
    stride = 3 * width + 1
    assert len(raw) == stride * height
    rows = [raw[at : at + stride] for at in range(0, len(raw), stride)]
    assert all(row[0] == 0 for row in rows)
    return Image(width, height, [row[1:] for row in rows])


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = 8
    while at < len(data):
        (size,) = struct.unpack_from(">I", data, at)
        body = data[at + 4 : at + 8 + size]
        assert struct.unpack_from(">I", data, at + 8 + size) == (zlib.crc32(body),)
        yield body[:4], body[4:]
        at += 12 + size
