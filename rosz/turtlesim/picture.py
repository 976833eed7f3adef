"""A picture of the field with its turtles, as PNG (W3C PNG Specification, third edition)."""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterable

from rosz.turtlesim.field import Color, Field, span
from rosz.turtlesim.shape import Patch, looks
from rosz.turtlesim.turtle import Turtle

__all__ = ("encode_png", "paint", "take")

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_TRUE_COLOR_8 = (8, 2, 0, 0, 0)
"""Depth in bits, colour type, and the only methods of compression, filtering and interlace."""
_LINES = 4
"""Lines looked at in each row of pixels, for smooth edges."""


def take(field: Field, turtles: Iterable[Turtle]) -> bytes:
    """Return a picture as PNG.

    Args:
        field: What was drawn; it stays as it is.
        turtles: Who is on it, from the lowest to the uppermost.
    """
    pixels = bytearray(field.pixels)
    for turtle in turtles:
        for patch in looks(turtle):
            paint(pixels, field.width, field.height, patch)
    return encode_png(pixels, field.width, field.height)


def paint(pixels: bytearray, width: int, height: int, patch: Patch) -> None:
    """Paint a patch with smooth edges.

    Args:
        pixels: RGB, row by row.
        width: Pixels of a row.
        height: Rows.
        patch: What to paint; what is outside the picture is left out.
    """
    rows = [y for _, y in patch.outline]
    for row in range(max(0, math.floor(min(rows))), min(height, math.ceil(max(rows)) + 1)):
        cover = _coverage(patch, row, width)
        for column, share in cover.items():
            _blend(pixels, 3 * (row * width + column), patch.color, min(share, 1.0))


def _coverage(patch: Patch, row: int, width: int) -> dict[int, float]:
    """Return how much of each pixel of a row a patch covers, from 0 to 1."""
    cover: dict[int, float] = {}
    for line in range(_LINES):
        found = span(patch.outline, row - 0.5 + (line + 0.5) / _LINES)
        if found is None:
            continue
        left, right = found[0] + 0.5, found[1] + 0.5
        for column in range(max(0, math.floor(left)), min(width, math.ceil(right))):
            share = min(right, column + 1) - max(left, column)
            cover[column] = cover.get(column, 0.0) + share / _LINES
    return cover


def _blend(pixels: bytearray, at: int, color: Color, share: float) -> None:
    for offset, value in enumerate(color, at):
        pixels[offset] = round(pixels[offset] + share * (value - pixels[offset]))


def encode_png(pixels: bytes | bytearray, width: int, height: int) -> bytes:
    """Return an RGB picture as PNG.

    Args:
        pixels: Three bytes a pixel, row by row from the top.
        width: Pixels.
        height: Pixels.
    """
    stride = 3 * width
    # Each row says first how it is filtered: 0 is not at all.
    rows = b"".join(b"\0" + pixels[at : at + stride] for at in range(0, stride * height, stride))
    header = struct.pack(">2I5B", width, height, *_TRUE_COLOR_8)
    return b"".join(
        (
            _SIGNATURE,
            _chunk(b"IHDR", header),
            _chunk(b"IDAT", zlib.compress(rows, 6)),
            _chunk(b"IEND", b""),
        )
    )


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
