from __future__ import annotations

import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from network import TIMEOUT, Network

from rosz.msgs.sensor_msgs.msg import LaserScan
from rosz.msgs.std_msgs.msg import Bool, String, UInt8MultiArray
from rosz.node import Node

from .shell import Shell, latch

pytestmark = pytest.mark.usefixtures("talker")


def test_a_latched_message(shell: Shell) -> None:
    assert shell("topic", "echo", "-n", "1", "/robot/text").out == 'data: "hello"\n---\n'


def test_messages_as_they_come(shell: Shell, talker: Node) -> None:
    publisher = talker.publisher("/count", String)
    echo = shell.start("topic", "echo", "-n", "3", "/count")
    publisher.wait_for_subscribers(timeout=TIMEOUT)
    for number in range(3):
        publisher.publish(data=str(number))
    assert echo.exit_code() == 0
    assert echo.lines == ['data: "0"', "---", 'data: "1"', "---", 'data: "2"', "---"]


def test_a_field(shell: Shell) -> None:
    result = shell("topic", "echo", "--once", "/robot/pose/pose/position")
    assert result.out == "x: 1.5\ny: -2.0\nz: 0.25\n---\n"
    assert shell("topic", "echo", "-1", "/robot/pose/pose/position/y").out == "-2.0\n---\n"


def test_an_index(shell: Shell, talker: Node) -> None:
    latch(talker, "/scan", LaserScan(ranges=[0.5, 1.5, 2.5]))
    assert shell("topic", "echo", "-1", "/scan/ranges[1]").out == "1.5\n---\n"
    assert shell("topic", "echo", "-1", "/scan/ranges[1:]").out == "[1.5, 2.5]\n---\n"
    result = shell("topic", "echo", "-1", "/scan/ranges[0:2:0]")
    assert result.code == 2
    assert "expected a step other than 0" in result.err


def test_plot_form(shell: Shell) -> None:
    head, row = shell("topic", "echo", "-n", "1", "-p", "/robot/pose/pose/position").lines
    assert head == "%time,field.x,field.y,field.z"
    assert re.fullmatch(r"\d{19},1\.5,-2\.0,0\.25", row)


def test_what_is_left_out(shell: Shell, talker: Node) -> None:
    latch(talker, "/octets", UInt8MultiArray(data=b"abc"))
    result = shell("topic", "echo", "-1", "--noarr", "/octets")
    assert 'data: "<array type: uint8, length: 3>"' in result.lines
    result = shell("topic", "echo", "-1", "--nostr", "/robot/text")
    assert result.out == 'data: "<string length: 5>"\n---\n'


def test_fixed_width(shell: Shell) -> None:
    result = shell("topic", "echo", "-1", "-w", "6", "/robot/pose/pose/position")
    assert result.out == "x: 1.5000\ny: -2.000\nz: 0.2500\n---\n"


def test_a_filter(shell: Shell, talker: Node) -> None:
    for name, flag in (("/no", False), ("/yes", True)):
        latch(talker, name, Bool(flag))
    done = shell("topic", "echo", "-1", "--filter", "m.data and topic == '/yes'", "/yes")
    assert done.out == "data: True\n---\n"
    wrong = shell("topic", "echo", "-1", "--filter", "m.dat", "/yes")
    assert wrong.code == 1
    assert wrong.err.startswith("ERROR: filter 'm.dat' failed: AttributeError")
    assert shell("topic", "echo", "--filter", "m.data >", "/yes").code == 2


def test_json(shell: Shell) -> None:
    assert shell("topic", "echo", "-1", "--json", "/robot/text").out == '{"data":"hello"}\n'


def test_raw_needs_no_definition(shell: Shell) -> None:
    result = shell("topic", "echo", "-1", "--raw", "/robot/text")
    assert (
        result.lines[0]
        == "00000000  00 01 00 00 06 00 00 00 68 65 6c 6c 6f 00        |........hello.|"
    )
    result = shell("topic", "echo", "-1", "--raw", "--json", "/robot/text")
    assert result.json == {"payload": "000100000600000068656c6c6f00"}


def test_clearing_the_screen(shell: Shell) -> None:
    assert shell("topic", "echo", "-1", "-c", "/robot/text").out.startswith("\033[2J\033[;H")


def test_it_waits_for_a_topic(shell: Shell, talker: Node) -> None:
    echo = shell.start("topic", "echo", "-n", "1", "/later")
    echo.wait_for("WARNING: topic [/later] does not appear to be published yet")
    latch(talker, "/later", Bool(True))
    assert echo.exit_code() == 0
    assert echo.lines[-2:] == ["data: True", "---"]


def test_names_are_remapped(shell: Shell) -> None:
    result = shell("topic", "echo", "-n", "1", "chatter", "chatter:=/robot/text")
    assert result.out == 'data: "hello"\n---\n'
    result = shell("topic", "echo", "-n", "1", "text", "__ns:=/robot", "__name:=echo_node")
    assert result.out == 'data: "hello"\n---\n'


def test_another_definition_is_reported(shell: Shell, talker: Node) -> None:
    other = type("String", (String,), {"_type_hash": "RIHS01_" + "0" * 64})
    latch(talker, "/strange", other("x"))
    result = shell("topic", "echo", "-n", "1", "/strange")
    assert result.code == 1
    assert "'std_msgs/String' has another definition at node /talker" in result.err
    assert shell("topic", "echo", "-n", "1", "--raw", "/strange").code == 0


def test_a_type_that_only_the_publisher_knows(
    network: Network, shell: Shell, tmp_path: Path
) -> None:
    """Its node is asked for the definition, also where the topic comes later than the command."""
    folder = tmp_path / "src" / "odd_msgs"
    (folder / "msg").mkdir(parents=True)
    (folder / "package.xml").write_text("<package><name>odd_msgs</name></package>")
    (folder / "msg" / "Part.msg").write_text("float64 weight\n")
    (folder / "msg" / "Thing.msg").write_text("Part part\nstring[] labels\n")
    echo = network.run("-m", "rosz", "topic", "echo", "-n", "1", "/thing/part/weight")
    echo.wait_for("does not appear to be published yet")
    knowing = network.node("knowing", context=network.context(package_roots=(tmp_path / "src",)))
    part = knowing.context.types.message("odd_msgs/Part")(2.5)
    knowing.publisher("thing", "odd_msgs/Thing", latch=True).publish(part=part, labels=["a"])
    assert echo.exit_code() == 0, echo.output
    assert echo.lines[-2:] == ["2.5", "---"]
    result = shell("topic", "echo", "-n", "1", "/thing")
    assert result.out == "part: \n  weight: 2.5\nlabels: \n  - a\n---\n"
    rate = network.run("-m", "rosz", "topic", "hz", "--filter", "m.part.weight > 2", "/thing")
    rate.wait_for("subscribed to [/thing]")
    rate.send(signal.SIGINT)
    assert rate.exit_code() == 0


@pytest.mark.parametrize(
    "words",
    [
        ["-w", "1"],
        ["-w", "9" * 20],
        ["-n", "0"],
        ["-n", "9" * 20],
        ["-n", "many"],
        ["--raw", "-p"],
        ["a", "b"],
        [],
    ],
)
def test_wrong_usage(shell: Shell, words: list[str]) -> None:
    topic = ["/x"] if words and words != ["a", "b"] else []
    assert shell("topic", "echo", *words, *topic).code == 2


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_ends_when_stopped(shell: Shell, number: signal.Signals) -> None:
    echo = shell.start("topic", "echo", "/robot/text")
    echo.wait_for("---")
    echo.send(number)
    assert echo.exit_code() == 0
    assert echo.lines == ['data: "hello"', "---"]


def test_echo_outlives_the_meeting_point(shell: Shell, network: Network) -> None:
    first = network.node("first")
    publisher = network.node("second").publisher("/count", String)
    echo = shell.start("topic", "echo", "/count")
    publisher.wait_for_subscribers(timeout=TIMEOUT)
    first.context.close()
    publisher.publish(data="still here")
    echo.wait_for("still here")


def test_a_closed_pipe_ends_echo_quietly(network: Network) -> None:
    node = network.node("talker")
    publisher = node.publisher("/count", String)
    node.timer(0.02, lambda _: publisher.publish(data="more"))
    echo = subprocess.Popen(
        [sys.executable, "-m", "rosz", "topic", "echo", "/count"],
        env=network.variables(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    with echo:
        assert echo.stdout is not None
        assert echo.stderr is not None
        assert echo.stdout.readline() == b'data: "more"\n'
        echo.stdout.close()
        assert echo.stderr.read() == b""
        assert echo.wait(TIMEOUT) == 0
