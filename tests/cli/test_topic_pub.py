from __future__ import annotations

import signal
from pathlib import Path

import pytest
from network import TIMEOUT, Network, eventually

from rosz.msgs.geometry_msgs.msg import PoseStamped, Twist
from rosz.msgs.std_msgs.msg import String
from rosz.node import Node

from .shell import Shell

pytestmark = pytest.mark.usefixtures("talker")


@pytest.fixture
def heard(talker: Node) -> list[Twist]:
    """What arrives on /cmd."""
    found: list[Twist] = []
    talker.subscription("/cmd", Twist, found.append)
    return found


def test_once(shell: Shell, heard: list[Twist]) -> None:
    result = shell("topic", "pub", "-1", "/cmd", "geometry_msgs/Twist", "{linear: {x: 2}}")
    assert result.out == "publishing and latching message for 3.0 seconds\n"
    eventually(lambda: heard, "the message")  # the callback may be later than the command
    assert [message.linear.x for message in heard] == [2.0]


def test_positional_values(shell: Shell, heard: list[Twist]) -> None:
    pub = shell.start("topic", "pub", "cmd", "geometry_msgs/Twist", "[1, 2, 3]", "[4, 5, 6]")
    eventually(lambda: heard, "the message")
    assert (heard[0].linear.z, heard[0].angular.x) == (3.0, 4.0)
    pub.wait_for("publishing and latching message. Press ctrl-C to terminate")
    assert len(pub.lines) == 1
    pub.send(signal.SIGINT)
    assert pub.exit_code() == 0


def test_a_rate(shell: Shell, heard: list[Twist]) -> None:
    pub = shell.start("topic", "pub", "-r", "50", "-v", "/cmd", "geometry_msgs/Twist", "{}")
    eventually(lambda: len(heard) >= 5, "several messages")
    pub.wait_for("  x: 0.0")
    assert pub.lines[0] == "publishing linear: "


def test_a_latched_message_waits_for_late_subscribers(shell: Shell, talker: Node) -> None:
    pub = shell.start("topic", "pub", "/late", "std_msgs/String", "hello")
    pub.wait_for("latching")
    assert talker.subscription("/late", String).get(TIMEOUT) == String("hello")


def test_now_and_auto(shell: Shell, talker: Node) -> None:
    found: list[PoseStamped] = []
    talker.subscription("/stamped", PoseStamped, found.append)
    before = talker.now()
    pub = shell.start(
        "topic",
        "pub",
        "-s",
        "-r",
        "50",
        "/stamped",
        "geometry_msgs/PoseStamped",
        "header: auto",
    )
    eventually(lambda: len(found) >= 2, "two messages")
    pub.close()
    first, second = (message.header.stamp.to_nsec() for message in found[:2])
    assert before < first < second


def test_a_file(shell: Shell, talker: Node, network: Network) -> None:
    found: list[String] = []
    talker.subscription("/lines", String, found.append)
    Path(network.folder, "lines.yaml").write_text("data: one\n---\n[two]\n---\n")
    shell.start("topic", "pub", "-f", f"{network.folder}/lines.yaml", "/lines", "std_msgs/String")
    eventually(lambda: len(found) == 2, "both messages")
    assert found == [String("one"), String("two")]


def test_a_file_of_one_message_and_a_rate(shell: Shell, heard: list[Twist]) -> None:
    path = shell.network.folder / "one.yaml"
    path.write_text("linear: {x: 1}\n")
    pub = shell.start("topic", "pub", "-r", "50", "-f", str(path), "/cmd", "geometry_msgs/Twist")
    eventually(lambda: len(heard) >= 3, "repeated messages")
    pub.wait_for("Got one message and a rate, publishing repeatedly")


def test_standard_input(shell: Shell, talker: Node) -> None:
    found: list[String] = []
    talker.subscription("/lines", String, found.append)
    pub = shell.start("topic", "pub", "/lines", "std_msgs/String")
    pub.say("data: first\n---")
    eventually(lambda: found, "the first message")
    pub.say("data: unfinished")
    assert pub.process.stdin is not None
    pub.process.stdin.close()
    assert pub.exit_code() == 0
    assert found == [String("first")]


@pytest.mark.parametrize(
    ("words", "code", "text"),
    [
        (["/x", "geometry_msgs/Twist", "{liner: 1}"], 1, "did you mean 'linear'?"),
        (
            ["/x", "geometry_msgs/Twist", "[1, 2]", "[]"],
            1,
            "the values are: [linear.x linear.y",
        ),
        (["/x", "std_msgs/Int8", "300"], 1, "std_msgs/Int8.data: expected int8"),
        (["/x", "std_msgs/Int8", "[1"], 2, "value 1, '[1', is not YAML"),
        (["/x", "std_msgs/Nope", "1"], 1, "package 'std_msgs' has no such msg"),
        (["-f", "/nowhere", "/x", "std_msgs/Int8"], 1, "file '/nowhere' is not there"),
        (["-r", "0", "/x", "std_msgs/Int8", "1"], 2, "expected a rate above 0"),
        (["-r", "1", "-1", "/x", "std_msgs/Int8", "1"], 2, "exclude each other"),
        (["-f", "f", "/x", "std_msgs/Int8", "1"], 2, "no values are taken"),
        (["/x"], 2, "TYPE"),
        (["2x", "std_msgs/Int8", "1"], 1, "'2x' is not a valid name"),
    ],
)
def test_errors(shell: Shell, words: list[str], code: int, text: str) -> None:
    result = shell("topic", "pub", *words)
    assert result.code == code
    assert text in result.err
    assert result.err.count("\n") == 1


def test_no_values_on_a_terminal(shell: Shell) -> None:
    result = shell("topic", "pub", "/x", "std_msgs/Int8", terminal=True)
    assert result.code == 2
    assert "no values are given; they are: data" in result.err


def test_a_negative_value_without_two_dashes(shell: Shell) -> None:
    result = shell("topic", "pub", "/x", "std_msgs/Float64", "-2")
    expected = "ERROR: no such option: -2; write '--' before a negative value; see 'rosz topic pub"
    assert (result.code, result.out) == (2, "")
    assert result.err.startswith(expected)


def test_an_unfinished_document_is_reported(shell: Shell) -> None:
    result = shell("topic", "pub", "/x", "std_msgs/Float64", stdin="data: 1\n")
    assert (result.code, result.out) == (0, "")
    assert result.err.startswith("WARNING: standard input ends without a line '---': ")
