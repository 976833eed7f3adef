from __future__ import annotations

from typing import Any

import pytest
from network import Network

from rosz.msgs.rospy_tutorials.srv import AddTwoInts
from rosz.msgs.std_srvs.srv import SetBool, Trigger
from rosz.node import Node

from .shell import Shell


@pytest.fixture
def server(network: Network) -> Node:
    """A node that adds, and does something, and fails."""

    def fail(_: object) -> Any:
        raise RuntimeError("out of order")

    node = network.node("server")
    node.service("/add", AddTwoInts, lambda request: request.a + request.b)
    node.service("/robot/trigger", Trigger, lambda _: (True, "done"))
    node.service("/robot/fail", SetBool, fail)
    return node


pytestmark = pytest.mark.usefixtures("server")


def ours(lines: list[str]) -> list[str]:
    """Leave out the services that every node has."""
    return [line for line in lines if not line.startswith("/server/")]


def test_list(shell: Shell) -> None:
    assert ours(shell("service", "list").lines) == ["/add", "/robot/fail", "/robot/trigger"]
    assert shell("service", "list", "/robot").lines == ["/robot/fail", "/robot/trigger"]


def test_list_with_nodes_and_types(shell: Shell) -> None:
    assert "/add /server" in shell("service", "list", "-n").lines
    assert "/add [rospy_tutorials/AddTwoInts]" in shell("service", "list", "-t").lines
    assert shell("service", "list", "--json", "/add").json == [
        {"name": "/add", "types": ["rospy_tutorials/AddTwoInts"], "nodes": ["/server"]}
    ]


def test_info(shell: Shell) -> None:
    node, uri, kind, arguments = shell("service", "info", "/add").lines
    assert (node, kind, arguments) == (
        "Node: /server",
        "Type: rospy_tutorials/AddTwoInts",
        "Args: a b",
    )
    assert uri.startswith("URI: 42/add/rospy_tutorials::srv::dds_::AddTwoInts_/RIHS01_")
    found = shell("service", "info", "--json", "/add").json
    assert found["args"] == ["a", "b"]


@pytest.mark.parametrize(
    ("question", "answer"),
    [
        ("type", "rospy_tutorials/AddTwoInts"),
        ("args", "a b"),
        ("node", "/server"),
    ],
)
def test_questions(shell: Shell, question: str, answer: str) -> None:
    assert shell("service", question, "add").out == f"{answer}\n"


def test_uri_is_the_key(shell: Shell) -> None:
    assert shell("service", "uri", "/add").out.startswith("42/add/")


def test_find(shell: Shell) -> None:
    assert shell("service", "find", "std_srvs/Trigger").lines == ["/robot/trigger"]
    assert shell("service", "find", "--json", "nope/Nope").json == []


@pytest.mark.parametrize("question", ["type", "args", "node", "uri", "info", "call"])
def test_an_unknown_service_names_the_near_miss(shell: Shell, question: str) -> None:
    result = shell("service", question, "/robot/triger")
    assert result.code == (2 if question in {"args", "call"} else 1)
    assert result.err == "ERROR: unknown service '/robot/triger'; did you mean '/robot/trigger'?\n"


@pytest.mark.parametrize("values", [["1", "2"], ["{a: 1, b: 2}"], ["b: 3"]])
def test_call(shell: Shell, values: list[str]) -> None:
    assert shell("service", "call", "/add", *values).out == "sum: 3\n"


def test_call_without_arguments(shell: Shell) -> None:
    assert shell("service", "call", "/robot/trigger").lines == ["success: True", 'message: "done"']


def test_verbose_call_prints_the_request(shell: Shell) -> None:
    assert shell("service", "call", "-v", "/add", "1", "2").out == "a: 1\nb: 2\n---\nsum: 3\n"


def test_call_as_json(shell: Shell) -> None:
    assert shell("service", "call", "--json", "/add", "1", "2").json == {"sum": 3}
    found = shell("service", "call", "--json", "-v", "/add", "1", "2").json
    assert found == {"request": {"a": 1, "b": 2}, "response": {"sum": 3}}


def test_calls_from_standard_input(shell: Shell) -> None:
    result = shell("service", "call", "/add", stdin="{a: 1}\n---\n[2, 3]\n---\nunfinished")
    assert result.lines == ["sum: 1", "sum: 5"]


def test_call_of_a_failing_service(shell: Shell) -> None:
    result = shell("service", "call", "/robot/fail", "true")
    assert result.code == 2
    assert "service [/robot/fail] responded with an error" in result.err
    assert "out of order" in result.err


@pytest.mark.parametrize(
    ("values", "code", "text"),
    [
        (["1"], 2, "AddTwoIntsRequest: expected 2 values for the fields (a, b), got 1\n"),
        (["{c: 1}"], 2, "AddTwoIntsRequest: it has no field 'c'; it has a, b\n"),
        (["-x"], 2, "no such option: -x; see 'rosz service call --help'\n"),
        (["1", "x"], 2, "expected int64, got str 'x'"),
        (["[1"], 2, "value 1, '[1', is not YAML"),
        (["--timeout", "0", "1", "2"], 2, "--timeout is 0"),
        (["--timeout", "inf", "1", "2"], 2, "--timeout is inf; expected seconds above 0"),
    ],
)
def test_call_with_wrong_values(shell: Shell, values: list[str], code: int, text: str) -> None:
    result = shell("service", "call", "/add", *values)
    assert result.code == code
    assert text in result.err


def test_call_without_values_on_a_terminal(shell: Shell) -> None:
    result = shell("service", "call", "/add", terminal=True)
    assert result.code == 2
    assert "no values are given; they are: a b" in result.err


def test_call_waits_for_a_service(shell: Shell, server: Node) -> None:
    call = shell.start("service", "call", "--wait", "/later")
    call.wait_for("service [/later] is not there yet")
    server.service("/later", Trigger, lambda _: (True, "at last"))
    assert call.exit_code() == 0
    assert call.lines[-1] == 'message: "at last"'


def test_call_ends_at_its_timeout(shell: Shell, server: Node) -> None:
    server.service("/slow", Trigger, lambda _: server.sleep(60))
    result = shell("service", "call", "--timeout", "0.2", "/slow")
    assert result.code == 2
    assert "no answer of service '/slow' within 0.2 s" in result.err


@pytest.mark.parametrize(
    "words", [["-1", "-2"], ["--", "-1", "-2"], ["-1", "-2", "--timeout", "9"]]
)
def test_negative_values_are_not_options(shell: Shell, words: list[str]) -> None:
    assert shell("service", "call", "/add", *words).lines == ["sum: -3"]
