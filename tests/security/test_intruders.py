"""Machines without a key, or with a wrong or expired one, see nothing and send nothing."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import pytest
from hosts.host import Host, HostProgram
from hosts.scripts import slack
from hosts.world import World
from network import TIMEOUT, eventually

from rosz.security import Authority

VICTIM = """
import rosz
from rosz.msgs.std_msgs.msg import String
from rosz.msgs.std_srvs.srv import Trigger, TriggerResponse

def serve(request):
    print("got call", flush=True)
    return TriggerResponse(success=True)

with rosz.Node("victim") as node:
    node.publisher("map", String, latch=True).publish("secret")
    odom = node.publisher("odom", String)
    node.subscription("cmd_vel", String, lambda message: print("got message", flush=True))
    node.service("reset", Trigger, serve)
    node.params.set("/pin", "vault-4711")
    node.params.watch("/", lambda change: print("got param", change.name, flush=True))
    print("up", flush=True)
    for tick in node.rate(20):
        odom.publish("secret")
"""

INTRUDER = """
import time
import rosz
from rosz.msgs.std_msgs.msg import String
from rosz.msgs.std_srvs.srv import Trigger

with rosz.Node("intruder") as node:
    map_qos = rosz.QoS(depth=1, durability="transient_local")
    node.subscription("map", String, lambda message: print("heard", flush=True), qos=map_qos)
    node.subscription("odom", String, lambda message: print("heard", flush=True))
    cmd_vel = node.publisher("cmd_vel", String)
    client = node.client("reset", Trigger)
    print("up", flush=True)
    for tick in node.rate(20):
        cmd_vel.publish("go")
        node.params.set("/pin", tick)
        if tick == 40:
            try:
                client(timeout=1)
            except rosz.RoszError:
                print("tried", flush=True)
        print("pin", node.params.get("/pin", None), flush=True)
"""


def no_key(_authority: Authority, _folder: Path, host: Host) -> None:
    """Use no key at all."""
    host.variables["ROSZ_KEYS"] = ""


def another_authority(_authority: Authority, folder: Path, host: Host) -> None:
    """Use a key that another authority of the same name signed."""
    host.variables["ROSZ_KEYS"] = str(Authority.create(folder / "other").add(host.name))


def expired(authority: Authority, _folder: Path, host: Host) -> None:
    """Use a key that expired yesterday."""
    host.variables["ROSZ_KEYS"] = str(authority.add(host.name, days=-1))


Kind = Callable[[Authority, Path, Host], None]
KINDS = [no_key, another_authority, expired]


def core(host: Host, *options: str) -> HostProgram:
    started = host.rosz("core", *options)
    started.wait_for("started core")
    return started


@pytest.fixture
def hosts(world: World, authority: Authority) -> tuple[Host, Host]:
    """A robot with a key, and a laptop without."""
    robot, laptop = world.hosts("robot", "laptop")
    robot.variables["ROSZ_KEYS"] = str(authority.add("robot"))
    return robot, laptop


def nodes_seen_by(host: Host) -> list[str]:
    """Return the nodes that a machine lists, which may warn that it does not reach another one."""
    listing = host.rosz("node", "list")
    listing.exit_code()
    return [line for line in listing.lines if not line.startswith("WARNING: ")]


def assert_apart(robot: Host, laptop: Host) -> None:
    """Check that the nodes of the two machines do not see each other."""
    victim = robot.program(VICTIM)
    victim.wait_for("up")
    intruder = laptop.program(INTRUDER)
    intruder.wait_for("tried")
    assert "heard" not in intruder.output
    assert "vault-4711" not in intruder.output
    assert nodes_seen_by(laptop) == ["/intruder"]
    assert nodes_seen_by(robot) == ["/victim"]
    assert robot.ask("param", "get", "/pin").splitlines()[-1] == "vault-4711"
    assert victim.output == "up"


@pytest.mark.parametrize("kind", KINDS)
def test_an_intruder_that_connects(
    hosts: tuple[Host, Host], authority: Authority, tmp_path: Path, kind: Kind
) -> None:
    robot, laptop = hosts
    kind(authority, tmp_path, laptop)
    victim = core(robot, "--listen", "tcp/0.0.0.0:7447")
    core(laptop, "--connect", "tcp/robot:7447")
    victim.wait_for("WARNING: a link is refused: ")
    assert_apart(robot, laptop)


@pytest.mark.parametrize("kind", KINDS)
def test_an_intruder_that_is_connected_to(
    hosts: tuple[Host, Host], authority: Authority, tmp_path: Path, kind: Kind
) -> None:
    """The robot connects to the laptop, and the intruder listens at its address."""
    robot, laptop = hosts
    kind(authority, tmp_path, laptop)
    core(laptop, "--listen", "tcp/0.0.0.0:7447")
    core(robot, "--connect", "tcp/laptop:7447").wait_for("no link to tls/laptop:7447: ")
    assert_apart(robot, laptop)


def test_a_key_that_expires_meanwhile(hosts: tuple[Host, Host], authority: Authority) -> None:
    robot, laptop = hosts
    core(robot, "--listen", "tcp/0.0.0.0:7447")
    robot.program(VICTIM).wait_for("up")
    intruder = laptop.program(INTRUDER)
    intruder.wait_for("up")
    # Only the core of the laptop, which starts last, needs the key.
    seconds = 4 * min(slack(), 10)
    laptop.variables["ROSZ_KEYS"] = str(authority.add("laptop", days=seconds / 86400))
    expiry = time.monotonic() + seconds
    core(laptop, "--connect", "tcp/robot:7447")
    intruder.wait_for("heard")
    time.sleep(max(0.0, expiry - time.monotonic()))
    eventually(lambda: nodes_seen_by(robot) == ["/victim"], "the end of the link", 2 * TIMEOUT)
    eventually(lambda: nodes_seen_by(laptop) == ["/intruder"], "the end of the link")
    heard = intruder.output.count("heard")
    intruder.wait_for("pin", after=len(intruder.lines) + 20)
    assert intruder.output.count("heard") == heard
