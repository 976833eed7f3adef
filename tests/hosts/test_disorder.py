"""Packets that come twice, and in another order: nothing ends, repeats or goes back."""

from __future__ import annotations

from pathlib import Path

import pytest
from network import TIMEOUT, eventually

from hosts.scripts import COUNTER, LISTENER, TALKER
from hosts.world import World

MANY = 200
SETS = 20


@pytest.mark.parametrize("protocol", ["tcp", "udp"])
def test_packets_that_come_twice_and_late(world: World, protocol: str) -> None:
    """Zenoh gives those of a UDP link up that come too late; a message never comes twice."""
    if not Path("/dev/net/tun").exists():
        pytest.skip("bad links need /dev/net/tun")
    robot, laptop = world.hosts("robot", "laptop")
    core = robot.rosz("core", "--listen", f"{protocol}/0.0.0.0:7447")
    core.wait_for("started core")
    laptop.variables["ROSZ_CONNECT"] = f"{protocol}/robot:7447"
    robot.program(TALKER).wait_for("talking")
    here, there = robot.program(COUNTER, "here"), laptop.program(COUNTER, "there")
    listener = laptop.program(LISTENER)
    listener.wait_for("heard")
    for counter in (here, there):
        counter.wait_for("ready")
    laptop.link.degrade(duplicate=0.3, reorder=0.3)
    for number in range(SETS):
        for counter, name in ((here, "mine"), (there, "yours")):
            counter.say(f"/{name}={number}")
            counter.wait_for(f"/{name} {number}", 2 * TIMEOUT)
    listener.wait_for("heard", 2 * TIMEOUT, times=MANY)
    heard = [int(line.split()[1]) for line in listener.lines if line.startswith("heard")]
    assert heard == sorted(set(heard))
    laptop.link.heal()

    def equal() -> bool:
        last = len(here.lines), len(there.lines)
        for counter in (here, there):
            for name in ("mine", "yours"):
                counter.say(f"/{name}")
        return all(
            counter.wait_for(f"/{name} ", after=before).endswith(f" {SETS - 1}")
            for counter, before in zip((here, there), last, strict=True)
            for name in ("mine", "yours")
        )

    eventually(equal, "the same parameters on both sides", 2 * TIMEOUT)
    for program in (core, here, there, listener):
        assert program.process.poll() is None
        assert "Traceback" not in program.output
