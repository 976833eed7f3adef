"""The program ``turtle_teleop_key``: drives a turtle by the arrow keys, as ROS 1's does.

The letters around F turn it to a direction of the compass, as ROS 2's does.
"""

from __future__ import annotations

import math
import sys

from rosz.msgs.geometry_msgs.msg import Twist, Vector3
from rosz.msgs.turtlesim.msg import Pose
from rosz.node import Node
from rosz.node.standard import serve_loggers
from rosz.turtlesim.keyboard import Keyboard

__all__ = ("Teleop", "main")

_ARROWS = {"up": (1, 0), "down": (-1, 0), "left": (0, 1), "right": (0, -1)}
_HEADINGS = {
    key: math.pi / 4 * number
    for key, number in {"g": 0, "t": 1, "r": 2, "e": 3, "d": 4, "c": -3, "v": -2, "b": -1}.items()
}
_TURN_SPEED = 1.0
_TURN_GAIN = 4.0
_CLOSE_ENOUGH = 0.005
_HELP = """\
Reading from keyboard
---------------------------
Use arrow keys to move the turtle. 'q' to quit.
G, B, V, C, D, E, R and T turn it the way they lie around F, and F stops the turn.
"""


class Teleop:
    """What keys make a turtle do.

    Args:
        node: Publishes ``turtle1/cmd_vel``; its parameters ``~scale_linear`` and
            ``~scale_angular`` are the speeds.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._linear = node.params.get("~scale_linear", 2.0, type=float)
        self._angular = node.params.get("~scale_angular", 2.0, type=float)
        self._commands = node.publisher("turtle1/cmd_vel", Twist, queue_size=1)
        self._heading: float | None = None
        self._watching = False

    def press(self, key: str) -> bool:
        """Do what a key stands for.

        Args:
            key: A character, or an arrow by its name.

        Returns:
            Whether to go on: not after ``q``.
        """
        key = key.lower()
        if key in _ARROWS:
            self._heading = None
            forward, turn = _ARROWS[key]
            self._move(self._linear * forward, self._angular * turn)
        elif key in _HEADINGS:
            self._heading = _HEADINGS[key]
            self._watch()
        elif key in {"f", "q"} and self._heading is not None:
            self._heading = None
            self._move(0, 0)
        return key != "q"

    def _move(self, forward: float, turn: float) -> None:
        self._commands.publish(Twist(Vector3(x=forward), Vector3(z=turn)))

    def _watch(self) -> None:
        """Follow where the turtle is, from the first turn on."""
        if not self._watching:
            self._watching = True
            self._node.subscription("turtle1/pose", Pose, self._turn, queue_size=1)

    def _turn(self, pose: Pose) -> None:
        heading = self._heading
        if heading is None:
            return
        left = math.remainder(heading - pose.theta, math.tau)
        if abs(left) < _CLOSE_ENOUGH:
            self._heading = None
            self._move(0, 0)
        else:
            self._move(0, max(-_TURN_SPEED, min(_TURN_SPEED, _TURN_GAIN * left)))


def main() -> None:
    """Read keys until ``q``, Ctrl-C, or the end of what there is to read."""
    with Node("teleop_turtle") as node:
        serve_loggers(node)
        teleop = Teleop(node)
        node.context.cooperative = True
        with Keyboard() as keyboard:
            node.on_shutdown(lambda _: keyboard.stop())
            sys.stdout.write(_HELP)
            sys.stdout.flush()
            for key in keyboard:
                if not teleop.press(key):
                    return
        if not node.is_shutdown:
            node.log.warning("no more keys to read: run it in a terminal of its own")
