"""``rosz launch --nodes`` and the like, and all that can be wrong with a command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from .command import package, rosz

FILE = """
<launch>
  <arg name="rate" default="2" doc="how often"/>
  <arg name="topic"/>
  <param name="rate" value="$(arg rate)"/>
  <node pkg="demo" type="node.py" name="talker" ns="a" args="$(arg topic)">
    <env name="X" value="1 2"/>
    <remap from="in" to="/out"/>
  </node>
</launch>
"""


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    demo = package(tmp_path / "src", "demo", node__py="#!/usr/bin/env python3\n")
    (demo / "launch").mkdir()
    (demo / "launch/demo.launch").write_text(FILE)
    return tmp_path


def ask(workspace: Path, *words: str) -> str:
    done = rosz(workspace, "launch", *words, "demo", "demo.launch", "topic:=chat")
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def test_answers(workspace: Path) -> None:
    demo = workspace / "src/demo"
    assert ask(workspace, "--nodes") == "/a/talker\n"
    assert ask(workspace, "--files") == f"{demo}/launch/demo.launch\n"
    assert ask(workspace, "--find-node", "/a/talker") == f"{demo}/launch/demo.launch\n"
    assert ask(workspace, "--dump-params") == "/rate: 2\n\n"
    assert ask(workspace, "--args", "/a/talker") == (
        f'ROS_NAMESPACE="/a" X="1 2" {demo}/scripts/node.py chat in:=/out __name:=talker\n'
    )
    assert ask(workspace, "--ros-args") == (
        'Required Arguments:\n  topic: undocumented\nOptional Arguments:\n  rate (default "2"):'
        " how often\n"
    )
    made = json.loads(ask(workspace, "--dump-plan"))
    assert made["nodes"][0]["name"] == "talker"


def test_args_of_the_command_line(workspace: Path) -> None:
    done = rosz(workspace, "launch", "--dump-params", "demo", "demo.launch", "topic:=x", "rate:=5")
    assert done.stdout == "/rate: 5\n\n"


def test_standard_input_and_several_files(workspace: Path) -> None:
    (workspace / "more.launch").write_text(
        '<launch><arg name="topic"/><param name="more" value="$(arg topic)"/></launch>'
    )
    done = rosz(workspace, "launch", "--dump-params", "more.launch", "-", "topic:=x", text=FILE)
    assert (done.stdout, done.stderr) == ("/more: x\n/rate: 2\n\n", "")


def test_a_package_around_the_file_is_found(tmp_path: Path) -> None:
    demo = package(tmp_path / "elsewhere", "demo", node="#!/bin/sh\n")
    (demo / "x.launch").write_text('<launch><param name="p" value="$(find demo)"/></launch>')
    done = rosz(tmp_path, "launch", "--dump-params", "elsewhere/demo/x.launch")
    assert done.stdout == f"/p: {demo}\n\n"


ERRORS = {
    ("nope.launch",): (1, "ERROR: launch file 'nope.launch' is not there; give its path, or a pac"),
    ("demo.launch",): (1, "; package 'demo' has it: rosz launch demo demo.launch\n"),
    ("demo",): (
        1,
        "'demo' is a package: name one of its launch files as well, such as demo.launch\n",
    ),
    ("rosz_tutorials",): (1, "'rosz_tutorials' is a package, and has no launch files\n"),
    ("src",): (1, "ERROR: 'src' is a folder; name a launch file in it\n"),
    ("src/demo",): (1, "ERROR: 'src/demo' is a folder; name a launch file in it\n"),
    ("dem", "demo.launch"): (1, "ERROR: package 'dem' not found"),
    ("demo", "dem.launch"): (1, "has no file 'dem.launch'; did you mean 'demo.launch'?\n"),
    ("demo", "demo.launch", "x.launch", "topic:=a"): (1, "ERROR: launch file 'x.launch' is not"),
    ("demo", "demo.launch"): (1, "topic"),
    (): (2, "ERROR: no launch file is given: rosz launch PACKAGE FILE, or rosz launch PATH\n"),
    ("-", "-"): (2, "ERROR: '-' is given twice; standard input can be read only once\n"),
    ("--nodes", "--files", "x"): (2, "ERROR: --nodes, --files: only one of them can be answered"),
    ("-p", "11312", "x"): (2, "ERROR: there is no master, and so no port: 'rosz core'"),
    ("--sigint-timeout", "0", "demo", "demo.launch", "topic:=a"): (2, "--sigint-timeout is 0; e"),
    ("--sigterm-timeout", "x"): (2, "ERROR: invalid value for '--sigterm-timeout'"),
    ("--nope",): (2, "ERROR: no such option: --nope"),
    ("--status", "x"): (2, "ERROR: --status, --restart, --stop and --output stand alone"),
    ("--status", "--stop", "/x"): (
        2,
        "ERROR: --status, --restart, --stop and --output stand alone",
    ),
    ("--args", "/a/talkr", "demo", "demo.launch", "topic:=a"): (1, "did you mean '/a/talker'?\n"),
}


@pytest.mark.parametrize("words", ERRORS, ids=" ".join)
def test_errors_are_one_line(workspace: Path, words: tuple[str, ...]) -> None:
    done = rosz(workspace, "launch", *words)
    code, text = ERRORS[words]
    assert text in done.stderr
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (code, "", 1)


def test_assignments_without_effect_are_warnings(workspace: Path) -> None:
    done = rosz(workspace, "launch", "--nodes", "demo", "demo.launch", "topic:=a", "_x:=1")
    assert done.returncode == 0
    assert done.stderr == "WARNING: '_x:=1' is ignored: it is for a node, not for a launch\n"


def test_no_launch_is_running(tmp_path: Path) -> None:
    from .command import free_endpoint

    endpoint = free_endpoint()
    done = rosz(tmp_path, "launch", "--status", variables={"ROSZ_RENDEZVOUS": endpoint})
    assert done.returncode == 1
    assert done.stderr == f"ERROR: no launch is running: nobody answers at {endpoint}\n"


def test_help(tmp_path: Path) -> None:
    done = rosz(tmp_path, "launch", "--help")
    assert done.returncode == 0
    for option in ("--screen", "--required", "--dump-params", "--sigint-timeout", "--restart"):
        assert option in done.stdout


@pytest.mark.parametrize("option", ["--args", "--find-node", "--restart", "--stop"])
def test_a_node_without_a_name_starts_nothing(workspace: Path, option: str) -> None:
    done = rosz(workspace, "launch", "demo", "demo.launch", "topic:=x", option, "")
    expected = f"ERROR: {option} is ''; expected the name of a node\n"
    assert (done.returncode, done.stdout, done.stderr) == (2, "", expected)
