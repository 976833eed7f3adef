"""One turtle: where it is, how it moves, what it draws. No clock, no network."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import msgspec

from rosz.errors import UsageError
from rosz.turtlesim.field import Color, Field, Point

__all__ = (
    "COMMAND_SECONDS",
    "FIELD_PIXELS",
    "SIZE",
    "STEP_SECONDS",
    "UNIT_PIXELS",
    "Pen",
    "Turtle",
    "check_finite",
)

FIELD_PIXELS = 500
"""Width and height of the field."""
UNIT_PIXELS = 45
"""Pixels of one unit of length, about a turtle."""
SIZE = (FIELD_PIXELS - 1) / UNIT_PIXELS
"""Width and height of the field in units, 11.09: x and y run from 0 to here."""
STEP_SECONDS = 0.016
"""Time that one step stands for: 62.5 steps a second."""
COMMAND_SECONDS = 1.0
"""How long a turtle follows a command that is not repeated."""

_PEN_COLOR = (179, 184, 255)


class Pen(msgspec.Struct, frozen=True):
    """What a turtle draws with.

    Attributes:
        color: Of the line.
        width: Pixels.
        on: Whether it draws.
    """

    color: Color = _PEN_COLOR
    width: int = 3
    on: bool = True


class _Teleport(msgspec.Struct, frozen=True):
    """A leap: to a place, or by a turn and a length from where the turtle is."""

    theta: float
    to: Point | None = None
    length: float = 0.0


@dataclass
class Turtle:
    """A turtle.

    Attributes:
        x: Units from the left edge.
        y: Units from the lower edge.
        theta: Heading in rad, counter-clockwise from the x axis.
        kind: Number of its looks.
        forward: Speed ahead, in units per second.
        left: Speed to the left.
        turn: Angular speed in rad/s, counter-clockwise.
        pen: What it draws with.
        sees: Colour that it stood on before it drew the last step.
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
    _commanded: float = -math.inf
    _teleports: list[_Teleport] = field(default_factory=list)

    @property
    def pixel(self) -> Point:
        """Where it is on the picture."""
        return _pixel((self.x, self.y))

    @property
    def speed(self) -> float:
        """How fast it goes, in whatever direction."""
        return math.hypot(self.forward, self.left)

    def command(self, now: float, *, forward: float, left: float, turn: float) -> None:
        """Take a speed to keep for a second.

        Args:
            now: Time in seconds, on any clock that `step` goes by as well.
            forward: Units per second.
            left: Units per second.
            turn: rad/s.

        Raises:
            UsageError: A speed is infinite or no number.
        """
        check_finite(forward=forward, left=left, turn=turn)
        self.forward, self.left, self.turn = forward, left, turn
        self._commanded = now

    def teleport_to(self, x: float, y: float, theta: float) -> None:
        """Be somewhere else from the next step on, drawing a line there.

        Raises:
            UsageError: A number is infinite or none.
        """
        check_finite(x=x, y=y, theta=theta)
        self._teleports.append(_Teleport(theta, (x, min(y, SIZE))))

    def teleport_by(self, length: float, theta: float) -> None:
        """Turn, then be so far ahead, from the next step on.

        Raises:
            UsageError: A number is infinite or none.
        """
        check_finite(linear=length, angular=theta)
        self._teleports.append(_Teleport(theta, length=length))

    def step(self, picture: Field, now: float) -> Point | None:
        """Move on by `STEP_SECONDS`, and draw.

        Args:
            picture: What it draws on.
            now: Time in seconds.

        Returns:
            Where it would have gone, if a wall has stopped it.
        """
        for leap in self._teleports:
            self._leap(leap, picture)
        self._teleports.clear()
        if now - self._commanded > COMMAND_SECONDS:
            self.forward = self.left = self.turn = 0.0
        before = self.x, self.y
        self.theta = _normal(self.theta + self.turn * STEP_SECONDS)
        ahead, aside = self.forward * STEP_SECONDS, self.left * STEP_SECONDS
        cos, sin = math.cos(self.theta), math.sin(self.theta)
        wish = self.x + cos * ahead - sin * aside, self.y + sin * ahead + cos * aside
        self.x, self.y = (min(max(value, 0.0), SIZE) for value in wish)
        self.sees = picture.color_at(*self.pixel)
        self._draw(picture, before)
        return wish if wish != (self.x, self.y) else None

    def _leap(self, leap: _Teleport, picture: Field) -> None:
        before = self.x, self.y
        if leap.to is None:
            self.theta += leap.theta
            self.x += math.cos(self.theta) * leap.length
            self.y += math.sin(self.theta) * leap.length
        else:
            self.theta = leap.theta
            self.x, self.y = leap.to
        self._draw(picture, before)

    def _draw(self, picture: Field, before: Point) -> None:
        if self.pen.on and before != (self.x, self.y):
            picture.line(_pixel(before), self.pixel, self.pen.width, self.pen.color)


def _pixel(place: Point) -> Point:
    return place[0] * UNIT_PIXELS, (SIZE - place[1]) * UNIT_PIXELS


def _normal(angle: float) -> float:
    """Return the same direction from -pi, included, to pi, excluded."""
    rest = math.remainder(angle, math.tau)
    return rest if rest < math.pi else rest - math.tau


def check_finite(**numbers: float) -> None:
    """Refuse what no place, angle or speed can be.

    Raises:
        UsageError: A number is infinite or none; the text has its name.
    """
    for name, value in numbers.items():
        if not math.isfinite(value):
            raise UsageError(f"{name} is '{value}': expected a finite number")
