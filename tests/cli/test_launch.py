"""``rosz launch`` as a person uses it: the example, with nothing started before it."""

from __future__ import annotations

import re
import signal
import subprocess

import pytest
from network import Network, Program, eventually

from .command import ROSZ, package
from .launching import EXAMPLE, Start, rosz, runs, started

HEARD = re.compile(
    r"\[INFO\] \[\d{10}\.\d{6}\] \[/listeners/subscriber\]: I heard (\d+)$", re.MULTILINE
)


def heard(program: Program) -> list[int]:
    """Return the numbers that the example's subscriber has logged."""
    return [int(number) for number in HEARD.findall(program.output)]


def hears(program: Program, at_least: int = 0) -> None:
    """Wait until the example's subscriber has logged a number, at least so high.

    The first ones may be missed: the publisher does not wait for the subscriber to start.
    """
    try:
        eventually(
            lambda: max(heard(program), default=-1) >= at_least, f"a number from {at_least} on"
        )
    except pytest.fail.Exception as error:
        raise AssertionError(program.output) from error


def test_the_example(launch: Start, network: Network) -> None:
    run = launch(EXAMPLE)
    hears(run)
    hears(run, 12)
    numbers = heard(run)
    assert numbers == list(range(numbers[0], numbers[-1] + 1))
    pids = started(run)
    assert list(pids) == ["publisher", "listeners/subscriber"]
    with network.node("asker") as node:
        params = node.context.params
        assert params.get("/publisher") == {
            "rate": 2.0,
            "start": 10,
            "step": 1,
            "unit": {"name": "apples", "plural": True},
        }
        assert params.get("/tutorial") == "pub_and_sub"
        # The publisher's next read sees what somebody sets.
        params.set("/publisher/step", 1000)
        eventually(lambda: any(number > 1000 for number in heard(run)), "a larger step")
    run.send(signal.SIGINT)
    assert run.exit_code() == 0
    assert "escalating" not in run.output
    assert not any(map(runs, pids.values()))
    assert "Traceback" not in run.output


def test_args_override_defaults(launch: Start) -> None:
    run = launch(EXAMPLE, "rate:=50", "greeting:=Got")
    run.wait_for("[/listeners/subscriber]: Got 30")


def test_lines_can_be_prefixed(launch: Start) -> None:
    run = launch(EXAMPLE, "--prefix", "rate:=20")
    assert run.wait_for("I heard 25").startswith("[listeners/subscriber-2] [INFO] [")


def test_another_launch_joins(launch: Start, network: Network) -> None:
    first = launch(EXAMPLE)
    hears(first)
    more = network.folder / "more.launch"
    more.write_text(
        '<launch><param name="more" value="1"/>'
        '<node pkg="rosz_tutorials" type="subscriber.py" name="other" output="screen">'
        '<remap from="numbers" to="counter"/></node></launch>'
    )
    second = launch(str(more))
    second.wait_for("I heard ")
    run_id = re.findall(r"setting /run_id to (.*)", first.output)
    assert len(run_id) == 1
    assert "setting /run_id" not in second.output
    assert f"/log/{run_id[0]}/roslaunch-" in second.output
    status = rosz(network, "launch", "--status")
    assert status.returncode == 0, status.stderr
    for name in ("/publisher", "/listeners/subscriber", "/other"):
        assert re.search(rf"^  {name} +running +\d+ +0 +\d+ % +\d+ MB", status.stdout, re.MULTILINE)


def test_a_node_can_be_restarted_from_another_terminal(launch: Start, network: Network) -> None:
    run = launch(EXAMPLE, "rate:=20")
    hears(run)
    before = started(run)
    assert rosz(network, "launch", "--restart", "/publisher").returncode == 0
    run.wait_for("[publisher-1] restart requested")
    eventually(lambda: heard(run) != sorted(heard(run)), "a count from the beginning")
    run.wait_for("process[publisher-1]: started", times=2)  # which another process writes
    after = started(run)
    assert after["publisher"] != before["publisher"]
    assert after["listeners/subscriber"] == before["listeners/subscriber"]
    assert rosz(network, "launch", "--stop", "/publisher").returncode == 0
    assert not runs(after["publisher"])
    refused = rosz(network, "launch", "--stop", "/publisherr")
    assert refused.stderr == (
        "ERROR: no launch runs a node '/publisherr'; did you mean '/publisher'?\n"
    )
    assert refused.returncode == 1


def test_a_killed_launch_takes_its_nodes_along(launch: Start, network: Network) -> None:
    first = launch(EXAMPLE, "rate:=20")
    hears(first)
    first.send(signal.SIGKILL)
    eventually(lambda: not any(map(runs, started(first).values())), "the end of the nodes")
    assert rosz(network, "node", "list").stdout == ""
    second = launch(EXAMPLE, "rate:=20")
    hears(second)
    second.send(signal.SIGINT)
    assert second.exit_code() == 0


def test_wait_for_on_the_live_graph(launch: Start, network: Network) -> None:
    demo = package(
        network.folder / "src",
        "demo",
        talker="#!/usr/bin/env python3\n"
        "import rosz\n"
        "from std_msgs.msg import String\n"
        "with rosz.Node('talker') as node:\n"
        "    node.publisher('chatter', String)\n"
        "    node.spin()\n",
        done="#!/bin/sh\nexit 0\n",
    )
    file = demo / "wait.launch"
    file.write_text(
        "<launch>"
        '<node pkg="demo" type="done" name="late" required="true"'
        ' wait_for="topic /chatter, node /talker, param /go" wait_timeout="300"/>'
        '<node pkg="demo" type="talker" name="talker" spawn_delay="0.3"/>'
        "</launch>"
    )
    run = launch(str(file))
    run.wait_for("process[talker-2]: started")
    with network.node("setter") as node:
        node.context.params.set("/go", 1)
        run.wait_for("process[late-1]: started")
    assert run.exit_code() == 0


def test_wait_waits_for_another_process(launch: Start, network: Network) -> None:
    run = launch("--wait", EXAMPLE)
    run.wait_for("nobody else is there yet; waiting for a core or another launch")
    with network.node("somebody") as node:
        node.context.params.set("/here", True)
        hears(run)


def test_errors_of_nodes_are_lines(launch: Start, network: Network) -> None:
    file = network.folder / "bad.launch"
    file.write_text(
        '<launch><node pkg="rosz_tutorials" type="publishr.py" name="a"/>'
        '<node pkg="rosz_tutorial" type="publisher.py" name="b"/></launch>'
    )
    run = launch(str(file))
    assert run.exit_code() == 1
    assert run.wait_for("[rosz_tutorials/publishr.py]: ").endswith("did you mean 'publisher.py'?")
    assert run.wait_for("[rosz_tutorial/publisher.py]: ").endswith("did you mean 'rosz_tutorials'?")


def test_a_home_that_cannot_be_created_is_reported(launch: Start, network: Network) -> None:
    (network.folder / "file").touch()
    run = launch(EXAMPLE, ROS_HOME=str(network.folder / "file" / "ros"))
    assert run.exit_code() == 1
    assert run.wait_for("cannot start in ").endswith(
        "; set ROS_HOME to a folder that can be written to"
    )


def test_a_package_just_created_runs(launch: Start, network: Network) -> None:
    made = subprocess.run(
        [*ROSZ, "pkg", "create", "mine"],
        cwd=network.folder,
        env=network.variables(),
        capture_output=True,
        text=True,
        check=True,
    )
    command = made.stdout.partition("run it with: rosz launch ")[2].split()
    run = launch(*command, "rate:=20")
    run.wait_for("published 3")


def test_a_launch_within_a_launch_ends_with_it(launch: Start, network: Network) -> None:
    file = network.folder / "outer.launch"
    words = " ".join([*ROSZ, "launch", EXAMPLE])
    file.write_text(f'<launch><executable cmd="{words}" name="inner" output="screen"/></launch>')
    run = launch(str(file))
    hears(run)
    pids = started(run)
    assert len(pids) == 3
    run.send(signal.SIGINT)
    assert run.exit_code() == 0
    assert not any(map(runs, pids.values()))
