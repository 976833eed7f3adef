"""turtlebot3_teleop_key: drive a TurtleBot3 with the keys around S (ROBOTIS e-Manual, TurtleBot3).

Each key changes the wanted speed by a step; the speed that is sent approaches it by half steps.
"""

from __future__ import annotations

import sys
import threading

from rosz.msgs.geometry_msgs.msg import Twist, Vector3
from rosz.node import Node, serve_loggers
from rosz.turtlesim.teleop import Keyboard

_LINEAR, _ANGULAR = 0, 1
_STEPS = (0.01, 0.1)
_BURGER = (0.22, 2.84)
_LIMITS = {"waffle": (0.26, 1.82), "waffle_pi": (0.26, 1.82)}
"""Limits by model; others have those of the burger."""
_KEYS = {"w": (_LINEAR, 1), "x": (_LINEAR, -1), "a": (_ANGULAR, 1), "d": (_ANGULAR, -1)}
_STOPS = frozenset("s ")
_KEY_SECONDS = 0.1
_HELP_INTERVAL = 20
_HELP = """
Control Your TurtleBot3!
---------------------------
Moving around:
        w
   a    s    d
        x

w/x : change the linear velocity (burger: up to 0.22 m/s, waffle and waffle_pi: 0.26)
a/d : change the angular velocity (burger: up to 2.84 rad/s, waffle and waffle_pi: 1.82)
space key, s : stop

Ctrl-C ends it.
"""


class Turtlebot3Driver:
    """Commands from keys, on ``cmd_vel``.

    The parameter ``model`` (``burger``, ``waffle`` or ``waffle_pi``) gives the limits.

    Attributes:
        wanted: Linear velocity in metres per second, and angular velocity in radians per second.
    """

    def __init__(self, node: Node) -> None:
        model = node.params.get("model", "burger", type=str)
        self._limits = _LIMITS.get(model, _BURGER)
        self._sent = [0.0, 0.0]
        self.wanted = [0.0, 0.0]
        self._shown = 0
        self._lock = threading.Lock()
        self._stopped = False
        self._commands = node.publisher("cmd_vel", Twist, queue_size=10)

    def press(self, key: str) -> None:
        """Handle a key, or that none came in time if it is empty; send a command."""
        if key in _KEYS:
            axis, sign = _KEYS[key]
            limit = self._limits[axis]
            changed = round(self.wanted[axis] + sign * _STEPS[axis], 6)
            self.wanted[axis] = max(-limit, min(limit, changed))
            self._show()
        elif key in _STOPS:
            self.wanted, self._sent = [0.0, 0.0], [0.0, 0.0]
            self._show()
        with self._lock:
            if self._stopped:
                return
            for axis, wanted in enumerate(self.wanted):
                most = _STEPS[axis] / 2
                self._sent[axis] += max(-most, min(most, wanted - self._sent[axis]))
            self._publish()

    def stop(self) -> None:
        """Send the command to stand still, which is the last one."""
        with self._lock:
            self._stopped, self._sent = True, [0.0, 0.0]
            self._publish()

    def _publish(self) -> None:
        linear, angular = self._sent
        self._commands.publish(Twist(Vector3(linear, 0.0, 0.0), Vector3(0.0, 0.0, angular)))

    def _show(self) -> None:
        linear, angular = self.wanted
        _say(f"currently:\tlinear vel {linear:g}\t angular vel {angular:g} ")
        self._shown += 1
        if self._shown % _HELP_INTERVAL == 0:
            _say(_HELP)


def _say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def main() -> None:
    """Read keys until Ctrl-C or the end of the input."""
    with Node("turtlebot3_teleop") as node:
        serve_loggers(node)
        node.context.cooperative = True
        driver = Turtlebot3Driver(node)
        with Keyboard(_KEY_SECONDS) as keyboard:
            node.on_shutdown(lambda _: driver.stop())
            node.on_shutdown(lambda _: keyboard.stop())
            _say(_HELP)
            for key in keyboard:
                driver.press(key)
        if not node.is_shutdown:
            driver.stop()
            node.log.warning("no more keys to read: run it in a terminal of its own")
