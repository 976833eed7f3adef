from __future__ import annotations

import math
import os
import pty
import signal
import subprocess
import sys
import termios
from collections.abc import Iterator
from queue import SimpleQueue

import pytest
from hypothesis import given
from hypothesis import strategies as st
from network import TIMEOUT, Network

from rosz.msgs.geometry_msgs.msg import Twist
from rosz.msgs.turtlesim.msg import Pose
from rosz.turtlesim.teleop import KeyDecoder

LAUNCH = """
<launch><node pkg="turtlesim" name="keys" type="turtle_teleop_key" output="screen"/></launch>
"""
READY = "'q' to quit."


@pytest.mark.parametrize(
    ("data", "keys"),
    [
        (b"\x1b[A\x1b[B\x1b[C\x1b[D", ["up", "down", "right", "left"]),
        (b"\x1bOA", ["up"]),
        (b"\x1b[1;2A", ["up"]),
        (b"\x1b[5~q", ["q"]),
        (b"\x1bq", ["q"]),
        (b"\x1b\x1b[A", ["up"]),
        (b"A[", ["A", "["]),
        (b"\xc3\xa4q", ["\xc3", "\xa4", "q"]),
    ],
)
def test_keys(data: bytes, keys: list[str]) -> None:
    assert list(KeyDecoder().feed(data)) == keys


@given(st.binary(), st.lists(st.integers(0, 20)))
def test_keys_do_not_depend_on_the_pieces(data: bytes, cuts: list[int]) -> None:
    pieces = KeyDecoder()
    found: list[str] = []
    rest = data
    for cut in cuts:
        found += pieces.feed(rest[:cut])
        rest = rest[cut:]
    assert found + list(pieces.feed(rest)) == list(KeyDecoder().feed(data))


class Terminal:
    """A program in a terminal, and the person who uses it."""

    def __init__(self, network: Network, *words: str) -> None:
        self.keyboard, theirs = pty.openpty()
        self._side = theirs
        self._text = ""
        self.process = subprocess.Popen(
            [sys.executable, "-m", "rosz", *words],
            env=network.variables(),
            stdin=theirs,
            stdout=theirs,
            stderr=theirs,
            start_new_session=True,
        )

    def press(self, keys: str) -> None:
        """Press keys."""
        os.write(self.keyboard, keys.encode())

    def expect(self, text: str) -> None:
        """Read the screen until a text is on it."""
        while text not in self._text:
            self._text += os.read(self.keyboard, 4096).decode(errors="replace")

    @property
    def settings(self) -> list[int | list[bytes | int]]:
        """The settings of the terminal, as a shell takes and gives them."""
        return termios.tcgetattr(self._side)

    @settings.setter
    def settings(self, settings: list[int | list[bytes | int]]) -> None:
        termios.tcsetattr(self._side, termios.TCSANOW, settings)

    @property
    def cooked(self) -> bool:
        """Whether the terminal takes whole lines and shows what is typed."""
        flags: int = termios.tcgetattr(self._side)[3]
        return bool(flags & termios.ICANON) and bool(flags & termios.ECHO)

    def close(self) -> None:
        """Close everything, including the processes of a launch."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        self.process.wait(TIMEOUT)
        os.close(self.keyboard)
        os.close(self._side)


@pytest.fixture
def terminals() -> Iterator[list[Terminal]]:
    """A function that opens terminals, which are closed after the test."""
    made: list[Terminal] = []
    yield made
    for terminal in made:
        terminal.close()


@pytest.fixture
def commands(network: Network) -> SimpleQueue[Twist]:
    """The commands for a turtle."""
    queue: SimpleQueue[Twist] = SimpleQueue()
    network.node("turtle").subscription("turtle1/cmd_vel", Twist, queue.put)
    return queue


def speeds(commands: SimpleQueue[Twist]) -> tuple[float, float]:
    """Return the forward and the angular speed of the next command."""
    twist = commands.get(timeout=TIMEOUT)
    return twist.linear.x, twist.angular.z


def test_arrows_drive_and_q_quits(
    network: Network, commands: SimpleQueue[Twist], terminals: list[Terminal]
) -> None:
    terminal = Terminal(network, "run", "turtlesim", "turtle_teleop_key", "_scale_angular:=0.5")
    terminals.append(terminal)
    terminal.expect(READY)
    assert not terminal.cooked
    for key, told in {"A": (2.0, 0.0), "B": (-2.0, 0.0), "C": (0.0, -0.5), "D": (0.0, 0.5)}.items():
        terminal.press(f"\x1b[{key}")
        assert speeds(commands) == told
    terminal.press("xyz q")
    assert terminal.process.wait(TIMEOUT) == 0
    assert commands.empty()
    assert terminal.cooked


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_end_it_and_the_terminal_is_as_before(
    network: Network, terminals: list[Terminal], number: signal.Signals
) -> None:
    terminal = Terminal(network, "run", "turtlesim", "turtle_teleop_key")
    terminals.append(terminal)
    terminal.expect(READY)
    assert not terminal.cooked
    terminal.process.send_signal(number)
    assert terminal.process.wait(TIMEOUT) == 0
    assert terminal.cooked


def test_stopped_and_continued_it_reads_keys_again(
    network: Network, commands: SimpleQueue[Twist], terminals: list[Terminal]
) -> None:
    terminal = Terminal(network, "run", "turtlesim", "turtle_teleop_key")
    terminals.append(terminal)
    before = terminal.settings
    terminal.expect(READY)
    terminal.process.send_signal(signal.SIGSTOP)
    os.waitpid(terminal.process.pid, os.WUNTRACED)
    terminal.settings = before
    terminal.process.send_signal(signal.SIGCONT)
    while terminal.cooked:
        assert terminal.process.poll() is None
    terminal.press("\x1b[A")
    assert speeds(commands) == (2.0, 0.0)


def test_letters_turn_to_a_heading(
    network: Network, commands: SimpleQueue[Twist], terminals: list[Terminal]
) -> None:
    terminal = Terminal(network, "run", "turtlesim", "turtle_teleop_key")
    terminals.append(terminal)
    terminal.expect(READY)
    pose = network.node("sim").publisher("turtle1/pose", Pose, queue_size=1)
    terminal.press("t")
    pose.wait_for_subscribers()
    pose.publish(Pose(5.0, 5.0, -math.pi / 2))
    assert speeds(commands) == (0.0, 1.0)
    pose.publish(Pose(5.0, 5.0, math.pi / 4 + 0.1))
    assert speeds(commands) == pytest.approx((0.0, -0.4))
    pose.publish(Pose(5.0, 5.0, math.pi / 4))
    assert speeds(commands) == (0.0, 0.0)
    pose.publish(Pose(5.0, 5.0, 1.0))
    terminal.press("\x1b[A")
    assert speeds(commands) == (2.0, 0.0)
    terminal.press("dF")
    assert speeds(commands) == (0.0, 0.0)


def test_it_reads_the_terminal_of_a_launch(
    network: Network, commands: SimpleQueue[Twist], terminals: list[Terminal]
) -> None:
    file = network.folder / "keys.launch"
    file.write_text(LAUNCH)
    terminal = Terminal(network, "launch", str(file))
    terminals.append(terminal)
    terminal.expect(READY)
    terminal.press("\x1b[A")
    assert speeds(commands) == (2.0, 0.0)
    terminal.process.send_signal(signal.SIGINT)
    assert terminal.process.wait(TIMEOUT) == 0
    assert terminal.cooked


def test_missing_keys_are_reported(network: Network) -> None:
    program = network.run("-m", "rosz", "run", "turtlesim", "turtle_teleop_key")
    program.wait_for(READY)
    assert program.process.stdin is not None
    program.process.stdin.close()
    program.wait_for("no more keys to read: run it in a terminal of its own")
    assert program.exit_code() == 0


def test_a_launch_without_a_terminal_gives_it_no_keys(network: Network) -> None:
    file = network.folder / "keys.launch"
    file.write_text(LAUNCH)
    launch = network.run("-m", "rosz", "launch", str(file))
    launch.wait_for("no more keys to read: run it in a terminal of its own")
    assert launch.exit_code() == 0
