"""turtlebot3_teleop."""

from __future__ import annotations

import signal
from queue import SimpleQueue

import pytest
from network import TIMEOUT, Network
from turtles.test_teleop import Terminal

from rosz.msgs.geometry_msgs.msg import Twist
from rosz.programs.turtlebot3_teleop import Turtlebot3Driver


def test_keys_change_the_wanted_speed(network: Network, capsys: pytest.CaptureFixture[str]) -> None:
    user, node = network.node("user"), network.node("teleop")
    heard: SimpleQueue[Twist] = SimpleQueue()
    user.subscription("cmd_vel", Twist, heard.put)
    driver = Turtlebot3Driver(node)
    driver._commands.wait_for_subscribers(timeout=TIMEOUT)

    def press(key: str) -> tuple[float, float]:
        driver.press(key)
        twist = heard.get(timeout=TIMEOUT)
        return (round(twist.linear.x, 6), round(twist.angular.z, 6))

    assert press("w") == (0.005, 0.0)
    assert press("a") == (0.01, 0.05)
    assert press("") == (0.01, 0.1)
    assert press("x") == (0.005, 0.1)
    assert press("d") == (0.0, 0.05)
    assert press("w") == (0.005, 0.0)
    assert press("?") == (0.01, 0.0)
    assert press(" ") == (0.0, 0.0)
    for key, wanted in (("w", [0.22, 0.0]), ("d", [0.22, -2.84])):
        for _ in range(40):
            press(key)
        assert driver.wanted == wanted
    out = capsys.readouterr().out
    assert "currently:\tlinear vel 0.01\t angular vel 0.1 \n" in out
    assert out.count("Control Your TurtleBot3!") == 87 // 20


def test_limits_of_a_waffle(network: Network) -> None:
    node = network.node("teleop")
    node.params.set("model", "waffle_pi")
    driver = Turtlebot3Driver(node)
    for key in "wa":
        for _ in range(40):
            driver.press(key)
    assert driver.wanted == [0.26, 1.82]


def test_in_a_terminal(network: Network) -> None:
    user = network.node("user")
    heard: SimpleQueue[Twist] = SimpleQueue()
    user.subscription("cmd_vel", Twist, heard.put)
    terminal = Terminal(network, "run", "turtlebot3_teleop", "turtlebot3_teleop_key")
    try:
        terminal.expect("Ctrl-C ends it.")
        terminal.press("w")
        while heard.get(timeout=TIMEOUT).linear.x != 0.01:
            pass
        terminal.process.send_signal(signal.SIGINT)
        assert terminal.process.wait(TIMEOUT) == 0
        assert terminal.cooked
    finally:
        terminal.close()
    while not heard.empty():
        last = heard.get()
    assert last.linear.x == 0.0
