from __future__ import annotations

import re
import signal

import pytest
from network import TIMEOUT, Program

from rosz.msgs.geometry_msgs.msg import PoseStamped
from rosz.msgs.std_msgs.msg import Bool
from rosz.node import Node

from .shell import Shell

pytestmark = pytest.mark.usefixtures("ticking")


@pytest.fixture
def ticking(talker: Node) -> Node:
    """A node that publishes fifty times a second."""
    publisher = talker.publisher("/tick", PoseStamped)
    stamped = PoseStamped()

    def tick(_: object) -> None:
        stamped.header.stamp = type(stamped.header.stamp).from_nsec(talker.now() - 500_000_000)
        publisher.publish(stamped)

    talker.timer(0.02, tick)
    return talker


def comes(program: Program, pattern: str, low: float, high: float) -> bool:
    """Wait for a line with a figure between two others.

    A busy machine sends and takes late, and then much at once: the first figures may be any.
    """

    def found() -> bool:
        lines = [re.fullmatch(pattern, line) for line in program.lines]
        return any(low < float(line[1]) < high for line in lines if line)

    return program.wait_until(found)


def test_hz(shell: Shell) -> None:
    hz = shell.start("topic", "hz", "/tick")
    assert comes(hz, r"average rate: ([\d.]+)", 5, 500)
    assert hz.lines[0] == "subscribed to [/tick]"
    assert re.fullmatch(
        r"\tmin: \d+\.\d{3}s max: \d+\.\d{3}s std dev: \d+\.\d{5}s window: \d+",
        hz.wait_for("std dev"),
    )
    hz.send(signal.SIGINT)
    assert hz.exit_code() == 0


def test_hz_of_several_topics_and_with_a_filter(shell: Shell, ticking: Node) -> None:
    tock = ticking.publisher("/tock", Bool)
    ticking.timer(0.05, lambda _: tock.publish(Bool(data=True)))
    hz = shell.start("topic", "hz", "--filter", "True", "-w", "10", "/tick", "/tock")
    hz.wait_for(re.compile(r"^/tock  .* 10\s*$"))
    windows = [int(line.split()[-1]) for line in hz.lines if line.startswith("/tock  ")]
    assert max(windows) == 10
    assert hz.wait_for("====")


def test_hz_without_messages(shell: Shell, talker: Node) -> None:
    talker.publisher("/quiet", Bool)
    shell.start("topic", "hz", "/quiet").wait_for("no new messages")


def test_bw(shell: Shell) -> None:
    bw = shell.start("topic", "bw", "/tick")
    size = len(PoseStamped().to_cdr())
    assert comes(bw, r"average: ([\d.]+)KB/s", 5 * size / 1000, 500 * size / 1000)
    assert bw.wait_for("mean: ").startswith(f"\tmean: {size / 1000:.2f}KB min: ")


def test_delay(shell: Shell) -> None:
    delay = shell.start("topic", "delay", "/tick")
    assert 0.5 <= float(delay.wait_for("average delay: ").rpartition(" ")[2]) < TIMEOUT


def test_delay_needs_a_header(shell: Shell) -> None:
    result = shell("topic", "delay", "/robot/text")
    assert result.code == 1
    assert "'std_msgs/String' of topic '/robot/text' has no header" in result.err


def test_a_window_of_one_measures_nothing(shell: Shell) -> None:
    assert shell("topic", "hz", "-w", "1", "/tick").code == 2


@pytest.mark.parametrize("tool", ["hz", "bw", "delay"])
def test_a_window_that_is_too_large(shell: Shell, tool: str) -> None:
    result = shell("topic", tool, "-w", "9" * 20, "/tick")
    assert (result.code, result.out) == (2, "")
    assert "expected at most 1000000000 messages" in result.err
