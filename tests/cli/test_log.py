from __future__ import annotations

import json
import re
import signal

import pytest
from network import Network, Program

from rosz.node import Node

from .shell import Shell


@pytest.fixture
def busy(network: Network) -> Node:
    """A node that logs twenty times a second."""
    node = network.node("busy", namespace="/ns")
    arm = node.log.child("arm")

    def log(_: object) -> None:
        node.log.info("all is well")
        arm.warning("it hurts")
        node.log.debug("details")

    node.timer(0.05, log)
    return node


pytestmark = pytest.mark.usefixtures("busy")


def follow(shell: Shell, *words: str) -> Program:
    return shell.start("log", *words)


def test_follow(shell: Shell) -> None:
    log = follow(shell, "-n", "4")
    assert log.exit_code() == 0
    assert len(log.lines) == 4
    for line in log.lines:
        assert re.fullmatch(
            r"\[INFO\] \[\d{10}\.\d{6}\] \[/ns/busy\]: all is well"
            r"|\[WARN\] \[\d{10}\.\d{6}\] \[/ns/busy\.arm\]: it hurts",
            line,
        )


def test_a_level(shell: Shell) -> None:
    log = follow(shell, "-n", "2", "--level", "warn")
    assert log.exit_code() == 0
    assert all(line.endswith("it hurts") for line in log.lines)


def test_nodes(shell: Shell, network: Network) -> None:
    other = network.node("other")
    other.timer(0.02, lambda _: other.log.info("not me"))
    for name in ("/ns", "/ns/busy", "ns/busy"):
        log = follow(shell, "-n", "2", name)
        assert log.exit_code() == 0
        assert all("[/ns/busy" in line for line in log.lines)


def test_a_pattern(shell: Shell) -> None:
    log = follow(shell, "-n", "2", "--grep", "is w.ll")
    assert log.exit_code() == 0
    assert all(line.endswith("all is well") for line in log.lines)


def test_places(shell: Shell) -> None:
    log = follow(shell, "-n", "1", "-v")
    assert log.exit_code() == 0
    assert re.fullmatch(rf"    at {re.escape(__file__)}:\d+ in .*log", log.lines[1])


def test_json(shell: Shell) -> None:
    log = follow(shell, "-n", "1", "--json", "--level", "WARN")
    assert log.exit_code() == 0
    line = json.loads(log.lines[0])
    assert (line["level"], line["node"], line["text"]) == ("WARN", "/ns/busy.arm", "it hurts")


def test_it_ends_when_stopped(shell: Shell) -> None:
    log = follow(shell)
    log.wait_for("all is well")
    log.send(signal.SIGINT)
    assert log.exit_code() == 0


def answer(shell: Shell, *words: str) -> str:
    asked = follow(shell, *words)
    assert asked.exit_code() == 0
    return asked.output


def test_levels(shell: Shell) -> None:
    # As processes of their own: what the node writes meanwhile goes to the stdout of this one.
    assert answer(shell, "levels", "/ns/busy") == "rosout INFO\nrosout.arm INFO"
    assert answer(shell, "level", "ns/busy", "rosout", "debug") == ""
    found = json.loads(answer(shell, "levels", "--json", "/ns/busy"))
    assert found == {"/ns/busy": {"rosout": "DEBUG", "rosout.arm": "DEBUG"}}
    follow(shell).wait_for("[DEBUG]")


@pytest.mark.parametrize(
    ("words", "code", "text"),
    [
        (["level", "/ns/busy", "rosout", "loud"], 2, "'loud' is not a level"),
        (["level", "/ns/busy", "leg", "INFO"], 1, "has no logger 'leg'"),
        (["level", "/ns/bus", "rosout", "INFO"], 1, "did you mean '/ns/busy'?"),
        (["level", "/ns/busy"], 2, "rosz log level NODE LOGGER LEVEL"),
        (["levels"], 2, "rosz log levels NODE"),
        (["--level", "loud"], 2, "'loud' is not a level"),
        (["-n", "0"], 2, "-n is 0; expected 1 or more lines"),
        (["--grep", "("], 2, "'(' is not a regular expression"),
    ],
)
def test_errors(shell: Shell, words: list[str], code: int, text: str) -> None:
    result = shell("log", *words)
    assert result.code == code
    assert text in result.err
