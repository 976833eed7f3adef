"""Cores and nodes that dial another machine before it is up."""

from __future__ import annotations

import pytest
from network import repeats

from hosts.scripts import LISTENER, TALKER
from hosts.world import Host, HostProgram, World

LISTEN = "tcp/0.0.0.0:7447"
ROBOT = "tcp/robot:7447"


def dialling(laptop: Host) -> HostProgram:
    """Start a core that finds nobody where it dials, and says so."""
    core = laptop.rosz("core", "--connect", ROBOT)
    core.wait_for("started core")
    assert f"waiting for {ROBOT}" in core.lines
    return core


def linked(robot: Host, core: HostProgram) -> None:
    """Start the other core, and wait until there is a link."""
    robot.rosz("core", "--listen", LISTEN).wait_for("started core")
    core.wait_for(f"connected to {ROBOT}", 60)


def test_a_core_that_refuses_at_first(world: World) -> None:
    robot, laptop = world.hosts("robot", "laptop")
    linked(robot, dialling(laptop))
    robot.program(TALKER).wait_for("talking")
    laptop.program(LISTENER, "listener", "once").wait_for("heard", 60)


@pytest.mark.parametrize("seconds", [repeats(2, 30)])
def test_a_machine_that_is_off_at_first(world: World, seconds: int) -> None:
    """Its interface is down while the other core dials it many times."""
    robot, laptop = world.hosts("robot", "laptop")
    robot.run("ip", "link", "set", robot.link.interface, "down")
    core = dialling(laptop)
    laptop.run("sleep", str(seconds))
    robot.run("ip", "link", "set", robot.link.interface, "up")
    linked(robot, core)


def test_a_link_that_is_lost_is_told(world: World) -> None:
    robot, laptop = world.hosts("robot", "laptop")
    robot_core = robot.rosz("core", "--listen", LISTEN)
    robot_core.wait_for("started core")
    core = laptop.rosz("core", "--connect", ROBOT)
    core.wait_for(f"connected to {ROBOT}", 60)
    robot_core.kill()
    core.wait_for(f"the link to {ROBOT} is lost: waiting for it", 60)
    linked(robot, core)


@pytest.mark.parametrize("listen", ["", "tcp/0.0.0.0:7450"], ids=["client", "peer"])
def test_a_node_that_dials_first(world: World, listen: str) -> None:
    robot, laptop = world.hosts("robot", "laptop")
    listener = laptop.program(LISTENER, ROSZ_CONNECT=ROBOT, ROSZ_LISTEN=listen)
    listener.wait_for(f"waiting for {ROBOT}")
    robot.rosz("core", "--listen", LISTEN).wait_for("started core")
    robot.program(TALKER).wait_for("talking")
    listener.wait_for("heard", 60)
