"""``ros2 topic``: what is measured, published and refused."""

from __future__ import annotations

import re
import signal
from pathlib import Path
from typing import Any

import pytest
from network import Network, eventually

from rosz.msgs.geometry_msgs.msg import Point, PointStamped
from rosz.msgs.std_msgs.msg import Float64MultiArray, String
from rosz.node import Node
from rosz.qos import QoS

from .conftest import Ros2

LATCHED = QoS(depth=5, durability="transient_local")


def latch(network: Network, topic: str, message: Any) -> Node:
    node = network.node("source")
    node.publisher(topic, type(message), qos=LATCHED).publish(message)
    return node


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ((), "layout:\n  dim: []\n  data_offset: 0\ndata:\n- 1.0\n- 2.5\n- 3.0\n---\n"),
        (("--flow-style",), "layout:\n  dim: []\n  data_offset: 0\ndata: [1.0, 2.5, 3.0]\n---\n"),
        (("--csv",), ",0,1.0,2.5,3.0\n"),
        (("-l", "2", "--csv"), ",0,1.0,2.5,...\n"),
        (("--field", "layout.data_offset"), "0\n---\n"),
        (("--field", "data"), "array('d', [1.0, 2.5, 3.0])\n---\n"),
        (("--field", "layout", "--filter", "m.data_offset == 0"), "dim: []\ndata_offset: 0\n---\n"),
        (
            ("--no-arr",),
            "layout:\n  dim: '<sequence type: std_msgs/msg/MultiArrayDimension, length: 0>'\n"
            "  data_offset: 0\ndata: '<sequence type: double, length: 3>'\n---\n",
        ),
    ],
)
def test_echo(ros2: Ros2, options: tuple[str, ...], expected: str) -> None:
    latch(ros2.network, "/numbers", Float64MultiArray(data=[1.0, 2.5, 3.0]))
    assert ros2("topic", "echo", "--once", *options, "/numbers") == (0, expected, "")


def test_echo_of_texts(ros2: Ros2) -> None:
    latch(ros2.network, "/text", String("Grüße, " + "x" * 200))
    code, out, _ = ros2("topic", "echo", "--once", "/text")
    assert (code, out) == (0, f"data: Grüße, {'x' * 121}...\n---\n")
    assert ros2("topic", "echo", "--once", "-f", "/text").out == f"data: Grüße, {'x' * 200}\n---\n"
    assert ros2("topic", "echo", "--once", "--no-str", "/text").out == (
        "data: '<string length: <207>>'\n---\n"
    )


def test_echo_of_bytes_and_origins(ros2: Ros2) -> None:
    latch(ros2.network, "/text", String("hi"))
    code, out, _ = ros2("topic", "echo", "--once", "--raw", "/text")
    assert (code, out) == (0, f"{String._encode(String('hi'))!r}\n---\n")
    code, out, _ = ros2("topic", "echo", "--once", "-i", "/text")
    assert code == 0
    assert re.fullmatch(
        r"publication_sequence_number: 1\nreceived_timestamp: \d+\n"
        r"reception_sequence_number: null\nsource_timestamp: \d+\n---\ndata: hi\n---\n",
        out,
    )


@pytest.mark.parametrize(
    ("words", "out", "err"),
    [
        (
            "echo /nothing",
            "WARNING: topic [/nothing] does not appear to be published yet\n",
            "Could not determine the type for the passed topic\n",
        ),
        ("echo /numbers foo/msg/Bar", "", "The passed message type is invalid\n"),
        ("echo /numbers --field ..", "", "Invalid field value '..'\n"),
        (
            "echo --once /numbers --field no",
            "",
            "Invalid field 'no': 'Float64MultiArray' object has no attribute 'no'\n",
        ),
        ("info /nothing", "", "Unknown topic '/nothing'\n"),
        ("delay /numbers", "", "msg does not have header\n"),
        ("pub -1 -w 0 /a std_msgs/Nope {}", "", "The passed message type is invalid\n"),
        (
            "pub -1 -w 0 /a std_msgs/msg/String 5",
            "",
            "The passed value needs to be a dictionary in YAML format\n",
        ),
        (
            "pub -1 -w 0 /a std_msgs/msg/String {dat:1}",
            "",
            "Failed to populate field: 'String' object has no attribute 'dat:1'\n",
        ),
        (
            "pub --once -w 2 --max-wait-time-secs 0.1 /a std_msgs/msg/String",
            "Waiting for at least 2 matching subscription(s)...\n",
            "Timed out waiting for subscribers: Expected 2 subcribers but only got 0 subscribers\n",
        ),
    ],
)
def test_refused(ros2: Ros2, words: str, out: str, err: str) -> None:
    latch(ros2.network, "/numbers", Float64MultiArray(data=[1.0]))
    assert ros2("topic", *words.split()) == (1, out, err)


def test_values_that_are_not_yaml(ros2: Ros2) -> None:
    code, out, err = ros2("topic", "pub", "-1", "-w", "0", "/a", "std_msgs/msg/String", "{data: [")
    assert (code, out) == (1, "")
    assert err.startswith("the values are not YAML: ")
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "ending"),
    [
        ("topic", None),
        (
            "topik",
            "ros2: error: argument Call `ros2 <command> -h` for more detailed usage.: invalid"
            " choice: 'topik'",
        ),
        ("topic lst", "usage.: invalid choice: 'lst'"),
        (
            "topic echo",
            "ros2 topic echo: error: the following arguments are required: topic_name",
        ),
        ("topic list --bad", "ros2: error: unrecognized arguments: --bad"),
        ("topic hz -w 0 /a", "argument -w/--window: value must be a positive integer"),
        ("topic pub -r 0 /a b", "argument -r/--rate: Value must be positive"),
        ("topic pub -r x /a b", "argument -r/--rate: Expects a floating point number"),
        ("topic pub -t -1 /a b", "argument -t/--times: expected one argument"),
        ("topic pub -1 -t 2 /a b", "argument -t/--times: not allowed with argument -1/--once"),
        ("bag info nope", "argument bag_path: Bag path 'nope' does not exist!"),
    ],
)
def test_wrong_usage(ros2: Ros2, words: str, ending: str | None) -> None:
    code, out, err = ros2(*words.split())
    if ending is None:
        assert (code, err) == (0, "")
        assert out.startswith("usage: ros2 topic [-h]")
        assert "\n  echo   Output messages from a topic\n" in out
    else:
        assert (code, out) == (2, "")
        assert ending in err.splitlines()[-1]


def test_nobody_is_there(ros2: Ros2) -> None:
    code, out, err = ros2("topic", "list")
    assert (code, out) == (0, "/parameter_events\n/rosout\n")
    assert err.startswith("WARNING: nobody answers at ")
    assert ros2("node", "list").out == ""


def test_a_publisher_that_comes_first(ros2: Ros2) -> None:
    """In ROS 2 any command may be the first on the network, and is hidden."""
    publisher = ros2.start("topic", "pub", "-r", "20", "/chat", "std_msgs/msg/String", "data: hi")
    publisher.wait_for("publishing #2: std_msgs.msg.String(data='hi')")
    assert ros2("topic", "echo", "--once", "/chat") == (0, "data: hi\n---\n", "")
    assert ros2("node", "list").out == ""
    assert re.search(r"^/_ros2cli_\d+$", ros2("node", "list", "-a").out, re.MULTILINE)
    publisher.send(signal.SIGINT)
    assert publisher.exit_code() == 2


def test_pub_sets_times(ros2: Ros2) -> None:
    received: list[PointStamped] = []
    node = ros2.network.node("sink")
    node.subscription("/points", PointStamped, received.append)
    kind = "geometry_msgs/msg/PointStamped"
    code, _, err = ros2("topic", "pub", "-1", "/points", kind, "{header: auto, point: {x: 1}}")
    assert (code, err) == (0, "")
    eventually(lambda: received, "the message")
    assert received[0].point == Point(1.0, 0.0, 0.0)
    assert received[0].header.stamp.sec > 0


def test_measuring(ros2: Ros2) -> None:
    kind = "geometry_msgs/msg/PointStamped"
    for topic in ("/points", "/others"):
        ros2.start("topic", "pub", "-r", "50", "-p", "0", topic, kind, "{header: auto}")
    figures = r"\tmin: -?[\d.]+s max: -?[\d.]+s std dev: [\d.]{7,}s window: \d+"
    sizes = r"\tMessage size mean: .* K?B min: .* K?B max: .* K?B"
    for verb, first, second in (
        ("hz", r"average rate: [\d.]+", figures),
        ("delay", r"average delay: -?[\d.]+", figures),
        ("bw", r"[\d.]+ K?B/s from \d+ messages", sizes),
    ):
        program = ros2.start("topic", verb, "/points")
        program.wait_for(re.compile(f"^{first}$"))
        program.wait_for(re.compile(f"^{second}$"))
        program.send(signal.SIGINT)
        assert program.exit_code() == (0 if verb == "hz" else 2)
    both = ros2.start("topic", "hz", "/points", "/others")
    both.wait_for(re.compile(r"^ *topic +rate +min_delta +max_delta +std_dev +window$"))
    both.wait_for(re.compile(r"^/others +[\d.]+ "))


@pytest.mark.parametrize("option", ["", "--include-hidden-topics"])
def test_hidden_topics_of_a_bag(ros2: Ros2, tmp_path: Path, option: str) -> None:
    node = ros2.network.node("robot")
    recorder = ros2.start("bag", "record", "-a", *option.split(), "-o", str(tmp_path / "run"))
    recorder.wait_for("Subscribing to /rosout")
    for topic in ("/arm/_state", "/text"):  # in this order, so do others hear of them
        node.publisher(topic, String)
    recorder.wait_for("Subscribing to /text")
    assert ("Subscribing to /arm/_state" in recorder.lines) == bool(option)


def test_a_bag(ros2: Ros2, tmp_path: Path) -> None:
    ros2.start("topic", "pub", "-r", "50", "-p", "0", "/text", "std_msgs/msg/String", "data: hi")
    folder = tmp_path / "run"
    recorder = ros2.start("bag", "record", "-o", str(folder), "/text")
    recorder.wait_for("Subscribing to /text")
    active = folder / "run_0.mcap.active"
    # A file without messages is smaller.
    eventually(lambda: active.exists() and active.stat().st_size > 5000, "messages in the bag")
    recorder.send(signal.SIGINT)
    assert recorder.exit_code() == 0, recorder.output
    assert sorted(file.name for file in folder.iterdir()) == ["metadata.yaml", "run_0.mcap"]
    code, out, err = ros2("bag", "info", str(folder))
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[1] == "Files:             run_0.mcap"
    assert re.fullmatch(r"Messages:          \d\d+", lines[8])
    assert re.fullmatch(
        r"Topic information: Topic: /text \| Type: std_msgs/msg/String \| Count: \d+ \|"
        r" Serialization Format: cdr",
        lines[9],
    )
    assert ros2("bag", "info", "-t", str(folder)).out == "/text\n"
    refused = ros2("bag", "record", "-o", str(folder), "/text")
    assert refused.code == 1
    assert refused.err == f"[ERROR] [ros2bag]: Output folder '{folder}' already exists.\n"
    assert ros2("bag", "record").code == 1
