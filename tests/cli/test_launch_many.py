"""Launches of many nodes come up and end without a complaint, and stubborn ones end in time."""

from __future__ import annotations

import re
import signal
import time
from pathlib import Path

import pytest
from network import Network, eventually, repeats

from rosz.session import is_listening

from .command import package
from .launching import Start, runs, started

INTERRUPTED = re.compile(
    r"Exception ignored in: .*\nTraceback .*\n(  .*\n)*"
    r"ResourceWarning: unclosed (file .*\.pyc'|<socket\.socket fd=\d+, family=1, .*)>"
)
"""What Python with all warnings says of a signal that ends an import, or that comes between the
making of a socket, as of one that looks for the core, and the block that closes it."""

TALKER = """#!/usr/bin/env python3
import os
from contextlib import suppress
import rosz
from std_msgs.msg import String
# Ctrl-C may come anywhere in the program, as right after it wrote.
with suppress(KeyboardInterrupt), rosz.Node("talker") as node:
    chatter = node.publisher("chatter", String)
    os.write(1, b"up\\n")  # one write, which those of other nodes cannot part
    for _ in node.rate(2):
        chatter.publish(String(data=node.name))
"""
STUBBORN = "#!/bin/sh\ntrap '' INT TERM\necho up\nwhile :; do sleep 1; done\n"
UP = re.compile("^up$")
EXPECTED = re.compile(
    r"up$|$|\.\.\. |SUMMARY|=+$|NODES|  /|    n\d+ \(|auto-starting|process\[|setting /run_id"
    r"|\[n\d+-\d+\] killing on exit$|shutting down|done$"
    r"|no replica of the parameters answered in 5 s"  # where far more runs than there are cores
)


def fleet(folder: Path, script: str, count: int) -> str:
    """Write a launch file of so many nodes, and return its path."""
    demo = package(folder / "src", "fleet", node=script)
    nodes = (
        f'<node pkg="fleet" type="node" name="n{number}" output="screen"/>'
        for number in range(count)
    )
    file = demo / "fleet.launch"
    file.write_text(f"<launch>{''.join(nodes)}</launch>")
    return str(file)


def test_many_nodes_start_and_stop(launch: Start, network: Network) -> None:
    count = repeats(26, 100)  # more than form a mesh
    run = launch(fleet(network.folder, TALKER, count))
    run.wait_for(UP, 100, times=count)
    run.send(signal.SIGINT)
    assert run.exit_code() == 0
    pids = started(run)
    assert [line for line in run.lines if not EXPECTED.match(line)] == []
    assert len(pids) == count
    assert "process[core]: started" in run.output
    assert not any(map(runs, pids.values()))


def test_a_killed_launch_takes_its_core_along(launch: Start, network: Network) -> None:
    run = launch(fleet(network.folder, STUBBORN, 1), ROSZ_CONNECT="tcp/127.0.0.1:9")
    run.wait_for(UP)
    run.wait_for("started with pid", times=2)
    pids = [int(pid) for pid in re.findall(r"started with pid \[(\d+)\]", run.output)]
    assert len(pids) == 2
    run.send(signal.SIGKILL)
    eventually(lambda: not any(map(runs, pids)), "the end of both")


def test_a_launch_killed_as_its_core_comes_up_leaves_none(launch: Start, network: Network) -> None:
    run = launch(fleet(network.folder, STUBBORN, 1), ROSZ_CONNECT="tcp/127.0.0.1:9")
    eventually(lambda: is_listening(network.rendezvous), "the core")
    run.send(signal.SIGKILL)
    eventually(lambda: not is_listening(network.rendezvous), "the end of the core")
    eventually(lambda: not any(map(runs, started(run).values())), "the end of the node")


def test_twenty_stubborn_nodes_end_in_time(launch: Start, network: Network) -> None:
    file = fleet(network.folder, STUBBORN, 20)
    run = launch("--sigint-timeout", "0.5", "--sigterm-timeout", "3", file)
    run.wait_for(UP, times=20)
    begin = time.monotonic()
    run.send(signal.SIGINT)
    assert run.exit_code() == 0
    assert time.monotonic() - begin >= 3.5
    signals = re.findall(r"escalating to (SIG\w+)", run.output)
    # All at the same time, or as near to it as a busy machine is.
    assert signals == ["SIGTERM"] * 20 + ["SIGKILL"] * 20
    assert run.output.count("did not end when asked to, and was killed") == 20
    assert not any(map(runs, started(run).values()))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGQUIT])
def test_a_launch_ended_as_its_core_comes_up_leaves_none(
    launch: Start, network: Network, number: signal.Signals
) -> None:
    file = fleet(network.folder, TALKER, 26)
    for _ in range(repeats(1, 20)):
        run = launch(file)
        eventually(lambda: is_listening(network.rendezvous), "the core")
        run.send(number)
        assert run.exit_code() in {0, 130}
        assert "Traceback" not in INTERRUPTED.sub("", run.output)
        assert not is_listening(network.rendezvous)
        assert not any(map(runs, started(run).values()))
