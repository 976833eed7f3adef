"""The program ``turtle_teleop_key``: drives a turtle with the arrow keys, as in ROS 1.

The letters around F rotate the turtle to a direction of the compass, as in ROS 2.
"""

from __future__ import annotations

import math
import os
import select
import signal
import socket
import sys
import termios
from collections.abc import Iterator
from contextlib import suppress
from typing import Self

from rosz.msgs.geometry_msgs.msg import Twist, Vector3
from rosz.msgs.turtlesim.msg import Pose
from rosz.node import Node, serve_loggers

_ARROWS = {"A": "up", "B": "down", "C": "right", "D": "left"}
_ESCAPE = "\x1b"
_POLL_SECONDS = 0.2
"""Longest time until a continued program reads single keys again."""


class KeyDecoder:
    """Decode terminal input into keys: characters, ``up``, ``down``, ``left`` and ``right``.

    Arrows are ``ESC [ A`` or ``ESC O A`` and so on, possibly in pieces (ECMA-48, 5.4).
    """

    def __init__(self) -> None:
        self._pending = ""

    def feed(self, data: bytes) -> Iterator[str]:
        """Yield the keys that are complete; only ASCII is decoded correctly."""
        for character in data.decode("latin-1"):
            if character == _ESCAPE:
                self._pending = character
            elif self._pending == _ESCAPE and character in "[O":
                self._pending += character
            elif len(self._pending) > 1:
                yield from self._sequence(character)
            else:
                self._pending = ""
                yield character

    def _sequence(self, character: str) -> Iterator[str]:
        if character.isdigit() or character == ";":
            return  # parameters of a sequence, such as Shift with an arrow
        self._pending = ""
        if character in _ARROWS:
            yield _ARROWS[character]


class Keyboard:
    """Standard input, key by key, until the end of the ``with`` block.

    A shell restores the terminal when it stops the program (Ctrl-Z), so the settings are made again
    when the program continues. That needs the main thread, because of the signal handler.

    Args:
        timeout: Seconds without a key after which an empty text stands for one; never when None.
    """

    def __init__(self, timeout: float | None = None) -> None:
        self._timeout = timeout
        self._fd = sys.stdin.fileno()
        self._settings: list[int | list[bytes | int]] | None = None
        self._wake, self._waker = socket.socketpair()

    def __enter__(self) -> Self:
        if os.isatty(self._fd):
            self._settings = termios.tcgetattr(self._fd)
            self._disable_line_mode()
            self._continued = signal.signal(signal.SIGCONT, lambda *_: self._disable_line_mode())
        return self

    def _disable_line_mode(self) -> None:
        settings = termios.tcgetattr(self._fd)
        settings[3] &= ~(termios.ICANON | termios.ECHO)
        termios.tcsetattr(self._fd, termios.TCSANOW, settings)

    def __exit__(self, *_: object) -> None:
        if self._settings is not None:
            signal.signal(signal.SIGCONT, self._continued)
            termios.tcsetattr(self._fd, termios.TCSADRAIN, self._settings)
        self._wake.close()
        self._waker.close()

    def stop(self) -> None:
        """Stop reading; any thread may call this."""
        with suppress(OSError):  # already closed
            self._waker.send(b"\0")

    def __iter__(self) -> Iterator[str]:
        """Yield keys until `stop` is called or the input ends."""
        decoder = KeyDecoder()
        while True:
            # The signal may reach another thread, and then does not interrupt the wait here.
            seconds = _POLL_SECONDS if self._timeout is None else self._timeout
            ready, _, _ = select.select([self._fd, self._wake], [], [], seconds)
            if self._wake in ready:
                return
            if not ready:
                if self._timeout is not None:
                    yield ""
                continue
            try:
                data = os.read(self._fd, 256)
            except OSError:  # the other side of the terminal is closed
                return
            if not data:
                return
            yield from decoder.feed(data)


_DIRECTIONS = {"up": (1, 0), "down": (-1, 0), "left": (0, 1), "right": (0, -1)}
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
    """Commands for a turtle from keys; the node publishes ``turtle1/cmd_vel``.

    The parameters ``~scale_linear`` and ``~scale_angular`` are the speeds.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._linear = node.params.get("~scale_linear", 2.0, type=float)
        self._angular = node.params.get("~scale_angular", 2.0, type=float)
        self._commands = node.publisher("turtle1/cmd_vel", Twist, queue_size=1)
        self._heading: float | None = None
        self._subscribed = False

    def press(self, key: str) -> bool:
        """Handle a character, or the name of an arrow; return False after ``q``, the end."""
        key = key.lower()
        if key in _DIRECTIONS:
            self._heading = None
            forward, turn = _DIRECTIONS[key]
            self._move(self._linear * forward, self._angular * turn)
        elif key in _HEADINGS:
            self._heading = _HEADINGS[key]
            if not self._subscribed:
                self._subscribed = True
                self._node.subscription("turtle1/pose", Pose, self._turn, queue_size=1)
        elif key in {"f", "q"} and self._heading is not None:
            self._heading = None
            self._move(0, 0)
        return key != "q"

    def _move(self, forward: float, turn: float) -> None:
        self._commands.publish(Twist(Vector3(x=forward), Vector3(z=turn)))

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
    """Read keys until ``q``, Ctrl-C or the end of the input."""
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
