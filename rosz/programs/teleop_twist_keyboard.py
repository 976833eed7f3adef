"""teleop_twist_keyboard: drive a robot with the keys around K (ROS wiki, teleop_twist_keyboard)."""

from __future__ import annotations

import sys
import threading
from typing import Any

from rosz.errors import ClosedError, WaitTimeout
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import Twist, TwistStamped, Vector3
from rosz.msgs.std_msgs.msg import Header
from rosz.node import Node, serve_loggers
from rosz.turtlesim.teleop import Keyboard

_WAIT_SECONDS = 2.0
_HELP_INTERVAL = 15
_HELP = """
Reading from the keyboard and publishing Twist.
---------------------------
Moving around:         Strafing, with Shift:
   u    i    o            U    I    O
   j    k    l            J    K    L
   m    ,    .            M    <    >

t : up (+z), b : down (-z), anything else : stop

q/z : change both speeds by 10 %
w/x : change the linear speed alone
e/c : change the angular speed alone

Ctrl-C ends it.
"""
_MOVES = {
    "i": (1, 0, 0, 0),
    "o": (1, 0, 0, -1),
    "j": (0, 0, 0, 1),
    "l": (0, 0, 0, -1),
    "u": (1, 0, 0, 1),
    ",": (-1, 0, 0, 0),
    ".": (-1, 0, 0, 1),
    "m": (-1, 0, 0, -1),
    "O": (1, -1, 0, 0),
    "I": (1, 0, 0, 0),
    "J": (0, 1, 0, 0),
    "L": (0, -1, 0, 0),
    "U": (1, 1, 0, 0),
    "<": (-1, 0, 0, 0),
    ">": (-1, -1, 0, 0),
    "M": (-1, 1, 0, 0),
    "t": (0, 0, 1, 0),
    "b": (0, 0, -1, 0),
}
"""Directions by key: forward, left, up and turn."""

_SPEEDS = {
    "q": (1.1, 1.1),
    "z": (0.9, 0.9),
    "w": (1.1, 1.0),
    "x": (0.9, 1.0),
    "e": (1.0, 1.1),
    "c": (1.0, 0.9),
}
"""Factors of the linear and the angular speed by key."""

_STILL = (0, 0, 0, 0)


class KeyboardDriver:
    """Commands from keys, on ``cmd_vel``.

    Its private parameters are those of ROS 1: ``speed``, ``turn``, their limits ``speed_limit`` and
    ``turn_limit``, ``repeat_rate``, and ``stamped`` with ``frame_id``.
    """

    def __init__(self, node: Node) -> None:
        get = node.params.get
        self._node = node
        self.speed = get("~speed", 0.5, type=float)
        self.turn = get("~turn", 1.0, type=float)
        self._limits = (
            get("~speed_limit", 1000.0, type=float),
            get("~turn_limit", 1000.0, type=float),
        )
        self._frame = get("~frame_id", "", type=str)
        kind: type[Any] = TwistStamped if get("~stamped", False, type=bool) else Twist
        self._stamped = kind is TwistStamped
        self._lock = threading.Lock()
        self._direction = _STILL
        self._shown = 0
        self._commands = node.publisher("cmd_vel", kind, queue_size=1)
        rate = get("~repeat_rate", 0.0, type=float)
        if rate > 0:
            node.timer(1 / rate, lambda _: self._publish())

    def wait(self) -> None:
        """Wait until somebody subscribes to the commands, or until the node ends (ClosedError)."""
        while True:
            try:
                self._commands.wait_for_subscribers(timeout=_WAIT_SECONDS)
            except WaitTimeout:
                _say(f"Waiting for subscriber to connect to {self._commands.name}")
            else:
                return

    def press(self, key: str) -> None:
        """Handle a key, or that none came in time if it is empty."""
        if key in _SPEEDS:
            self._change(*_SPEEDS[key])
        elif key in _MOVES:
            self._direction = _MOVES[key]
        elif not key and self._direction == _STILL:
            return
        else:
            self._direction = _STILL
        self._publish()

    def stop(self) -> None:
        """Send the command to stand still."""
        self._direction = _STILL
        self._publish()

    def show(self) -> None:
        """Print the speeds."""
        _say(f"currently:\tspeed {self.speed}\tturn {self.turn} ")

    def _change(self, linear: float, angular: float) -> None:
        self.speed = min(self._limits[0], self.speed * linear)
        self.turn = min(self._limits[1], self.turn * angular)
        if self.speed == self._limits[0]:
            _say("Linear speed limit reached!")
        if self.turn == self._limits[1]:
            _say("Angular speed limit reached!")
        self.show()
        self._shown += 1
        if self._shown % _HELP_INTERVAL == 0:
            _say(_HELP)

    def _publish(self) -> None:
        with self._lock:
            forward, left, up, turn = self._direction
            linear = Vector3(forward * self.speed, left * self.speed, up * self.speed)
            twist = Twist(linear, Vector3(0.0, 0.0, turn * self.turn))
            if not self._stamped:
                self._commands.publish(twist)
                return
            now = Time.from_nsec(self._node.now())
            self._commands.publish(Header(stamp=now, frame_id=self._frame), twist)


def _say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def main() -> None:
    """Read keys until Ctrl-C or the end of the input."""
    with Node("teleop_twist_keyboard") as node:
        serve_loggers(node)
        driver = KeyboardDriver(node)
        node.context.cooperative = True
        try:
            driver.wait()
        except ClosedError:
            return
        with Keyboard(node.params.get("~key_timeout", 0.5, type=float)) as keyboard:
            node.on_shutdown(lambda _: driver.stop())
            node.on_shutdown(lambda _: keyboard.stop())
            _say(_HELP)
            driver.show()
            for key in keyboard:
                driver.press(key)
        if not node.is_shutdown:
            driver.stop()
            node.log.warning("no more keys to read: run it in a terminal of its own")
