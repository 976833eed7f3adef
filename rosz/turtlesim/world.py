"""The turtles of a simulation and the field that they draw on. No clock, no network."""

from __future__ import annotations

import struct
from collections.abc import Iterator

import msgspec

from rosz.errors import NotFoundError, UsageError
from rosz.turtlesim.field import Color, Field, Point
from rosz.turtlesim.turtle import FIELD_PIXELS, SIZE, Turtle, check_finite

__all__ = ("BACKGROUND", "FIRST", "START", "Bump", "World")

BACKGROUND = (69, 86, 255)
"""Colour of a field unless told otherwise."""
FIRST = "turtle1"
"""Name of the turtle that is there from the start."""
(START,) = struct.unpack("f", struct.pack("f", SIZE / 2))
"""Where it is, x and y: the middle of the field, in the single precision of messages."""


class Bump(msgspec.Struct, frozen=True):
    """A turtle ran into a wall.

    Attributes:
        turtle: Its name.
        wish: Where it wanted to be.
    """

    turtle: str
    wish: Point


class World:
    """A field with turtles on it; empty at first.

    Args:
        background: Colour of the field.

    Attributes:
        field: What was drawn.
        turtles: By name, in the order in which they came.
    """

    def __init__(self, background: Color = BACKGROUND) -> None:
        self.field = Field(FIELD_PIXELS, FIELD_PIXELS, background)
        self.turtles: dict[str, Turtle] = {}
        self._named = 0
        self._hatched = 0

    def spawn(self, x: float, y: float, theta: float, name: str = "") -> str:
        """Put a turtle on the field.

        Args:
            x: Units from the left.
            y: Units from below.
            theta: Heading in rad.
            name: Its name; ``turtle1``, ``turtle2`` … when empty.

        Returns:
            The name.

        Raises:
            UsageError: The name is taken, or a number is infinite or none.
        """
        check_finite(x=x, y=y, theta=theta)
        name = name or self.free_name()
        if name in self.turtles:
            raise UsageError(f"a turtle named [{name}] already exists")
        self.turtles[name] = Turtle(x, y, theta, kind=self._hatched)
        self._hatched += 1
        return name

    def spawn_first(self) -> str:
        """Put the turtle on the field that is there from the start, in its middle."""
        return self.spawn(START, START, 0.0)

    def free_name(self) -> str:
        """Return the next name for a turtle without one."""
        while True:
            self._named += 1
            name = f"turtle{self._named}"
            if name not in self.turtles:
                return name

    def kill(self, name: str) -> None:
        """Take a turtle off the field; its lines stay.

        Raises:
            NotFoundError: There is none of that name.
        """
        if name not in self.turtles:
            raise NotFoundError(f"tried to kill turtle [{name}], which does not exist")
        del self.turtles[name]

    def clear(self, background: Color) -> None:
        """Wipe all lines away.

        Args:
            background: Colour of the field from now on.
        """
        self.field.fill(background)

    def reset(self, background: Color) -> str:
        """Start over with one turtle; returns its name."""
        self.turtles.clear()
        self._named = self._hatched = 0
        self.clear(background)
        return self.spawn_first()

    def step(self, now: float) -> Iterator[Bump]:
        """Move all turtles on by one step; yields who is stopped by a wall.

        Args:
            now: Time in seconds, as for `Turtle.command`.
        """
        for name, turtle in self.turtles.items():
            wish = turtle.step(self.field, now)
            if wish is not None:
                yield Bump(name, wish)
