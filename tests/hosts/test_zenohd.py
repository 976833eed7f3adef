"""Zenoh's own router, ``zenohd`` of crates.io, in the place of a core."""

from __future__ import annotations

from functools import partial

import pytest
from cached import zenohd
from network import eventually

from hosts.host import Host, HostProgram
from hosts.scripts import COUNTER, LISTENER, TALKER
from hosts.world import World

LISTEN = "tcp/0.0.0.0:7447"
HEARS_BOTH = """
import rosz
from rosz.msgs.std_msgs.msg import String
with rosz.Node("both") as node:
    node.subscription("closed", String, lambda _: print("heard closed", flush=True))
    for _ in node.subscription("open", String):
        print("heard open", flush=True)
"""
"""Hears a topic that rules permit, and one that they do not."""


def router(host: Host, *options: str, **variables: str) -> HostProgram:
    """Start ``zenohd`` with what ``rosz core --print-config`` prints, and wait for it."""
    file = host.home / "zenohd.json5"
    file.write_text(host.ask("core", "--print-config", *options, **variables))
    started = host.execute(str(zenohd()), "--config", str(file), RUST_LOG="zenoh=info")
    eventually(lambda: any(":7447" in one for one in host.listening()), "zenohd")
    return started


def hears(host: Host, topic: str = "/chatter") -> None:
    """See that a newcomer hears a topic, once the nodes have linked to a new router."""
    eventually(lambda: topic in host.ask("topic", "list").split(), f"'{topic}' on {host.name}")
    assert "data:" in host.ask("topic", "echo", "-n", "1", topic)


def test_on_one_machine(world: World) -> None:
    robot = world.host("robot")
    started = router(robot, "--listen", LISTEN)
    robot.program(TALKER).wait_for("talking")
    listener = robot.program(LISTENER)
    listener.wait_for("heard")
    counter = robot.program(COUNTER, "counter", ROSZ_MODE="client")
    counter.wait_for("ready")
    counter.say("/speed=7")
    counter.wait_for("/speed 7")
    assert robot.ask("param", "get", "/speed").strip() == "7"
    started.kill()
    listener.wait_for("heard", after=len(listener.lines))
    router(robot, "--listen", LISTEN)
    hears(robot)
    eventually(lambda: robot.lists("/counter"), "the client of the router")
    assert robot.ask("param", "get", "/speed").strip() == "7"


def test_on_two_machines(world: World) -> None:
    robot, laptop = world.hosts("robot", "laptop")
    first = router(robot, "--listen", LISTEN)
    router(laptop, "--listen", LISTEN, "--connect", "tcp/robot:7447")
    robot.program(TALKER).wait_for("talking")
    listener = laptop.program(LISTENER)
    listener.wait_for("heard")
    for host in (robot, laptop):
        for node in ("/talker", "/listener"):
            eventually(partial(host.lists, node), f"{node} on {host.name}")
    laptop.ask("param", "set", "/speed", "7")
    assert robot.ask("param", "get", "/speed").strip() == "7"
    first.kill()
    router(robot, "--listen", LISTEN)
    listener.wait_for("heard", after=len(listener.lines))
    robot.ask("param", "set", "/speed", "8")
    eventually(lambda: laptop.ask("param", "get", "/speed").strip() == "8", "the new value")


def test_with_a_core_on_the_other_machine(world: World) -> None:
    robot, laptop = world.hosts("robot", "laptop")
    router(robot, "--listen", LISTEN)
    laptop.rosz("core", "--connect", "tcp/robot:7447").wait_for("started core")
    robot.program(TALKER).wait_for("talking")
    hears(laptop)
    laptop.ask("param", "set", "/speed", "7")
    assert robot.ask("param", "get", "/speed").strip() == "7"


def test_with_keys_and_rules(world: World) -> None:
    pytest.importorskip("cryptography", reason="keys are made with the extra 'keys'")
    robot, laptop, stranger = world.hosts("robot", "laptop", "stranger")
    made = world.folder / "keys"
    laptop.ask("keys", "init", str(made))
    laptop.ask("keys", "add", "robot", "laptop", "--dir", str(made))
    for host in (robot, laptop):
        host.variables["ROSZ_KEYS"] = str(made / host.name)
    (made / "robot/rules.yaml").write_text("laptop: {subscribe: [/chatter], publish: [/open]}")
    router(robot, "--listen", LISTEN)
    laptop.rosz("core", "--connect", "tcp/robot:7447").wait_for("connected to")
    robot.program(TALKER).wait_for("talking")
    hears(laptop)
    laptop.program(TALKER, "refused", "closed").wait_for("talking")
    laptop.program(TALKER, "allowed", "open").wait_for("talking")
    both = robot.program(HEARS_BOTH)
    both.wait_for("heard open", times=20)
    assert "heard closed" not in both.output
    assert stranger.rosz("topic", "list", ROSZ_CONNECT="tcp/robot:7447").exit_code() == 1
