"""A TurtleBot3 Burger as seen from above: two driven wheels, a laser, a round body.

Measures are those of the manufacturer's data sheet. No clock, no network.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from rosz.errors import UsageError
from rosz.turtlebot3_sim.arena import Arena

__all__ = (
    "BEAMS",
    "MAX_FORWARD",
    "MAX_TURN",
    "RANGE_MAX",
    "RANGE_MIN",
    "TRACK",
    "WHEEL_RADIUS",
    "Robot",
)

MAX_FORWARD = 0.22
"""m/s, ahead or back."""
MAX_TURN = 2.84
"""rad/s, to either side."""
WHEEL_RADIUS = 0.033
"""m."""
TRACK = 0.16
"""m from wheel to wheel."""
BODY_RADIUS = 0.105
"""m."""
LASER_X = -0.032
"""m; the laser sits behind the middle."""
BEAMS = 360
RANGE_MIN = 0.12
"""m; what is nearer is not seen."""
RANGE_MAX = 3.5
"""m."""


@dataclass
class Robot:
    """The robot.

    Attributes:
        arena: What is around it.
        x: Metres.
        y: Metres.
        theta: Heading in rad, from -pi to pi.
        forward: Speed in m/s that it is told to go at.
        turn: rad/s that it is told to turn at.
        speed: m/s that it does go at; less where something is in the way.
        wheel_left: rad that the wheel has turned since the start.
        wheel_right: The same of the other wheel.
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
        """Take a speed to keep until the next; what is too fast for the robot is cut.

        Args:
            forward: m/s.
            turn: rad/s.

        Raises:
            UsageError: A number is none.
        """
        if math.isnan(forward) or math.isnan(turn):
            raise UsageError(f"speed is {forward} m/s and {turn} rad/s: expected numbers")
        self.forward = min(max(forward, -MAX_FORWARD), MAX_FORWARD)
        self.turn = min(max(turn, -MAX_TURN), MAX_TURN)

    def step(self, seconds: float) -> None:
        """Move on along a circle, or straight ahead, and stop where something is in the way.

        Args:
            seconds: How long; short enough not to go through a wall.
        """
        turned = self.turn * seconds
        length = self.forward * seconds
        # The way along an arc is straight from end to end, in the direction of its middle.
        chord = length * (math.sin(turned / 2) / (turned / 2) if turned else 1.0)
        middle = self.theta + turned / 2
        x, y = self.x + chord * math.cos(middle), self.y + chord * math.sin(middle)
        if self._is_free(x, y):
            self.x, self.y, self.speed = x, y, self.forward
        else:
            self.speed = 0.0
        self.theta = math.remainder(self.theta + turned, math.tau)
        # Wheels slip where the body is held.
        self.wheel_left += (length - turned * TRACK / 2) / WHEEL_RADIUS
        self.wheel_right += (length + turned * TRACK / 2) / WHEEL_RADIUS

    def wheel_speeds(self) -> tuple[float, float]:
        """Return how fast the wheels turn, left and right, in rad/s."""
        bias = self.turn * TRACK / 2
        return (self.forward - bias) / WHEEL_RADIUS, (self.forward + bias) / WHEEL_RADIUS

    def scan(self) -> Iterator[float]:
        """Yield what the laser measures, in metres, counter-clockwise from straight ahead.

        Infinity stands for nothing in reach, and for what is too near.
        """
        x = self.x + LASER_X * math.cos(self.theta)
        y = self.y + LASER_X * math.sin(self.theta)
        angles = (self.theta + math.tau * number / BEAMS for number in range(BEAMS))
        for length in self.arena.ranges(x, y, angles, RANGE_MAX):
            yield length if length >= RANGE_MIN else math.inf

    def _is_free(self, x: float, y: float) -> bool:
        """Tell whether it may go to a place; away from what it touches it always may."""
        clearance = self.arena.clearance(x, y)
        return clearance >= BODY_RADIUS or clearance > self.arena.clearance(self.x, self.y)
