"""The appearance of turtles, and pictures of the field as PNG (W3C PNG Specification)."""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterable, Iterator

import msgspec

from rosz.turtlesim.world import UNIT_PIXELS, Canvas, Color, Point, Turtle, span


class Patch(msgspec.Struct, frozen=True):
    """A convex polygon of one color, with its corners in pixels of the field."""

    color: Color
    outline: tuple[Point, ...]


_KINDS = (
    ((126, 186, 96), (56, 94, 40), (92, 142, 62), (148, 190, 104)),
    ((222, 178, 108), (104, 62, 26), (160, 102, 48), (206, 152, 84)),
    ((108, 190, 178), (22, 84, 92), (38, 128, 132), (104, 190, 180)),
    ((226, 146, 120), (112, 34, 34), (172, 62, 52), (226, 120, 92)),
    ((196, 160, 214), (74, 40, 104), (118, 72, 152), (174, 128, 202)),
    ((214, 206, 120), (98, 92, 24), (152, 144, 48), (208, 200, 104)),
)
"""For each kind of turtle, the colors of skin, rim, shell and plates."""
_EYE = (24, 24, 24)


def _oval(center: Point, radii: Point, angle: float = 0.0, corners: int = 20) -> tuple[Point, ...]:
    cos, sin = math.cos(angle), math.sin(angle)
    outline: list[Point] = []
    for number in range(corners):
        corner = math.tau * number / corners
        x, y = radii[0] * math.cos(corner), radii[1] * math.sin(corner)
        outline.append((center[0] + cos * x - sin * y, center[1] + sin * x + cos * y))
    return tuple(outline)


def _plate(x: float, y: float, size: float) -> tuple[Point, ...]:
    return _oval((x, y), (size, size), corners=6)


# Outlines of a turtle that looks along x, in units of the field.
_LIMBS = (
    ((-0.36, 0.07), (-0.36, -0.07), (-0.52, 0.0)),
    _oval((0.25, 0.33), (0.19, 0.085), 1.0),
    _oval((0.25, -0.33), (0.19, 0.085), -1.0),
    _oval((-0.27, 0.29), (0.15, 0.08), 2.3),
    _oval((-0.27, -0.29), (0.15, 0.08), -2.3),
    _oval((0.46, 0.0), (0.14, 0.115)),
)
_EYES = (_oval((0.52, 0.055), (0.025, 0.025)), _oval((0.52, -0.055), (0.025, 0.025)))
_RIM = _oval((0.0, 0.0), (0.40, 0.335))
_SHELL = _oval((0.0, 0.0), (0.36, 0.295))
_PLATES = (
    _plate(0.0, 0.0, 0.105),
    _plate(0.2, 0.0, 0.085),
    _plate(-0.2, 0.0, 0.085),
    *(_plate(x, y, 0.085) for x in (0.1, -0.1) for y in (0.165, -0.165)),
)


def patches(turtle: Turtle) -> Iterator[Patch]:
    """Yield the polygons of a turtle in the field, in the order of painting."""
    skin, rim, shell, plate = _KINDS[turtle.kind % len(_KINDS)]
    center_x, center_y = turtle.pixel
    cos = UNIT_PIXELS * math.cos(turtle.theta)
    sin = UNIT_PIXELS * math.sin(turtle.theta)
    layers = ((skin, _LIMBS), (_EYE, _EYES), (rim, (_RIM,)), (shell, (_SHELL,)), (plate, _PLATES))
    for color, outlines in layers:
        for outline in outlines:
            # Rows of pixels count downwards, the y axis of the field upwards.
            pixels = (
                (center_x + cos * x - sin * y, center_y - sin * x - cos * y) for x, y in outline
            )
            yield Patch(color, tuple(pixels))


_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_TRUE_COLOR_8 = (8, 2, 0, 0, 0)
"""Fields of IHDR: bit depth, color type, compression, filter and interlace methods."""
_LINES = 4
"""Number of lines that are sampled in each row of pixels, for smooth edges."""


def render(field: Canvas, turtles: Iterable[Turtle]) -> bytes:
    """Return a PNG of a field and its turtles; later turtles cover earlier ones."""
    pixels = bytearray(field.pixels)
    for turtle in turtles:
        for patch in patches(turtle):
            paint(pixels, field.width, field.height, patch)
    return encode_png(pixels, field.width, field.height)


def paint(pixels: bytearray, width: int, height: int, patch: Patch) -> None:
    """Paint a polygon with smooth edges into RGB pixels; parts outside of them are ignored."""
    rows = [y for _, y in patch.outline]
    for row in range(max(0, math.floor(min(rows))), min(height, math.ceil(max(rows)) + 1)):
        coverage = _coverage(patch, row, width)
        for column, share in coverage.items():
            for index, value in enumerate(patch.color, 3 * (row * width + column)):
                pixels[index] = round(pixels[index] + min(share, 1.0) * (value - pixels[index]))


def _coverage(patch: Patch, row: int, width: int) -> dict[int, float]:
    """Return which share of each pixel of a row a polygon covers, from 0 to 1, by column."""
    cover: dict[int, float] = {}
    for line in range(_LINES):
        crossing = span(patch.outline, row - 0.5 + (line + 0.5) / _LINES)
        if crossing is None:
            continue
        left, right = crossing[0] + 0.5, crossing[1] + 0.5
        for column in range(max(0, math.floor(left)), min(width, math.ceil(right))):
            share = min(right, column + 1) - max(left, column)
            cover[column] = cover.get(column, 0.0) + share / _LINES
    return cover


def encode_png(pixels: bytes | bytearray, width: int, height: int) -> bytes:
    """Return a PNG of RGB pixels: three bytes per pixel, row by row from the top."""
    stride = 3 * width
    # Each row begins with the number of its filter; 0 means no filter.
    rows = b"".join(b"\0" + pixels[at : at + stride] for at in range(0, stride * height, stride))
    header = struct.pack(">2I5B", width, height, *_TRUE_COLOR_8)
    data = zlib.compress(rows, 6)
    return _SIGNATURE + _chunk(b"IHDR", header) + _chunk(b"IDAT", data) + _chunk(b"IEND", b"")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
