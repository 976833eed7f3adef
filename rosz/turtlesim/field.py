"""The picture that turtles draw on.

Coordinates are pixels from the upper left corner, x to the right and y down; pixel ``i`` has its
center at ``i``. Drawing outside the picture is allowed and has no effect.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

__all__ = ("Color", "Field", "Point", "span")

Color = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""

Point = tuple[float, float]


class Field:
    """An RGB picture.

    Args:
        width: Width in pixels.
        height: Height in pixels.
        color: Initial color of all pixels.

    Attributes:
        width: As given.
        height: As given.
        pixels: Three bytes per pixel, row by row from the top.
        version: Number that grows with every change.
    """

    def __init__(self, width: int, height: int, color: Color) -> None:
        self.width: int = width
        self.height: int = height
        self.version: int = 0
        self.pixels: bytearray = bytearray()
        self.fill(color)

    def copy(self) -> Field:
        """Return an independent copy."""
        copied = Field(0, 0, (0, 0, 0))
        copied.width, copied.height, copied.version = self.width, self.height, self.version
        copied.pixels = bytearray(self.pixels)
        return copied

    def fill(self, color: Color) -> None:
        """Fill the picture with a color."""
        self.pixels = bytearray(bytes(color) * (self.width * self.height))
        self.version += 1

    def color_at(self, x: float, y: float) -> Color:
        """Return the color of the pixel nearest to a place, which may be outside the picture."""
        column = _nearest(x, self.width)
        at = 3 * (_nearest(y, self.height) * self.width + column)
        red, green, blue = self.pixels[at : at + 3]
        return red, green, blue

    def line(self, start: Point, end: Point, width: float, color: Color) -> None:
        """Draw a straight line with round ends.

        Args:
            start: Start of the line.
            end: End of the line; may equal the start.
            width: Width in pixels.
            color: Color of the line.
        """
        radius = width / 2
        body = _body(start, end, radius)
        top = max(0, math.ceil(min(start[1], end[1]) - radius))
        bottom = min(self.height, math.ceil(max(start[1], end[1]) + radius))
        for row in range(top, bottom):
            spans = [_disc_span(start, radius, row), _disc_span(end, radius, row), span(body, row)]
            found = [one for one in spans if one is not None]
            if found:
                self._fill_row(row, min(s[0] for s in found), max(s[1] for s in found), color)
        self.version += 1

    def _fill_row(self, row: int, left: float, right: float, color: Color) -> None:
        """Fill the pixels of a row whose centers lie from left, included, to right, excluded."""
        first = max(0, math.ceil(left))
        end = min(self.width, math.ceil(right))
        if first < end:
            at = 3 * (row * self.width + first)
            self.pixels[at : at + 3 * (end - first)] = bytes(color) * (end - first)


def span(polygon: Sequence[Point], y: float) -> tuple[float, float] | None:
    """Return where a horizontal line enters and leaves a convex polygon; None if it does not."""
    crossings: list[float] = []
    x1, y1 = polygon[-1]
    for x2, y2 in polygon:
        if (y1 <= y) != (y2 <= y):
            crossings.append(x1 + (y - y1) / (y2 - y1) * (x2 - x1))
        x1, y1 = x2, y2
    return (min(crossings), max(crossings)) if crossings else None


def _nearest(value: float, size: int) -> int:
    return min(max(math.floor(value + 0.5), 0), size - 1)


def _disc_span(center: Point, radius: float, row: int) -> tuple[float, float] | None:
    down = row - center[1]
    if not -radius <= down < radius:
        return None
    half = math.sqrt(radius * radius - down * down)
    return center[0] - half, center[0] + half


def _body(start: Point, end: Point, radius: float) -> tuple[Point, ...]:
    """Return the corners of the rectangular part of a line."""
    (x1, y1), (x2, y2) = start, end
    length = math.hypot(x2 - x1, y2 - y1)
    if length == 0:
        return (start, end)
    across, down = (y1 - y2) * radius / length, (x2 - x1) * radius / length
    return (
        (x1 + across, y1 + down),
        (x2 + across, y2 + down),
        (x2 - across, y2 - down),
        (x1 - across, y1 - down),
    )
