"""``ros2 interface``, ``pkg``, ``run``, ``launch`` and what is asked of the system."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from rosz.bags import Channel, class_of
from rosz.msgs.lifecycle_msgs.msg import State, Transition, TransitionDescription
from rosz.msgs.lifecycle_msgs.srv import (
    ChangeState,
    ChangeStateRequest,
    GetAvailableTransitions,
    GetState,
)
from rosz.msgs.service_msgs.msg import ServiceEventInfo
from rosz.msgs.std_srvs.srv import SetBool
from rosz.node import Node

from .conftest import Ros2

LAUNCH = """<launch>
  <arg name="rate" default="2" doc="messages per second"/>
  <node pkg="talking" type="talk" name="talk" output="screen" required="true"/>
</launch>
"""


@pytest.mark.parametrize(
    ("words", "out"),
    [
        (
            "interface show geometry_msgs/msg/PointStamped --no-comments",
            "std_msgs/Header header\n\tbuiltin_interfaces/Time stamp\n\t\tint32 sec\n\t\tuint32"
            " nanosec\n\tstring frame_id\nPoint point\n\tfloat64 x\n\tfloat64 y\n\tfloat64 z\n",
        ),
        (
            "interface show std_srvs/srv/SetBool --no-comments",
            "bool data\n---\nbool success\nstring message\n",
        ),
        ("interface proto std_srvs/srv/SetBool --no-quotes", "data: false\n\n"),
        ("interface package std_srvs -m", ""),
        ("pkg xml turtlesim -t name", "turtlesim\n"),
        ("daemon status", "The daemon is not running\n"),
        ("daemon stop", "The daemon is not running\n"),
    ],
)
def test_prints(ros2: Ros2, words: str, out: str) -> None:
    assert ros2(*words.split()) == (0, out, "")


def test_show_reads_a_name(ros2: Ros2) -> None:
    piped = ros2("interface", "show", "-", "--no-comments", text="std_msgs/msg/String\n")
    assert piped == (0, "string data\n", "")
    assert "# " in ros2("interface", "show", "geometry_msgs/msg/Twist").out


def test_lists_of_interfaces(ros2: Ros2) -> None:
    messages = ros2("interface", "list", "-m").out.splitlines()
    assert messages[0] == "Messages:"
    assert "    std_msgs/msg/String" in messages
    everything = ros2("interface", "list").out.splitlines()
    assert "    std_srvs/srv/SetBool" in everything[everything.index("Services:") :]
    assert "    example_interfaces/action/Fibonacci" in everything[everything.index("Actions:") :]
    packages = ros2("interface", "packages").out.splitlines()
    assert packages == sorted(packages)
    assert {"std_msgs", "std_srvs"} <= set(packages)


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ("interface show std_msgs/String", "Invalid name 'std_msgs/String'. Expected three parts"),
        ("interface show foo/msg/Bar", "Unknown package 'foo'"),
        ("interface show std_msgs/msg/Nope", "Could not find the interface 'std_msgs/msg/Nope'"),
        ("interface package foo", "Unknown package 'foo'"),
        ("pkg xml foo", "Package not found"),
        ("pkg xml turtlesim -t nope", "XML tag not found"),
        ("run talking nope", "No executable found"),
        ("launch foo bar.launch", "Package 'foo' not found"),
        ("launch turtlesim bar.launch", "file 'bar.launch' was not found in the share directory"),
        ("launch one.launch rate=3", "malformed launch argument 'rate=3', expected format"),
        ("service info /nothing", "Unknown service '/nothing'"),
        ("service call /a std_srvs/Nope {}", "The passed service type is invalid"),
        ("action send_goal /a nope/action/Nope {}", "The passed action type is invalid"),
        ("lifecycle get /nobody", "Node not found"),
        ("param get /nobody a", "Node not found"),
        ("multicast send", "rosz sends no multicast packets"),
    ],
)
def test_refused(ros2: Ros2, words: str, error: str) -> None:
    _workspace(ros2)
    ros2.network.node("somebody")
    code, _, err = ros2(*words.split())
    assert code == 1
    assert err.splitlines()[-1].startswith(error)
    assert "Traceback" not in err


def _workspace(ros2: Ros2) -> Path:
    folder = ros2.network.folder
    (folder / "src").mkdir()
    words = ["--build-type", "ament_python", "--node-name", "talk", "--license", "MIT"]
    there = ["--destination-directory", "src"]
    code, out, err = ros2("pkg", "create", "talking", *words, *there)
    assert (code, err) == (0, "")
    assert out.splitlines()[:2] == ["going to create a new package", "package name: talking"]
    (folder / "one.launch").write_text(LAUNCH)
    return folder / "src" / "talking"


def test_a_package_from_its_creation_to_a_launch(ros2: Ros2) -> None:
    package = _workspace(ros2)
    assert (package / "LICENSE").exists()
    assert ros2("pkg", "executables", "talking") == (0, "talking talk\n", "")
    assert ros2("pkg", "xml", "talking", "-t", "license").out == "MIT\n"
    assert ros2("run", "talking", "talk") == (0, "Hi from talking.\n", "")
    (package / "talking" / "talk.py").write_text("def main():\n    return 3\n")
    assert ros2("run", "talking", "talk") == (
        3,
        "[ros2run]: Process exited with failure 3\n",
        "",
    )
    assert ros2("launch", "one.launch", "-s").out == (
        "Arguments (pass arguments as '<name>:=<value>'):\n\n    'rate':\n"
        "        messages per second\n        (default: '2')\n"
    )
    (package / "talking" / "talk.py").write_text("def main():\n    print('said')\n")
    launched = ros2("launch", "one.launch", "rate:=3")
    assert "said" in launched.out


def test_a_package_that_is_there(ros2: Ros2) -> None:
    _workspace(ros2)
    again = ros2("pkg", "create", "talking", "--destination-directory", "src")
    assert again == (
        1,
        "",
        "\nAborted!\nThe directory already exists: src/talking\nEither remove the directory or"
        " choose a different destination directory or package name\n",
    )
    made = ros2("pkg", "create", "moving", "--node-name", "go", "--dependencies", "rclcpp")
    assert made.code == 0
    assert "creating source and include folder\ncreating folder ./moving/src\n" in made.out
    text = (ros2.network.folder / "moving" / "CMakeLists.txt").read_text()
    assert "find_package(rclcpp REQUIRED)\n" in text
    assert "add_executable(go src/go.cpp)" in text


def test_run_passes_signals_on(ros2: Ros2) -> None:
    package = _workspace(ros2)
    code = "import time\ndef main():\n    print('up', flush=True)\n    time.sleep(1000)\n"
    (package / "talking" / "talk.py").write_text(code)
    program = ros2.start("run", "talking", "talk")
    program.wait_for("up")
    program.send(signal.SIGTERM)
    assert program.exit_code() != 0


def test_doctor(ros2: Ros2) -> None:
    node = ros2.network.node("talker")
    node.publisher("/alone", State)
    report = ros2("doctor", "--report")
    assert report.code == 0
    assert "\n   TOPIC LIST\n" in report.out
    assert "topic               : /alone\n" in report.out
    assert "publisher count     : 1\n" in report.out
    done = ros2("doctor")
    assert done.code == 0
    assert "checks passed" in done.out or "check(s) failed" in done.out


def _with_lifecycle(node: Node) -> None:
    """Let a node have a lifecycle of two states."""
    states = [State(1, "unconfigured"), State(2, "inactive")]
    way = TransitionDescription(Transition(1, "configure"), states[0], states[1])
    here = [0]

    def change(request: ChangeStateRequest) -> bool:
        here[0] = 1
        return bool(request.transition.id == 1)

    node.service("~/get_state", GetState, lambda _: [states[here[0]]])
    node.service("~/get_available_transitions", GetAvailableTransitions, lambda _: [[way]])
    node.service("~/get_transition_graph", GetAvailableTransitions, lambda _: [[way]])
    node.service("~/change_state", ChangeState, change)


def test_lifecycle(ros2: Ros2) -> None:
    ros2.network.node("plain")
    _with_lifecycle(ros2.network.node("lc"))
    assert ros2("lifecycle", "nodes") == (0, "/lc\n", "")
    assert ros2("lifecycle", "get", "/lc") == (0, "unconfigured [1]\n", "")
    assert ros2("lifecycle", "list", "lc").out == (
        "- configure [1]\n\tStart: unconfigured\n\tGoal: inactive\n"
    )
    refused = ros2("lifecycle", "set", "/lc", "fly")
    assert refused == (
        1,
        "",
        "Unknown transition requested, available ones are:\n- configure [1]\n",
    )
    assert ros2("lifecycle", "set", "/lc", "configure") == (0, "Transitioning successful\n", "")
    assert ros2("lifecycle", "get").out == "/lc: inactive [2]\n"


def test_echo_of_a_service(ros2: Ros2) -> None:
    """A service that is introspected publishes an event for each step of a call."""
    node = ros2.network.node("switch")
    text = node.context.types.definition("std_srvs/srv/SetBool").text
    kind = "std_srvs/srv/SetBool_Event"
    event = class_of(Channel("", kind, definition=text, language="ros2msg"), node.context.types)
    node.service("/enable", SetBool, lambda _: [True, ""])
    publisher = node.publisher("/enable/_service_event", event, latch=True)
    program = ros2.start("service", "echo", "/enable", "std_srvs/srv/SetBool")
    publisher.wait_for_subscribers(1, 50)
    publisher.publish(event(info=ServiceEventInfo(event_type=1)))
    program.wait_for("event_type: REQUEST_RECEIVED")
    program.wait_for("---")
    program.send(signal.SIGINT)
    assert program.exit_code() == 2


def test_a_parameter_file(ros2: Ros2) -> None:
    node = ros2.network.node("robot")
    node.params.set("~rate", 1.5)
    file = ros2.network.folder / "params.yaml"
    dumped = ros2("param", "dump", "/robot")
    assert dumped.code == 0
    file.write_text(dumped.out.replace("1.5", "4.5").replace("    use_sim_time: false\n", ""))
    assert ros2("param", "load", "robot", str(file)) == (
        0,
        "Set parameter rate successful\n",
        "",
    )
    assert node.params["~rate"] == 4.5
    file.write_text("/other:\n  ros__parameters:\n    a: 1\n")
    refused = ros2("param", "load", "/robot", str(file))
    assert refused == (1, "", "Param file does not contain any valid parameters\n")
    assert ros2("param", "get", "/robot", "rate").out == "Double value is: 4.5\n"
    assert ros2("param", "list", "/robot", "--filter", "ra.*").out == "  rate\n"
