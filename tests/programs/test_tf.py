"""The programs of tf, tf2_ros and tf2_tools, and rosz tf."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from queue import SimpleQueue
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from network import TIMEOUT, Network, Program, eventually

from rosz.errors import UsageError
from rosz.msgs.geometry_msgs.msg import TransformStamped
from rosz.msgs.std_msgs.msg import Header
from rosz.msgs.tf2_msgs.msg import TFMessage
from rosz.programs.tf import leading_number, parse_transform
from rosz.qos import QoS
from rosz.transforms import (
    Buffer,
    FrameReport,
    Monitor,
    StaticTransformBroadcaster,
    TransformListener,
    from_rpy,
    to_rpy,
    tree_as_dot,
    tree_as_text,
)

ANGLES = st.floats(-3.1, 3.1)


def start(network: Network, *words: str) -> Program:
    return network.run("-P", "-m", "rosz", *words)


@given(ANGLES, st.floats(-1.5, 1.5), ANGLES)
def test_angles_and_back(roll: float, pitch: float, yaw: float) -> None:
    back = to_rpy(from_rpy(roll, pitch, yaw))
    assert back == pytest.approx((roll, pitch, yaw), abs=1e-6)


def test_an_upright_pitch() -> None:
    roll, pitch, yaw = to_rpy(from_rpy(0.25, math.pi / 2, 0.0))
    assert math.isclose(roll, 0.25, abs_tol=1e-6)
    assert math.isclose(pitch, math.pi / 2)
    assert yaw == 0.0


def test_both_forms_of_a_transform() -> None:
    euler = parse_transform(["1", "2", "3", "1.5707963", "0", "0", "map", "base"])
    given_ = parse_transform(["1", "2", "3", "0", "0", "0.70710678", "0.70710678", "map", "base"])
    for one in (euler, given_):
        assert (one.header.frame_id, one.child_frame_id) == ("map", "base")
        assert one.transform.translation.z == 3.0
        assert math.isclose(one.transform.rotation.z, math.sqrt(0.5), abs_tol=1e-6)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["1", "2"], "got 2 arguments, expected 8 or 9"),
        (["1", "2", "x", "0", "0", "0", "a", "b"], "expected a number"),
        (["1", "2", "3", "0", "0", "0", "a", "a"], "both 'a'"),
    ],
)
def test_what_is_no_transform(words: list[str], text: str) -> None:
    with pytest.raises(UsageError, match=text):
        parse_transform(words)


def test_the_programs_read_numbers_as_those_of_ros1() -> None:
    """ROS 1's static_transform_publisher reads 0, 0.5 and 0.1 from the first three."""
    words = ["0,", ".5m", "1e-1x", "0", "0", "0", "a", "b"]
    found = parse_transform(words, leading_number).transform.translation
    assert (found.x, found.y, found.z) == (0.0, 0.5, 0.1)
    with pytest.raises(UsageError, match="expected a number"):
        parse_transform(words)
    with pytest.raises(UsageError, match="expected a number"):
        parse_transform(["x", *words[1:]], leading_number)


def report(frame: str, parent: str, **more: Any) -> FrameReport:
    values = {"node": "/n", "static": True, "rate": 0.0, "mean_delay": 0.0, "max_delay": 0.0}
    return FrameReport(frame, parent, **{**values, **more})


def test_trees() -> None:
    frames = [report("odom", "map"), report("base", "odom"), report("arm", "base")]
    assert tree_as_text(frames) == ["map", "  odom", "    base", "      arm"]
    assert tree_as_text([report("a", "b"), report("b", "a")]) == ["a (in a loop)", "b (in a loop)"]
    assert '"map" -> "odom" [label="Broadcaster: /n' in tree_as_dot(frames, 5.0)


def test_publishers_listeners_and_commands(network: Network) -> None:
    words = ["0", "0", "0.5", "0", "0", "0.1", "base", "laser"]
    static = start(network, "run", "tf2_ros", "static_transform_publisher", *words)
    words = ["1", "0", "0", "1.5707963", "0", "0", "map", "base", "20"]
    moving = start(network, "run", "tf", "static_transform_publisher", *words, "__name:=mover")
    monitor = Monitor(network.node("watcher"))
    eventually(lambda: not monitor.buffer.why_not("map", "laser"), "the transforms")
    eventually(lambda: all(one.node for one in monitor.frames()), "the names of the broadcasters")
    found = {one.frame: one for one in monitor.frames()}
    assert found["laser"].static
    assert found["laser"].node.startswith("/static_transform_publisher_")
    assert not found["base"].static
    assert found["base"].node == "/mover"
    pose, _ = monitor.buffer.lookup("map", "laser")
    assert all(map(math.isclose, pose.translation, (1.0, 0.0, 0.5)))

    echo = start(network, "run", "tf", "tf_echo", "map", "laser", "50")
    echo.wait_for("- Translation: [1.000, 0.000, 0.500]")
    echo.wait_for("            in RPY (degree) [5.730, 0.000, 90.000]")
    command = start(network, "tf", "echo", "-n", "1", "map", "laser")
    assert command.exit_code() == 0, command.output
    assert "- Translation: [1.000, 0.000, 0.500]" in command.lines

    def tree() -> tuple[int, list[str]]:
        command = start(network, "tf", "tree", "--wait", "0.5")
        return command.exit_code(), command.lines

    frames = ["map", "  base", "    laser"]
    eventually(lambda: tree() == (0, frames), "what comes within half a second")
    watch = start(network, "run", "tf", "tf_monitor")
    watch.wait_for("Frame: base published by /mover Average Delay: ")
    for program in (static, moving):
        assert program.process.poll() is None, program.output


def test_publish_command_reaches_late_listeners(network: Network) -> None:
    late = network.node("late")
    program = start(network, "tf", "publish", "1", "2", "3", "0", "0", "0", "map", "camera")
    program.wait_for("publishing camera in map")
    buffer = Buffer()
    listener = TransformListener(buffer, late)
    eventually(lambda: not buffer.why_not("map", "camera"), "the transform")
    assert buffer.lookup("map", "camera")[0].translation == (1.0, 2.0, 3.0)
    listener.close()


def test_echo_tells_what_it_waits_for(network: Network) -> None:
    node = network.node("late")
    program = start(network, "tf", "echo", "-n", "1", "map", "late")
    program.wait_for("waiting for the transform: canTransform: target_frame map does not exist.")
    pose = TransformStamped(Header(frame_id="map"), "late")
    pose.transform.rotation.w = 1.0
    StaticTransformBroadcaster(node).send(pose)
    assert program.exit_code() == 0, program.output


def test_the_program_of_tf_dates_ahead(network: Network) -> None:
    node = network.node("watcher")
    seen: SimpleQueue[TFMessage] = SimpleQueue()
    node.subscription("/tf", TFMessage, seen.put, qos=QoS(depth=100))
    words = ["0", "0", "0", "0", "0", "0", "a", "b", "60000"]
    start(network, "run", "tf", "static_transform_publisher", *words)
    stamp = seen.get(timeout=TIMEOUT).transforms[0].header.stamp.to_nsec()
    assert stamp > node.now() + 20 * 10**9


def test_wrong_words(network: Network) -> None:
    network.node("setter").params["/unfit"] = {"speed": 1}
    for words, text in (
        (["tf", "static_transform_publisher", "1"], "usage: "),
        (["tf", "static_transform_publisher", *"000000ab"], "got 8 arguments, expected 9 or 10"),
        (["tf2_ros", "static_transform_publisher"], "exited due to not having the right number"),
        (["tf2_ros", "static_transform_publisher", "/none"], "Could not read TF from parameter"),
        (["tf2_ros", "static_transform_publisher", "/unfit"], "Could not validate XmlRpcC"),
        (["tf", "tf_echo", "a", "b", "0"], "usage: "),
        (["tf", "tf_echo", "a", "b", "_precision:=much"], "~precision is 'much'; expected from 0"),
        (["tf", "tf_echo", "a", "b", "_precision:=-1"], "~precision is -1; expected from 0 to 99"),
    ):
        program = start(network, "run", *words)
        assert program.exit_code() == 255
        assert text in program.output


def test_a_drawing_that_fails_is_one_line(network: Network) -> None:
    dot = network.folder / "bin" / "dot"
    dot.parent.mkdir()
    dot.write_text("#!/bin/sh\nexit 3\n")
    dot.chmod(0o755)
    pose = TransformStamped(Header(frame_id="map"), "base")
    StaticTransformBroadcaster(network.node("base")).send(pose)
    variables = network.variables(PATH=f"{dot.parent}:{os.environ['PATH']}")
    words = [sys.executable, "-P", "-m", "rosz", "run", "tf2_tools", "view_frames.py"]
    program = network._keep(Program(words, variables, network.folder))
    assert program.exit_code() == 1
    assert program.lines[-1].startswith("view_frames: cannot draw 'frames.gv': Command ")


CLIENT = """
    import rosz.ros1, rospy, tf2_ros
    rospy.init_node("user")
    client = tf2_ros.BufferClient("/tf_buffer")
    assert client.wait_for_server(rospy.Duration(60))
    found = client.lookup_transform("map", "camera", rospy.Time(0), rospy.Duration(60))
    print(found.transform.translation.x)
    rospy.signal_shutdown("done")
"""


def test_buffer_server(network: Network) -> None:
    words = ["4", "0", "0", "0", "0", "0", "map", "camera"]
    start(network, "run", "tf2_ros", "static_transform_publisher", *words)
    start(network, "run", "tf2_ros", "buffer_server")
    client = network.program(CLIENT)
    assert client.exit_code() == 0, client.output
    assert "4.0" in client.lines


@pytest.mark.parametrize("program", [["tf_echo", "map", "base"], ["tf_monitor"]])
def test_output_that_nobody_reads_ends_the_program(network: Network, program: list[str]) -> None:
    with subprocess.Popen(
        [sys.executable, "-m", "rosz", "run", "tf", *program, "_rate:=100"],
        env=network.variables(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        try:
            broadcaster = StaticTransformBroadcaster(network.node("robot"))
            made = TransformStamped()
            made.header.frame_id, made.child_frame_id = "map", "base"
            made.transform.rotation.w = 1.0
            broadcaster.send(made)
            assert process.stdout is not None
            assert process.stderr is not None
            while not process.stdout.readline().strip():
                pass
            process.stdout.close()
            assert process.wait(TIMEOUT) == 0
            assert process.stderr.read() == b""
        finally:
            process.kill()
