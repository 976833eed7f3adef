"""teleop_twist_keyboard."""

from __future__ import annotations

import signal
from queue import SimpleQueue

import pytest
from network import TIMEOUT, Network
from turtles.test_teleop import Terminal

from rosz.msgs.geometry_msgs.msg import Twist, TwistStamped
from rosz.programs.teleop_twist_keyboard import KeyboardDriver


def test_keys_are_commands(network: Network, capsys: pytest.CaptureFixture[str]) -> None:
    user, node = network.node("user"), network.node("teleop")
    node.params.set("~speed_limit", 0.52)
    heard: SimpleQueue[Twist] = SimpleQueue()
    user.subscription("cmd_vel", Twist, heard.put)
    driver = KeyboardDriver(node)
    driver.wait()

    def press(key: str) -> tuple[float, float, float]:
        driver.press(key)
        twist = heard.get(timeout=TIMEOUT)
        return (twist.linear.x, twist.linear.y, twist.angular.z)

    assert press("u") == (0.5, 0.0, 1.0)
    assert press("q") == (0.52, 0.0, 1.1)
    assert "Linear speed limit reached!" in capsys.readouterr().out
    assert press("L") == (0.0, -0.52, 0.0)
    assert press("") == (0.0, 0.0, 0.0)
    driver.press("")  # it stands still already
    assert press("k") == (0.0, 0.0, 0.0)
    assert heard.empty()


def test_commands_with_a_stamp(network: Network) -> None:
    user, node = network.node("user"), network.node("teleop")
    node.params.set("~stamped", True)
    node.params.set("~frame_id", "base")
    node.params.set("~repeat_rate", 50.0)
    subscription = user.subscription("cmd_vel", TwistStamped)
    KeyboardDriver(node)
    first, second = subscription.get(TIMEOUT), subscription.get(TIMEOUT)
    assert first.header.frame_id == "base"
    assert second.header.stamp > first.header.stamp


def test_in_a_terminal(network: Network) -> None:
    user = network.node("user")
    heard: SimpleQueue[Twist] = SimpleQueue()
    user.subscription("cmd_vel", Twist, heard.put)
    program = ("teleop_twist_keyboard", "teleop_twist_keyboard.py", "_key_timeout:=0.05")
    terminal = Terminal(network, "run", *program)
    try:
        terminal.expect("currently:")
        terminal.press("i")
        assert heard.get(timeout=TIMEOUT).linear.x == 0.5
        assert heard.get(timeout=TIMEOUT).linear.x == 0.0  # no key for a while
        terminal.process.send_signal(signal.SIGINT)
        assert terminal.process.wait(TIMEOUT) == 0
        assert terminal.cooked
    finally:
        terminal.close()
