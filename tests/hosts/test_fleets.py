"""Two robots with the same nodes, and a laptop that sees both, with keys and without."""

from __future__ import annotations

from pathlib import Path

import pytest
from network import eventually

from hosts.host import Host, HostProgram
from hosts.scripts import TALKER
from hosts.world import World
from rosz.security import Authority


def core(host: Host, *options: str) -> HostProgram:
    program = host.rosz("core", *options)
    program.wait_for("started core", 60)
    return program


@pytest.mark.parametrize("secured", [False, True], ids=["plain", "keys"])
def test_two_robots_and_a_laptop(world: World, tmp_path: Path, secured: bool) -> None:
    laptop, *robots = world.hosts("laptop", "one", "two")
    if secured:
        authority = Authority.create(tmp_path / "keys")
        for host in (laptop, *robots):
            host.variables["ROSZ_KEYS"] = str(authority.add(host.name))
    core(laptop, "--listen", "tcp/0.0.0.0:7447")
    cores = []
    for number, robot in enumerate(robots, 1):
        options = ("--connect", "tcp/laptop:7447", "--as", f"/robot{number}")
        cores.append(core(robot, *options))
        robot.program(TALKER).wait_for("talking")

    def seen() -> bool:
        return laptop.lists("/robot1/talker") and laptop.lists("/robot2/talker")

    eventually(seen, "both talkers on the laptop", 60)
    assert "data:" in laptop.ask("topic", "echo", "-n", "1", "/robot2/chatter")
    laptop.ask("param", "set", "/robot1/speed", "2")
    eventually(lambda: "speed" in robots[0].ask("param", "list"), "the parameter", 60)
    assert "speed" not in robots[1].ask("param", "list")
    if secured:
        return
    taken = robots[1].rosz(
        "core",
        "--connect",
        "tcp/laptop:7447",
        "--as",
        "/robot1",
        ROSZ_RENDEZVOUS="tcp/localhost:7448",
    )
    taken.wait_for("'/robot1' is the name of another robot, 'one', on this network", 60)
    assert taken.exit_code() == 1
    robots[0].link.cut()
    eventually(lambda: not laptop.lists("/robot1/talker"), "the end of the link", 60)
    assert "data:" in robots[0].ask("topic", "echo", "-n", "1", "/chatter")
    robots[0].link.heal()
    eventually(seen, "both talkers after the cut", 60)
    cores[0].kill()
    core(robots[0], "--connect", "tcp/laptop:7447", "--as", "/robot1")
    eventually(seen, "both talkers after the kill", 60)
