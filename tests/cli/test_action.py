from __future__ import annotations

import shlex
import signal
import time
from pathlib import Path
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

from rosz.msgs.example_interfaces.action import Fibonacci
from rosz.node import Node
from rosz.node.actions import ClientGoal

from .shell import Shell


def execute(goal: Any) -> None:
    """Count; a negative order waits to be cancelled."""
    goal.feedback(Fibonacci.Feedback([goal.request.order]))
    if goal.request.order < 0:
        assert goal.wait_for_cancel(TIMEOUT)
        goal.canceled(Fibonacci.Result([-1]))
        return
    if goal.request.order == 13:
        goal.abort()
    else:
        goal.succeed(Fibonacci.Result([0, 1]))


@pytest.fixture
def server(network: Network) -> Node:
    node = network.node("server")
    node.action_server("/robot/fib", Fibonacci, execute, goal=lambda goal: goal.order != 99)
    return node


pytestmark = pytest.mark.usefixtures("server")


def test_list_and_info(shell: Shell, network: Network) -> None:
    user = network.node("user")
    client = user.action_client("/robot/fib", Fibonacci)
    client.wait_for_server(TIMEOUT)
    assert shell("action", "list").lines == ["/robot/fib"]
    assert shell("action", "list", "-t").lines == [
        "/robot/fib [example_interfaces/action/Fibonacci]"
    ]
    assert shell("action", "info", "/robot/fib").lines == [
        "Action: /robot/fib",
        "Type: example_interfaces/action/Fibonacci",
        "Action servers: 1",
        "    /server",
        "Action clients: 1",
        "    /user",
    ]
    assert shell("action", "info", "--json", "/robot/fib").json["clients"] == ["/user"]
    assert shell("action", "type", "/robot/fib").lines == ["example_interfaces/action/Fibonacci"]


def test_show(shell: Shell) -> None:
    expected = ["int32 order", "---", "int32[] sequence", "---", "int32[] sequence"]
    shown = shell("action", "show", "example_interfaces/Fibonacci").lines
    assert [line for line in shown if line] == expected
    assert shell("action", "show", "Fibonacci").lines[0].startswith("[")
    assert "--- " not in shell("action", "show", "-r", "example_interfaces/Fibonacci").out


def test_send(shell: Shell) -> None:
    lines = shell("action", "send", "/robot/fib", "5").lines
    assert lines[0].startswith("goal ")
    assert lines[1:] == ["result:", "  sequence: [0, 1]", "goal succeeded"]
    found = shell("action", "send", "--json", "/robot/fib", "{order: 3}").json
    assert found == {"status": "succeeded", "result": {"sequence": [0, 1]}}


def test_send_with_feedback(shell: Shell) -> None:
    program = shell.start("action", "send", "-f", "/robot/fib", "-1")
    program.wait_for("accepted")
    program.wait_for("---")  # before its end, which may overtake feedback
    assert "feedback:\n  sequence: [-1]\n---" in program.output
    program.send(signal.SIGINT)
    program.wait_for("goal canceled")


@pytest.mark.parametrize(
    "words",
    [
        "action send -f /robot/fib 5",
        "ros2 action send_goal -f /robot/fib example_interfaces/action/Fibonacci '{order: 5}'",
    ],
)
def test_feedback_that_the_result_overtakes(
    shell: Shell, monkeypatch: pytest.MonkeyPatch, words: str
) -> None:
    receive = ClientGoal.receive_feedback

    def receive_late(goal: ClientGoal, feedback: Any) -> None:
        goal.wait(TIMEOUT)
        time.sleep(0.02)  # the delay of a slow network
        receive(goal, feedback)

    monkeypatch.setattr(ClientGoal, "receive_feedback", receive_late)
    result = shell(*shlex.split(words))
    assert result.code == 0, result
    assert "feedback:" in result.out.lower().partition("result:")[0]


@pytest.mark.parametrize(
    ("words", "code", "text"),
    [
        (["/robot/fib", "13"], 1, ""),
        (["/robot/fib", "99"], 1, "rejected the goal"),
        (["/robot/fib", "x"], 1, "order"),
        (["/robot/fob"], 1, "unknown action '/robot/fob'; did you mean '/robot/fib'?"),
        (["/robot/fib", "[1"], 2, "is not YAML"),
    ],
)
def test_what_goes_wrong(shell: Shell, words: list[str], code: int, text: str) -> None:
    result = shell("action", "send", *words)
    assert result.code == code, result
    assert text in result.err


def test_interrupt_cancels_the_goal(shell: Shell) -> None:
    program = shell.start("action", "send", "/robot/fib", "-1")
    program.wait_for("accepted")
    program.send(signal.SIGINT)
    program.wait_for("goal canceled")
    assert program.exit_code() == 1


def test_waiting_for_a_server(shell: Shell, network: Network, server: Node) -> None:
    late = network.node("late")
    eventually(lambda: len(server.context.session.links()) == 1, "the link to the other node")
    program = shell.start("action", "send", "--wait", "/late", "1")
    eventually(lambda: len(server.context.session.links()) > 1, "the link to the command")
    late.action_server("/late", Fibonacci, execute)
    program.wait_for("goal succeeded")
    assert program.exit_code() == 0


DIG = """
string<=5 word "deep"
dig_msgs/Layer[] layers
float64[2] place
int8[<=3] few
---
---
dig_msgs/Layer at
builtin_interfaces/Time stamp
"""

DIGGER = """
    import threading, rosz

    with rosz.Node("digger") as node:
        types = node.context.types
        Dig, Layer = types.action("dig_msgs/Dig"), types.message("dig_msgs/Layer")

        def execute(goal):
            for layer in goal.request.layers:
                goal.feedback(Dig.Feedback(at=layer))
            input()
            print("got", goal.request.word, list(goal.request.place), flush=True)
            goal.succeed()

        node.action_server("/dig", Dig, execute)
        print("ready", flush=True)
        threading.Event().wait()
"""


def test_an_action_of_unknown_type_is_described_by_its_server(
    shell: Shell, network: Network, tmp_path: Path
) -> None:
    package = tmp_path / "dig_msgs"
    for folder, text in {"action/Dig.action": DIG, "msg/Layer.msg": "float32 depth\n"}.items():
        (package / folder).parent.mkdir(parents=True)
        (package / folder).write_text(text)
    (package / "package.xml").write_text("<package><name>dig_msgs</name></package>")
    program = network.program(DIGGER, ROSZ_PACKAGE_PATH=str(tmp_path))
    program.wait_for("ready")
    goal = "{word: sand, layers: [{depth: 0.5}], place: [1, 2], few: [7]}"
    sent = shell.start("action", "send", "-f", "/dig", goal)
    sent.wait_for("    depth: 0.5")
    program.say("")
    sent.wait_for("goal succeeded")
    assert sent.exit_code() == 0
    assert program.wait_for("got") == "got sand [1.0, 2.0]"
    refused = shell("action", "send", "/dig", "{word: gravel}")
    assert (refused.code, "word" in refused.err) == (1, True)
