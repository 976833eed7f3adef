"""Turtles, how they move, and the field that they draw on. Pure: no clock, no network."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import msgspec

from rosz.errors import NotFoundError, UsageError

FIELD_PIXELS = 500
"""Width and height of the field in pixels."""
UNIT_PIXELS = 45
"""Pixels of one unit of length, which is about the length of a turtle."""
SIZE = (FIELD_PIXELS - 1) / UNIT_PIXELS
"""Width and height of the field in units, 11.09: the largest x and y."""
STEP_SECONDS = 0.016
"""Simulated time of one step: 62.5 steps per second."""
_COMMAND_SECONDS = 1.0
"""Time for which a turtle follows a command that is not repeated."""


Color = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""

Point = tuple[float, float]


class Canvas:
    """The picture that turtles draw on: three bytes per pixel, row by row from the top.

    Coordinates are pixels from the upper left corner, x to the right and y down; pixel ``i`` has
    its center at ``i``. Drawing outside the picture is allowed and has no effect.

    Attributes:
        version: Number that grows with every change.
    """

    def __init__(self, width: int, height: int, color: Color) -> None:
        self.width: int = width
        self.height: int = height
        self.version: int = 0
        self.pixels: bytearray = bytearray()
        self.fill(color)

    def copy(self) -> Canvas:
        """Return an independent copy."""
        copied = Canvas(0, 0, (0, 0, 0))
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
        """Draw a line with round ends, ``width`` pixels wide; start and end may be equal."""
        radius = width / 2
        body = _body(start, end, radius)
        top = max(0, math.ceil(min(start[1], end[1]) - radius))
        bottom = min(self.height, math.ceil(max(start[1], end[1]) + radius))
        for row in range(top, bottom):
            spans = [_disc_span(start, radius, row), _disc_span(end, radius, row), span(body, row)]
            crossed = [ends for ends in spans if ends is not None]
            if crossed:
                self._fill_row(row, min(s[0] for s in crossed), max(s[1] for s in crossed), color)
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
    dx, dy = (y1 - y2) * radius / length, (x2 - x1) * radius / length
    return ((x1 + dx, y1 + dy), (x2 + dx, y2 + dy), (x2 - dx, y2 - dy), (x1 - dx, y1 - dy))


class Pen(msgspec.Struct, frozen=True):
    """The pen of a turtle; its width is in pixels."""

    color: Color = (179, 184, 255)
    width: int = 3
    on: bool = True


@dataclass
class Turtle:
    """A turtle; speeds are in units per second and rad/s.

    Attributes:
        x: Distance from the left edge in units.
        y: Distance from the lower edge in units.
        theta: Heading in rad, counter-clockwise from the x axis.
        kind: Number of its appearance.
        sees: Color below the turtle, before the line of its last step was drawn.
    """

    x: float
    y: float
    theta: float
    kind: int = 0
    forward: float = 0.0
    left: float = 0.0
    turn: float = 0.0
    pen: Pen = field(default_factory=Pen)
    sees: Color = (0, 0, 0)
    _commanded_at: float = -math.inf
    _jumps: list[Callable[[], None]] = field(default_factory=list)

    @property
    def pixel(self) -> Point:
        """Position on the picture."""
        return _pixel((self.x, self.y))

    @property
    def speed(self) -> float:
        """Speed regardless of direction."""
        return math.hypot(self.forward, self.left)

    def command(self, now: float, *, forward: float, left: float, turn: float) -> None:
        """Set the speeds for one second from ``now``, a time of the clock of `step`.

        Raises:
            UsageError: A speed is infinite or not a number.
        """
        _check_finite(forward=forward, left=left, turn=turn)
        self.forward, self.left, self.turn = forward, left, turn
        self._commanded_at = now

    def teleport_to(self, x: float, y: float, theta: float) -> None:
        """Move to a place at the next step, and draw a line there; the numbers must be finite."""
        _check_finite(x=x, y=y, theta=theta)

        def jump() -> None:
            self.x, self.y, self.theta = x, min(y, SIZE), theta

        self._jumps.append(jump)

    def teleport_by(self, length: float, theta: float) -> None:
        """Rotate, then move forward, at the next step; the numbers must be finite."""
        _check_finite(linear=length, angular=theta)

        def jump() -> None:
            self.theta += theta
            self.x += math.cos(self.theta) * length
            self.y += math.sin(self.theta) * length

        self._jumps.append(jump)

    def step(self, picture: Canvas, now: float) -> Point | None:
        """Move for `STEP_SECONDS`, and draw; return the point behind the wall if one stopped it."""
        for jump in self._jumps:
            before = self.x, self.y
            jump()
            self._draw(picture, before)
        self._jumps.clear()
        if now - self._commanded_at > _COMMAND_SECONDS:
            self.forward = self.left = self.turn = 0.0
        before = self.x, self.y
        self.theta = _normal(self.theta + self.turn * STEP_SECONDS)
        ahead, aside = self.forward * STEP_SECONDS, self.left * STEP_SECONDS
        cos, sin = math.cos(self.theta), math.sin(self.theta)
        goal = self.x + cos * ahead - sin * aside, self.y + sin * ahead + cos * aside
        self.x, self.y = (min(max(value, 0.0), SIZE) for value in goal)
        self.sees = picture.color_at(*self.pixel)
        self._draw(picture, before)
        return goal if goal != (self.x, self.y) else None

    def _draw(self, picture: Canvas, before: Point) -> None:
        if self.pen.on and before != (self.x, self.y):
            picture.line(_pixel(before), self.pixel, self.pen.width, self.pen.color)


def _pixel(place: Point) -> Point:
    return place[0] * UNIT_PIXELS, (SIZE - place[1]) * UNIT_PIXELS


def _normal(angle: float) -> float:
    """Return the same angle from -pi, included, to pi, excluded."""
    rest = math.remainder(angle, math.tau)
    return rest if rest < math.pi else rest - math.tau


def _check_finite(**numbers: float) -> None:
    """Raise a UsageError if a number is infinite or not a number."""
    for name, value in numbers.items():
        if not math.isfinite(value):
            raise UsageError(f"{name} is '{value}': expected a finite number")


BACKGROUND = (69, 86, 255)
"""Default color of the field."""
FIRST = "turtle1"
"""Name of the first turtle."""
(START,) = struct.unpack("f", struct.pack("f", SIZE / 2))
"""Initial x and y of the first turtle: the middle, in the single precision of messages."""


class World:
    """A field with turtles by name, in the order of their creation; empty at first."""

    def __init__(self, background: Color = BACKGROUND) -> None:
        self.field: Canvas = Canvas(FIELD_PIXELS, FIELD_PIXELS, background)
        self.turtles: dict[str, Turtle] = {}
        self._last_number = 0
        self._spawned = 0

    def spawn(self, x: float, y: float, theta: float, name: str = "") -> str:
        """Add a turtle, and return its name: ``turtle1``, ``turtle2`` … when none is given.

        Raises:
            UsageError: The name is taken, or an argument is infinite or not a number.
        """
        _check_finite(x=x, y=y, theta=theta)
        name = name or self.free_name()
        if name in self.turtles:
            raise UsageError(f"a turtle named [{name}] already exists")
        self.turtles[name] = Turtle(x, y, theta, kind=self._spawned)
        self._spawned += 1
        return name

    def free_name(self) -> str:
        """Return a default name that no turtle has."""
        while True:
            self._last_number += 1
            name = f"turtle{self._last_number}"
            if name not in self.turtles:
                return name

    def kill(self, name: str) -> None:
        """Remove a turtle; its lines stay. Raises `NotFoundError` if there is none of that name."""
        if name not in self.turtles:
            raise NotFoundError(f"tried to kill turtle [{name}], which does not exist")
        del self.turtles[name]

    def clear(self, background: Color) -> None:
        """Remove all lines."""
        self.field.fill(background)

    def reset(self, background: Color) -> str:
        """Restart with one turtle, and return its name."""
        self.turtles.clear()
        self._last_number = self._spawned = 0
        self.clear(background)
        return self.spawn(START, START, 0.0)

    def step(self, now: float) -> Iterator[tuple[str, Point]]:
        """Move all turtles by one step; ``now`` is a time of the clock of `Turtle.command`.

        Yields the name of each that hit a wall, and the place behind the wall where it was going.
        """
        for name, turtle in self.turtles.items():
            goal = turtle.step(self.field, now)
            if goal is not None:
                yield name, goal
