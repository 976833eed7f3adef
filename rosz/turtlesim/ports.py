"""What one turtle has on the network: topics and services below its name."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from rosz.errors import ServiceError, UsageError
from rosz.msgs.geometry_msgs.msg import Twist
from rosz.msgs.turtlesim.msg import Color, Pose
from rosz.msgs.turtlesim.srv import (
    SetPen,
    SetPenRequest,
    TeleportAbsolute,
    TeleportAbsoluteRequest,
    TeleportRelative,
    TeleportRelativeRequest,
)
from rosz.turtlesim.turtle import Pen, Turtle

if TYPE_CHECKING:
    from rosz.node import Node

__all__ = ("Ports",)

Work = Callable[[Turtle], None]


class Ports:
    """The topics and services of a turtle.

    Args:
        node: Whose they are.
        name: Of the turtle.
        change: Does something to the turtle of a name, while nobody else does.
    """

    def __init__(self, node: Node, name: str, change: Callable[[str, Work], None]) -> None:
        self._node = node
        self._name = name
        self._change = change
        self._pose = node.publisher(f"{name}/pose", Pose, queue_size=1)
        self._color = node.publisher(f"{name}/color_sensor", Color, queue_size=1)
        self._parts = (
            self._pose,
            self._color,
            node.subscription(f"{name}/cmd_vel", Twist, self._command, queue_size=1),
            node.service(f"{name}/set_pen", SetPen, self._set_pen),
            node.service(f"{name}/teleport_absolute", TeleportAbsolute, self._teleport_to),
            node.service(f"{name}/teleport_relative", TeleportRelative, self._teleport_by),
        )

    def publish(self, turtle: Turtle) -> None:
        """Tell where the turtle is and what colour it stands on."""
        self._pose.publish(Pose(turtle.x, turtle.y, turtle.theta, turtle.speed, turtle.turn))
        self._color.publish(Color(*turtle.sees))

    def close(self) -> None:
        """Take all of them back."""
        for part in reversed(self._parts):
            part.close()

    def _command(self, twist: Twist) -> None:
        now = time.monotonic()
        try:
            self._change(
                self._name,
                lambda turtle: turtle.command(
                    now, forward=twist.linear.x, left=twist.linear.y, turn=twist.angular.z
                ),
            )
        except UsageError as error:
            self._node.log.warning("ignoring a command for [%s]: %s", self._name, error, throttle=1)

    def _set_pen(self, request: SetPenRequest) -> None:
        def work(turtle: Turtle) -> None:
            if request.off:  # the colour stays for when it draws again
                turtle.pen = Pen(turtle.pen.color, turtle.pen.width, on=False)
            else:
                turtle.pen = Pen((request.r, request.g, request.b), request.width or 1)

        self._change(self._name, work)

    def _teleport_to(self, request: TeleportAbsoluteRequest) -> None:
        x, y, theta = request.x, request.y, request.theta
        self._move(lambda turtle: turtle.teleport_to(x, y, theta))

    def _teleport_by(self, request: TeleportRelativeRequest) -> None:
        length, theta = request.linear, request.angular
        self._move(lambda turtle: turtle.teleport_by(length, theta))

    def _move(self, work: Work) -> None:
        try:
            self._change(self._name, work)
        except UsageError as error:
            raise ServiceError(str(error)) from error
