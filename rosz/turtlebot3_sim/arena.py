"""What the robot may run into: straight walls and round pillars. No clock, no network."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import pairwise

import msgspec

__all__ = ("ARENAS", "EMPTY", "PILLARS", "Arena", "Pillar", "Wall")


class Wall(msgspec.Struct, frozen=True):
    """A straight wall between two points; metres.

    Attributes:
        x1: One end.
        y1: One end.
        x2: The other end.
        y2: The other end.
    """

    x1: float
    y1: float
    x2: float
    y2: float

    def distance(self, x: float, y: float) -> float:
        """Return how far a point is from it."""
        along_x, along_y = self.x2 - self.x1, self.y2 - self.y1
        share = (x - self.x1) * along_x + (y - self.y1) * along_y
        share = min(max(share / (along_x * along_x + along_y * along_y), 0.0), 1.0)
        return math.hypot(x - self.x1 - share * along_x, y - self.y1 - share * along_y)

    def hit(self, x: float, y: float, cos: float, sin: float) -> float:
        """Return how far a ray from a point goes until it meets the wall; infinity if never."""
        along_x, along_y = self.x2 - self.x1, self.y2 - self.y1
        across = along_x * sin - along_y * cos
        if across == 0:
            return math.inf
        to_x, to_y = x - self.x1, y - self.y1
        share = (to_x * sin - to_y * cos) / across
        length = (to_x * along_y - to_y * along_x) / across
        return length if 0 <= share <= 1 and length >= 0 else math.inf


class Pillar(msgspec.Struct, frozen=True):
    """A round pillar; metres.

    Attributes:
        x: Of its axis.
        y: Of its axis.
        radius: Of its surface.
    """

    x: float
    y: float
    radius: float

    def distance(self, x: float, y: float) -> float:
        """Return how far a point is from its surface; below 0 inside."""
        return math.hypot(x - self.x, y - self.y) - self.radius

    def hit(self, x: float, y: float, cos: float, sin: float) -> float:
        """Return how far a ray from a point goes until it meets the pillar; infinity if never."""
        to_x, to_y = self.x - x, self.y - y
        ahead = to_x * cos + to_y * sin
        aside = to_x * sin - to_y * cos
        half = self.radius * self.radius - aside * aside
        if half < 0:
            return math.inf
        length = ahead - math.sqrt(half)
        return length if length >= 0 else math.inf


class Arena:
    """A place with obstacles.

    Args:
        obstacles: Its walls and pillars.
    """

    def __init__(self, obstacles: Iterable[Wall | Pillar] = ()) -> None:
        self.obstacles = tuple(obstacles)

    def clearance(self, x: float, y: float) -> float:
        """Return the distance from a point to the nearest surface; infinity where there is none."""
        return min((one.distance(x, y) for one in self.obstacles), default=math.inf)

    def ranges(self, x: float, y: float, angles: Iterable[float], limit: float) -> Iterator[float]:
        """Yield how far rays go; infinity for those that meet nothing.

        Args:
            x: Where they start.
            y: Where they start.
            angles: Their directions, in rad.
            limit: How far anything can be seen, in metres.
        """
        near = [one for one in self.obstacles if one.distance(x, y) <= limit]
        for angle in angles:
            cos, sin = math.cos(angle), math.sin(angle)
            length = min((one.hit(x, y, cos, sin) for one in near), default=math.inf)
            yield length if length <= limit else math.inf


def _hexagon(radius: float) -> Iterator[Wall]:
    corners = [
        (radius * math.cos(math.pi / 3 * number), radius * math.sin(math.pi / 3 * number))
        for number in range(7)
    ]
    for (x1, y1), (x2, y2) in pairwise(corners):
        yield Wall(x1, y1, x2, y2)


EMPTY = Arena()
"""A floor without end."""

PILLARS = Arena(
    (*_hexagon(3.0), *(Pillar(1.1 * x, 1.1 * y, 0.15) for x in (-1, 0, 1) for y in (-1, 0, 1)))
)
"""Nine pillars within six walls, much as in the world that TurtleBot3's manual drives through."""

ARENAS = {"empty": EMPTY, "turtlebot3_world": PILLARS}
