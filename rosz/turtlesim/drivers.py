"""The programs ``draw_square`` and ``mimic``, which drive turtles."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rosz.errors import RoszError
from rosz.msgs.geometry_msgs.msg import Twist, Vector3
from rosz.msgs.std_srvs.srv import Empty
from rosz.msgs.turtlesim.msg import Pose
from rosz.node import Node, TimerEvent, serve_loggers

_SIDE = 2.0
_SPEED = 1.0
_TURN_SPEED = 0.4
_NEAR = 0.1
_NEAR_ANGLE = 0.01
_PERIOD = 0.016
_RESET_SECONDS = 5.0


def _move(forward: float = 0.0, turn: float = 0.0) -> Twist:
    return Twist(Vector3(x=forward), Vector3(z=turn))


class Square:
    """The moves of a square: a side, a stop, a quarter turn, a stop, and so on.

    Attributes:
        goal: Place and heading of the current goal.
        messages: Messages to log, oldest first.
    """

    def __init__(self) -> None:
        self.goal: tuple[float, float, float] = (0.0, 0.0, 0.0)
        self.messages: list[str] = []
        self._moves = self._plan()
        self._pose = Pose()

    def next(self, pose: Pose) -> Twist:
        """Return the next speed at a pose of the turtle."""
        self._pose = pose
        return next(self._moves)

    def _plan(self) -> Iterator[Twist]:
        while True:
            at = self._pose
            cos, sin = math.cos(at.theta), math.sin(at.theta)
            self._set_goal(at.x + _SIDE * cos, at.y + _SIDE * sin, at.theta)
            while self._distance_left() >= _NEAR:
                yield _move(forward=_SPEED)
            yield from self._stop()
            at = self._pose
            self._set_goal(at.x, at.y, math.remainder(at.theta + math.pi / 2, math.tau))
            while math.remainder(self.goal[2] - self._pose.theta, math.tau) >= _NEAR_ANGLE:
                yield _move(turn=_TURN_SPEED)
            yield from self._stop()

    def _stop(self) -> Iterator[Twist]:
        yield _move()
        while self._pose.linear_velocity or self._pose.angular_velocity:
            yield _move()
        self.messages.append("Reached goal")

    def _set_goal(self, x: float, y: float, theta: float) -> None:
        self.goal = (x, y, theta)
        self.messages.append(f"New goal [{x:f} {y:f}, {theta:f}]")

    def _distance_left(self) -> float:
        """Return the distance to the goal; negative once the turtle has passed it."""
        x, y, theta = self.goal
        return (x - self._pose.x) * math.cos(theta) + (y - self._pose.y) * math.sin(theta)


def draw_square() -> None:
    """Reset the field, and draw squares until the node is shut down."""
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
                for text in square.messages:
                    node.log.info("%s", text)
                square.messages.clear()
                commands.publish(move)

        def receive(pose: Pose) -> None:
            poses[:] = [pose]

        node.subscription("turtle1/pose", Pose, receive, queue_size=1)
        node.timer(_PERIOD, draw)
        node.spin()


def mimic() -> None:
    """Make a turtle move like another one until the node is shut down.

    The topics are ``input/pose`` and ``output/cmd_vel``; remapping ``input`` or ``output`` remaps
    all topics below it, as with roscpp.
    """
    with Node("turtle_mimic") as node:
        serve_loggers(node)
        output = f"{node.resolve('output')}/cmd_vel"
        commands = node.publisher(output, Twist, queue_size=1)

        def follow(pose: Pose) -> None:
            commands.publish(_move(pose.linear_velocity, pose.angular_velocity))

        node.subscription(f"{node.resolve('input')}/pose", Pose, follow, queue_size=1)
        node.spin()
