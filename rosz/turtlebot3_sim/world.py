"""The robot and its arena, seen from above. Pure: no clock, no network.

The robot is a TurtleBot3 Burger: two driven wheels, a laser, a round body; measures are those of
the manufacturer's data sheet. The arena consists of straight walls and round pillars. Lengths are
in metres, angles in rad.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import msgspec

from rosz.errors import UsageError


class Wall(msgspec.Struct, frozen=True):
    """A straight wall between two points."""

    x1: float
    y1: float
    x2: float
    y2: float

    def distance(self, x: float, y: float) -> float:
        """Return the distance from a point to the wall."""
        along_x, along_y = self.x2 - self.x1, self.y2 - self.y1
        share = (x - self.x1) * along_x + (y - self.y1) * along_y
        share = min(max(share / (along_x * along_x + along_y * along_y), 0.0), 1.0)
        return math.hypot(x - self.x1 - share * along_x, y - self.y1 - share * along_y)

    def hit(self, x: float, y: float, cos: float, sin: float) -> float:
        """Return the length of a ray from a point to the wall; infinity if it misses it."""
        along_x, along_y = self.x2 - self.x1, self.y2 - self.y1
        across = along_x * sin - along_y * cos
        if across == 0:
            return math.inf
        to_x, to_y = x - self.x1, y - self.y1
        share = (to_x * sin - to_y * cos) / across
        length = (to_x * along_y - to_y * along_x) / across
        return length if 0 <= share <= 1 and length >= 0 else math.inf


class Pillar(msgspec.Struct, frozen=True):
    """A round pillar; x and y are those of its axis."""

    x: float
    y: float
    radius: float

    def distance(self, x: float, y: float) -> float:
        """Return the distance from a point to the surface; negative inside."""
        return math.hypot(x - self.x, y - self.y) - self.radius

    def hit(self, x: float, y: float, cos: float, sin: float) -> float:
        """Return the length of a ray from a point to the pillar; infinity if it misses it."""
        to_x, to_y = self.x - x, self.y - y
        ahead = to_x * cos + to_y * sin
        aside = to_x * sin - to_y * cos
        half = self.radius * self.radius - aside * aside
        if half < 0:
            return math.inf
        length = ahead - math.sqrt(half)
        return length if length >= 0 else math.inf


class Arena(msgspec.Struct, frozen=True):
    """A floor with obstacles."""

    obstacles: Sequence[Wall | Pillar] = ()

    def clearance(self, x: float, y: float) -> float:
        """Return the distance from a point to the nearest surface; infinity without obstacles."""
        return min((obstacle.distance(x, y) for obstacle in self.obstacles), default=math.inf)

    def ranges(self, x: float, y: float, angles: Iterable[float], limit: float) -> Iterator[float]:
        """Yield the lengths of rays to the nearest obstacles; infinity beyond the limit."""
        near = [obstacle for obstacle in self.obstacles if obstacle.distance(x, y) <= limit]
        for angle in angles:
            cos, sin = math.cos(angle), math.sin(angle)
            length = min((obstacle.hit(x, y, cos, sin) for obstacle in near), default=math.inf)
            yield length if length <= limit else math.inf


def _hexagon(radius: float) -> Iterator[Wall]:
    corners = [
        (radius * math.cos(math.pi / 3 * number), radius * math.sin(math.pi / 3 * number))
        for number in range(7)
    ]
    for (x1, y1), (x2, y2) in pairwise(corners):
        yield Wall(x1, y1, x2, y2)


EMPTY = Arena()
"""A floor without obstacles."""

PILLARS = Arena(
    (*_hexagon(3.0), *(Pillar(1.1 * x, 1.1 * y, 0.15) for x in (-1, 0, 1) for y in (-1, 0, 1)))
)
"""Nine pillars within six walls, similar to the world of TurtleBot3's manual."""

ARENAS = {"empty": EMPTY, "turtlebot3_world": PILLARS}


MAX_FORWARD = 0.22
"""Largest speed in m/s, forward or back."""
MAX_TURN = 2.84
"""Largest angular speed in rad/s."""
WHEEL_RADIUS = 0.033
TRACK = 0.16
"""Distance between the wheels."""
BODY_RADIUS = 0.105
LASER_X = -0.032
"""Position of the laser, which is behind the center."""
BEAMS = 360
RANGE_MIN = 0.12
"""Shortest distance that the laser measures."""
RANGE_MAX = 3.5
"""Longest distance that the laser measures."""


@dataclass
class Robot:
    """The robot.

    Attributes:
        theta: Heading, from -pi to pi.
        forward: Commanded speed in m/s.
        turn: Commanded angular speed in rad/s.
        speed: Actual speed in m/s; 0 where an obstacle stops the robot.
        wheel_left: Angle of the left wheel since the start.
        wheel_right: Angle of the right wheel since the start.
    """

    arena: Arena
    x: float = 0.0
    y: float = 0.0
    theta: float = 0.0
    forward: float = 0.0
    turn: float = 0.0
    speed: float = 0.0
    wheel_left: float = 0.0
    wheel_right: float = 0.0

    def command(self, forward: float, turn: float) -> None:
        """Set the speed in m/s and rad/s until the next command, within the limits of the robot.

        Raises:
            UsageError: An argument is not a number.
        """
        if math.isnan(forward) or math.isnan(turn):
            raise UsageError(f"speed is {forward} m/s and {turn} rad/s: expected numbers")
        self.forward = min(max(forward, -MAX_FORWARD), MAX_FORWARD)
        self.turn = min(max(turn, -MAX_TURN), MAX_TURN)

    def step(self, seconds: float) -> None:
        """Move along a circle or straight ahead, and stop at obstacles.

        The seconds must be few enough not to pass through a wall.
        """
        turned = self.turn * seconds
        length = self.forward * seconds
        half = turned / 2  # which is 0 for the smallest numbers, too
        # The chord of an arc has the direction of the middle of the arc.
        chord = length * (math.sin(half) / half if half else 1.0)
        middle = self.theta + half
        x, y = self.x + chord * math.cos(middle), self.y + chord * math.sin(middle)
        if self._is_free(x, y):
            self.x, self.y, self.speed = x, y, self.forward
        else:
            self.speed = 0.0
        self.theta = math.remainder(self.theta + turned, math.tau)
        # The wheels slip where an obstacle stops the body.
        self.wheel_left += (length - turned * TRACK / 2) / WHEEL_RADIUS
        self.wheel_right += (length + turned * TRACK / 2) / WHEEL_RADIUS

    def wheel_speeds(self) -> tuple[float, float]:
        """Return the speeds of the left and the right wheel in rad/s."""
        bias = self.turn * TRACK / 2
        return (self.forward - bias) / WHEEL_RADIUS, (self.forward + bias) / WHEEL_RADIUS

    def scan(self) -> Iterator[float]:
        """Yield the distances that the laser measures, counter-clockwise from straight ahead.

        Infinity stands for no obstacle in range, and for one that is too near.
        """
        x = self.x + LASER_X * math.cos(self.theta)
        y = self.y + LASER_X * math.sin(self.theta)
        angles = (self.theta + math.tau * number / BEAMS for number in range(BEAMS))
        for length in self.arena.ranges(x, y, angles, RANGE_MAX):
            yield length if length >= RANGE_MIN else math.inf

    def _is_free(self, x: float, y: float) -> bool:
        """Return whether the robot can move to a place; it can always move away from obstacles."""
        clearance = self.arena.clearance(x, y)
        return clearance >= BODY_RADIUS or clearance > self.arena.clearance(self.x, self.y)
