"""Real ROS 1 programs on two hosts, beside a core that is their master, or beside a roscore."""

from __future__ import annotations

import re
import shutil
import signal
import time
from itertools import pairwise
from pathlib import Path

import pytest
from bridges.ros1.world import LISTENER, TALKER, roscpp
from network import eventually
from oracle import PYTHON, is_installed

from hosts.host import Host, HostProgram
from hosts.scripts import slack
from hosts.sshd import befriend, install_rosz, serve_ssh
from hosts.test_faults import AGAIN_BY
from hosts.world import World

pytestmark = [
    pytest.mark.ros1,
    pytest.mark.skipif(not is_installed("rospy", "rosmaster"), reason="needs ros-base of Debian"),
]

_MASTER = "http://127.0.0.1:11311"
_LONG = 60.0
_CUT = 10.0
"""Seconds after which both sides count a link as lost."""


def _ros1(host: Host, *command: str) -> HostProgram:
    """Start a ROS 1 program that names itself by an address that no other host reaches."""
    return host.execute(
        *command,
        PATH="/usr/bin:/bin",
        PYTHONPATH="",
        PYTHONWARNINGS="",
        ROS_MASTER_URI=_MASTER,
        ROS_IP="127.0.0.1",
    )


class Pair:
    """Two hosts; what rospy says on each, rospy hears on the other.

    Args:
        world: Where.
        roscore: Whether the robot has a roscore and a bridge, and no master of rosz.

    Attributes:
        doors: What joins the hosts, the commands of which are in `commands`.
    """

    def __init__(self, world: World, *, roscore: bool) -> None:
        self.robot, self.laptop = world.hosts("robot", "laptop")
        robot = ["core", "--listen", "tcp/0.0.0.0:7447"]
        self.commands = [
            (self.robot, robot),
            (self.laptop, ["core", "--ros1", "--connect", "tcp/robot:7447"]),
        ]
        if roscore:
            _ros1(self.robot, "rosmaster", "--core", "-p", "11311")
            self.commands.append((self.robot, ["bridge", "ros1", "--master", _MASTER]))
        else:
            robot.append("--ros1")
        self.doors = [self._open(*command) for command in self.commands]
        self.talker = self.talk()
        self.listener = _ros1(self.laptop, PYTHON, "-c", LISTENER, "listener", "/chatter")
        _ros1(self.laptop, PYTHON, "-c", TALKER, "laptop_talker", "/back")
        self.ear = _ros1(self.robot, PYTHON, "-c", LISTENER, "ear", "/back")
        self.hears_again(time.monotonic())

    def talk(self, word: str = "rospy") -> HostProgram:
        """Start the talker of the robot, which says a word and a number."""
        script = TALKER.replace("rospy %d", f"{word} %d")
        return _ros1(self.robot, PYTHON, "-c", script, "talker", "/chatter")

    def _open(self, host: Host, command: list[str]) -> HostProgram:
        program = host.rosz(*command)
        program.wait_for("started", _LONG)
        return program

    def restart(self, number: int) -> None:
        """Kill what joins the hosts, and start it again."""
        self.doors[number].kill()
        self.doors[number] = self._open(*self.commands[number])

    def hears_again(self, since: float) -> float:
        """Return how long after a moment both listeners hear something new, in seconds."""
        marks = [(program, len(program.lines)) for program in (self.listener, self.ear)]
        for program, mark in marks:
            program.wait_for("heard rospy", _LONG, after=mark)
        return time.monotonic() - since

    def open_files(self) -> list[int]:
        """Return how many files each of what joins the hosts has open."""
        return [len(list(Path(f"/proc/{door.inner}/fd").iterdir())) for door in self.doors]


def _assert_nothing_twice(listener: HostProgram) -> None:
    numbers = [int(number) for number in re.findall(r"heard rospy (\d+)", listener.output)]
    assert all(one < other or other == 0 for one, other in pairwise(numbers)), numbers


def test_a_cable_is_cut_and_healed(world: World) -> None:
    pair = Pair(world, roscore=False)
    before = pair.open_files()
    began = time.monotonic()
    pair.laptop.link.cut()
    time.sleep(max(0.0, began + _CUT - time.monotonic()))
    healed = time.monotonic()
    pair.laptop.link.heal()
    seconds = pair.hears_again(healed)
    print(f"link cut for {_CUT:g} s: ROS 1's topics after {seconds:.2f} s")
    assert seconds < AGAIN_BY * slack()
    for listener in (pair.listener, pair.ear):
        _assert_nothing_twice(listener)
    eventually(lambda: sum(pair.open_files()) <= sum(before) + 4, "no file left open")


@pytest.mark.parametrize("roscore", [False, True], ids=["masters", "roscore"])
def test_what_is_killed_comes_back(world: World, roscore: bool) -> None:
    pair = Pair(world, roscore=roscore)
    for number, (host, command) in enumerate(pair.commands):
        pair.restart(number)
        began = time.monotonic()
        seconds = pair.hears_again(began)
        print(f"rosz {command[0]} of the {host.name} killed: topics after {seconds:.2f} s")
        assert seconds < AGAIN_BY * slack()
    for listener in (pair.listener, pair.ear):
        _assert_nothing_twice(listener)
    pair.talker.kill()
    if not roscore:  # which lists a killed node for ever
        eventually(lambda: not pair.laptop.lists("/talker"), "the end of a node of ROS 1", _LONG)
    began = time.monotonic()
    pair.talk("again")
    pair.listener.wait_for("heard again", _LONG)
    assert time.monotonic() - began < AGAIN_BY * slack()


def test_compiled_nodes_on_another_machine(world: World) -> None:
    """They are found there, and have a master there."""
    laptop, robot = world.hosts("laptop", "robot")
    serve_ssh(robot)
    befriend(laptop, robot)
    install_rosz(robot)
    package = robot.home / "src/course"
    package.mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>course</name></package>")
    shutil.copy(roscpp(), package / "partner")
    laptop.rosz("core", "--listen", "tcp/0.0.0.0:7447").wait_for("started core", _LONG)
    file = laptop.home / "far.launch"
    node = '<node pkg="course" type="partner" machine="far" output="screen"'
    file.write_text(
        f'<launch><machine name="far" address="robot"/>{node} name="talker" args="talker"/>'
        f'{node} name="listener" args="listener"/></launch>'
    )
    launch = laptop.rosz("launch", str(file))
    launch.wait_for("remote[robot-0]: nodes not in Python have this launch's ROS 1 master", _LONG)
    launch.wait_for("heard talker ", _LONG)
    assert "talker" in laptop.ask("topic", "echo", "-n", "1", "/chatter")
    launch.send(signal.SIGINT)
    assert launch.exit_code(_LONG) == 0, launch.output
    assert not [line for line in robot.processes() if "partner" in line or "--agent" in line]
