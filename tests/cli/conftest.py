"""What tests of commands share."""

from __future__ import annotations

import secrets
import signal
import subprocess
from collections.abc import Iterator
from contextlib import suppress

import pytest
from network import Network, Program

from rosz.launch.run.process_tree import TAG, ProcessTree
from rosz.msgs.geometry_msgs.msg import Point, Pose, PoseStamped, Twist
from rosz.msgs.std_msgs.msg import Header, String
from rosz.node import Node

from .command import ROSZ
from .launching import Start
from .shell import Shell, latch, with_log


@pytest.fixture
def shell(
    network: Network, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Shell:
    """A shell on a network of its own."""
    return Shell(network, monkeypatch, capsys)


@pytest.fixture
def talker(network: Network) -> Node:
    """A node that has published a pose and a text, and listens to /cmd_vel."""
    node = network.node("talker")
    node.subscription("/cmd_vel", Twist, lambda _: None)
    pose = Pose(position=Point(1.5, -2.0, 0.25))
    latch(node, "/robot/pose", PoseStamped(header=Header(frame_id="map"), pose=pose))
    latch(node, "/robot/text", String("hello"))
    return with_log(node)


@pytest.fixture
def launch(network: Network) -> Iterator[Start]:
    """Starts launches on a network of the test's own, and leaves none behind."""
    tag = secrets.token_hex(8)
    programs: list[Program] = []

    def start(*words: str, **variables: str) -> Program:
        environ = network.variables(**{TAG: tag}, **variables)
        program = Program([*ROSZ, "launch", *words], environ)
        programs.append(program)
        return program

    yield start
    for program in programs:
        with suppress(ProcessLookupError):
            program.send(signal.SIGTERM)
        with suppress(subprocess.TimeoutExpired):
            program.process.wait(60)
    ProcessTree(tag).kill()  # what is left would keep the pipes open
    for program in programs:
        program.close()
