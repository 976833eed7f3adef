"""The program ``draw_square``: a turtle draws a square, again and again."""

from __future__ import annotations

import math
from collections.abc import Iterator

import msgspec

from rosz.errors import RoszError
from rosz.msgs.geometry_msgs.msg import Twist, Vector3
from rosz.msgs.std_srvs.srv import Empty
from rosz.msgs.turtlesim.msg import Pose
from rosz.node import Node, TimerEvent
from rosz.node.standard import serve_loggers

__all__ = ("Move", "Square", "main")

_SIDE = 2.0
_SPEED = 1.0
_TURN_SPEED = 0.4
_NEAR = 0.1
_NEAR_ANGLE = 0.01
_PERIOD = 0.016
_RESET_SECONDS = 5.0


class Move(msgspec.Struct, frozen=True):
    """A speed to go at.

    Attributes:
        forward: Units per second.
        turn: rad/s.
    """

    forward: float = 0.0
    turn: float = 0.0


class Square:
    """Where to go next: a side, a stop, a quarter turn, a stop, and so on. No clock, no network.

    Attributes:
        goal: Place and heading that it is on its way to.
        news: What to log, oldest first.
    """

    def __init__(self) -> None:
        self.goal = (0.0, 0.0, 0.0)
        self.news: list[str] = []
        self._moves = self._plan()
        self._pose = Pose()

    def next(self, pose: Pose) -> Move:
        """Return how to move on.

        Args:
            pose: Where the turtle is.
        """
        self._pose = pose
        return next(self._moves)

    def _plan(self) -> Iterator[Move]:
        while True:
            at = self._pose
            cos, sin = math.cos(at.theta), math.sin(at.theta)
            self._head_for(at.x + _SIDE * cos, at.y + _SIDE * sin, at.theta)
            while self._ahead() >= _NEAR:
                yield Move(forward=_SPEED)
            yield from self._stop()
            at = self._pose
            self._head_for(at.x, at.y, math.remainder(at.theta + math.pi / 2, math.tau))
            while self._to_turn() >= _NEAR_ANGLE:
                yield Move(turn=_TURN_SPEED)
            yield from self._stop()

    def _stop(self) -> Iterator[Move]:
        yield Move()
        while self._pose.linear_velocity or self._pose.angular_velocity:
            yield Move()
        self.news.append("Reached goal")

    def _head_for(self, x: float, y: float, theta: float) -> None:
        self.goal = (x, y, theta)
        self.news.append(f"New goal [{x:f} {y:f}, {theta:f}]")

    def _ahead(self) -> float:
        """Return how far the goal is ahead; below 0 once it has been passed."""
        x, y, theta = self.goal
        return (x - self._pose.x) * math.cos(theta) + (y - self._pose.y) * math.sin(theta)

    def _to_turn(self) -> float:
        return math.remainder(self.goal[2] - self._pose.theta, math.tau)


def main() -> None:
    """Clear the field, and draw until told to end."""
    with Node("draw_square") as node:
        serve_loggers(node)
        square = Square()
        poses: list[Pose] = []
        commands = node.publisher("turtle1/cmd_vel", Twist, queue_size=1)
        reset = node.client("reset", Empty)
        try:
            reset.wait_for_service(_RESET_SECONDS)
            reset()
        except RoszError as error:
            node.log.warning("cannot reset the field: %s", error)

        def draw(_: TimerEvent) -> None:
            if poses:
                move = square.next(poses[-1])
                for text in square.news:
                    node.log.info("%s", text)
                square.news.clear()
                commands.publish(Twist(Vector3(x=move.forward), Vector3(z=move.turn)))

        def arrived(pose: Pose) -> None:
            poses[:] = [pose]

        node.subscription("turtle1/pose", Pose, arrived, queue_size=1)
        node.timer(_PERIOD, draw)
        node.spin()
