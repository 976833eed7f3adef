"""Ways to join machines, each as a user sets it up, with how long the first message takes."""

from __future__ import annotations

import shutil
import sys

import pytest
from cached import zenohd
from network import eventually, repeats

from hosts.host import Host, HostProgram
from hosts.scripts import LISTENER, TALKER, first_messages, p95, slack
from hosts.world import World

LISTEN = "tcp/0.0.0.0:7447"
FIRST_BY = 2.0
"""Seconds from the start of a node on the second machine to its first message."""


def core(host: Host, *options: str, **variables: str) -> HostProgram:
    """Start ``rosz core``, and wait until it stands."""
    program = host.rosz("core", *options, **variables)
    program.wait_for("started core")
    return program


def talker(host: Host, **variables: str) -> HostProgram:
    program = host.program(TALKER, **variables)
    program.wait_for("talking")
    return program


def assert_soon(what: str, host: Host, **variables: str) -> None:
    """See that new nodes of a host hear the talker in time, and print the figure."""
    seconds = first_messages(host, **variables)
    print(
        f"{what}: first message after {seconds[len(seconds) // 2]:.2f} s (median),"
        f" {p95(seconds):.2f} s (p95 of {len(seconds)})"
    )
    assert p95(seconds) < FIRST_BY * slack()


def test_a_core_and_another_machine(world: World) -> None:
    robot, laptop = world.hosts("robot", "laptop")
    started = core(robot, "--listen", LISTEN)
    assert started.lines[0] == f"listening on {LISTEN}"
    talker(robot)
    there = {"ROSZ_CONNECT": "tcp/robot:7447"}
    assert_soon("core and ROSZ_CONNECT", laptop, **there)
    assert laptop.ask("topic", "list", **there).split() == ["/chatter", "/rosout"]
    laptop.ask("param", "set", "/speed", "2", **there)
    assert robot.ask("param", "get", "/speed") == "2"
    assert robot.listening() == ["0.0.0.0:7447"]
    assert laptop.listening() == []


@pytest.mark.parametrize("names", ["127.0.0.1 localhost\n", "::1 localhost\n127.0.0.1 localhost\n"])
def test_a_core_listens_where_it_says(world: World, names: str) -> None:
    (world.folder / "hosts").write_text(names)
    (robot,) = world.hosts("robot")
    started = core(robot, "--listen", LISTEN)
    said = {line.split()[-1] for line in started.lines if line.startswith("listening on")}
    rows = [row.split() for row in robot.run("ss", "-Hlnt").splitlines()]
    assert said == {f"tcp/{row[3]}" for row in rows}
    with_mesh = talker(robot)
    assert robot.listening() == ["0.0.0.0:7447"]
    assert "/talker" in robot.ask("node", "list")
    with_mesh.kill()


def test_nothing_listens_beyond_the_machine_by_itself(world: World) -> None:
    robot, laptop = world.hosts("robot", "laptop")
    started = core(robot)
    assert started.lines[0] == "listening on tcp/localhost:7447"
    talker(robot)
    talker(laptop)
    assert robot.listening() == laptop.listening() == []


def test_a_core_on_each_machine(world: World) -> None:
    robot, laptop = world.hosts("robot", "laptop")
    core(robot, "--listen", LISTEN)
    linked = core(laptop, "--connect", "tcp/robot:7447")
    linked.wait_for("connected to tcp/robot:7447")
    talker(robot)
    assert_soon("a core on each machine", laptop)
    assert laptop.listening() == []
    here = laptop.program(TALKER, "here")
    here.wait_for("talking")
    eventually(lambda: robot.lists("/here"), "the graph on the other side")


def test_a_robot_behind_nat_dials_out(world: World) -> None:
    if shutil.which("nft") is None:
        pytest.skip("nft is missing: install nftables")
    base = world.host("base", "outside")
    gateway = world.host("gateway", "outside", "inside")
    robot = world.host("robot", "inside")
    gateway.namespace.write("/proc/sys/net/ipv4/ip_forward", "1")
    rules = (
        "table ip nat { chain post { type nat hook postrouting priority 100;"
        ' oifname "eth0" masquerade; }; };'
        " table ip filter { chain forward { type filter hook forward priority 0; policy drop;"
        ' iifname "eth1" accept; ct state established,related accept; }; };'
    )
    gateway.run("nft", rules)
    robot.run("ip", "route", "add", "default", "via", gateway.links["inside"].address)
    core(base, "--listen", LISTEN)
    core(robot, "--connect", f"tcp/{base.address}:7447")
    talker(robot)
    assert_soon("robot behind NAT", base)
    eventually(lambda: base.lists("/talker"), "the robot's node")


def test_domains_on_one_router_keep_apart(world: World) -> None:
    base, *robots = world.hosts("base", "one", "two", "three")
    core(base, "--listen", LISTEN)
    for number, robot in enumerate(robots, 1):
        robot.variables |= {"ROS_DOMAIN_ID": str(number), "ROSZ_CONNECT": "tcp/base:7447"}
        program = robot.program(TALKER, f"talker{number}")
        program.wait_for("talking")
    for number, robot in enumerate(robots, 1):
        robot.ask("param", "set", "/number", str(number))
    for number, robot in enumerate(robots, 1):
        assert robot.ask("node", "list") == f"/talker{number}"
        assert robot.ask("param", "get", "/number") == str(number)
        assert base.ask("node", "list", ROS_DOMAIN_ID=str(number)) == f"/talker{number}"
    assert base.ask("node", "list") == ""
    robots[0].variables["ROS_DOMAIN_ID"] = "2"
    assert_soon("three domains on one router", robots[0])


def test_multicast_when_asked_for(world: World) -> None:
    robot, laptop, other = world.hosts("robot", "laptop", "other")
    unasked = other.program(LISTENER)
    talker(robot, ROSZ_MULTICAST="1")
    assert_soon("multicast", laptop, ROSZ_MULTICAST="1")
    assert "/talker" in laptop.ask("node", "list", ROSZ_MULTICAST="1")
    assert unasked.output == ""
    assert other.listening() == []


def test_who_was_not_asked_to_look_beyond_hears_all(world: World) -> None:
    """Nobody can connect to such a node from another machine, so it must be the one that does."""
    robot, laptop = world.hosts("robot", "laptop")
    talker(laptop, ROSZ_MULTICAST="1")
    between = robot.program(LISTENER, "between", ROSZ_MULTICAST="1")
    between.wait_for("heard")
    for number in range(repeats(4, 20)):
        unasked = robot.program(LISTENER, f"unasked{number}")
        unasked.wait_for("heard")
    assert robot.ask("node", "list").split().count("/talker") == 1


def test_cores_find_each_other_by_multicast(world: World) -> None:
    robot, laptop = world.hosts("robot", "laptop")
    for host in (robot, laptop):
        assert core(host, ROSZ_MULTICAST="1").lines[0] == f"listening on {LISTEN}"
    talker(robot)
    assert_soon("cores that find each other by multicast", laptop)
    eventually(lambda: laptop.lists("/talker"), "the graph on the other side")


def test_a_core_listens_where_a_configuration_says(world: World) -> None:
    (robot,) = world.hosts("robot")
    file = robot.home / "zenoh.json5"
    file.write_text('{mode: "router", listen: {endpoints: {router: ["tcp/127.0.0.1:7450"]}}}')
    by_file = core(robot, ZENOH_SESSION_CONFIG_URI=str(file))
    assert by_file.lines[0] == "listening on tcp/127.0.0.1:7450"
    override = 'listen/endpoints=["tcp/0.0.0.0:7451"]'
    overridden = core(robot, ZENOH_CONFIG_OVERRIDE=override)
    assert overridden.lines[0] == "listening on tcp/0.0.0.0:7451"
    rows = [row.split()[3] for row in robot.run("ss", "-Hlnt").splitlines()]
    assert sorted(rows) == ["0.0.0.0:7451", "127.0.0.1:7450"]


def test_one_of_two_interfaces_alive(world: World) -> None:
    base, robot = world.host("base", "cable", "wifi"), world.host("robot", "cable", "wifi")
    core(base, "--listen", LISTEN)
    robot.links["cable"].cut()
    talker(base)
    both = ",".join(f"tcp/{link.address}:7447" for link in base.links.values())
    assert_soon("the second of two interfaces", robot, ROSZ_CONNECT=both)
    robot.links["cable"].heal()
    robot.links["wifi"].unplug()
    assert_soon("the first of two interfaces", robot, ROSZ_CONNECT=both)


ROUTER = """
import json, sys, time, zenoh
config = zenoh.Config.from_json5(json.dumps({
    "mode": "router",
    "listen": {"endpoints": ["tcp/[::]:7447"]},
    "connect": {"endpoints": sys.argv[1:]},
    "scouting": {"multicast": {"enabled": False}, "gossip": {
        "enabled": True, "autoconnect": {"router": [], "peer": []}}},
    "routing": {"router": {"linkstate": {}}},
    "timestamping": {"enabled": {"router": True, "peer": True, "client": True}},
    "queries_default_timeout": 600000,
    "transport": {"unicast": {"open_timeout": 60000, "accept_timeout": 60000},
                  "link": {"tx": {"lease": 60000, "keep_alive": 2}}},
    "adminspace": {"enabled": True},
}))
with zenoh.open(config):
    print("started router", flush=True)
    time.sleep(1000)
"""
"""What ``rmw_zenohd`` runs with its own configuration."""


@pytest.mark.parametrize("program", ["zenohd", "of ROS 2"])
def test_a_router_that_is_not_ours(world: World, program: str) -> None:
    robot, laptop = world.hosts("robot", "laptop")
    if program == "zenohd":
        robot.execute(str(zenohd()), "-l", "tcp/[::]:7447", "--no-multicast-scouting")
    else:
        router = robot.execute(sys.executable, "-c", ROUTER)
        router.wait_for("started router")
    eventually(lambda: "*:7447" in robot.listening(), "the router")
    talker(robot)
    assert_soon("a plain Zenoh router", laptop, ROSZ_CONNECT="tcp/robot:7447")
    second = laptop.execute(sys.executable, "-c", ROUTER, "tcp/robot:7447")
    second.wait_for("started router")
    assert_soon("a plain Zenoh router on each machine", laptop)


def test_a_launch_goes_on_without_the_other_machine(world: World) -> None:
    """Its nodes are linked by a core of their own, which links them to the other machine."""
    robot, laptop = world.hosts("robot", "laptop")
    core(robot, "--listen", "tcp/0.0.0.0:7447")
    talker(robot)
    file = laptop.home / "pair.launch"
    file.write_text(
        '<launch><node name="pub" pkg="rostopic" type="rostopic" output="screen"'
        ' args="pub -r 5 /own std_msgs/String local"/></launch>'
    )
    launch = laptop.rosz("launch", str(file), ROSZ_CONNECT="tcp/robot:7447")
    launch.wait_for("process[pub-1]: started")
    assert "local" in laptop.ask("topic", "echo", "-n", "1", "/own")
    assert "data:" in laptop.ask("topic", "echo", "-n", "1", "/chatter")
    robot.link.cut()
    assert "local" in laptop.ask("topic", "echo", "-n", "1", "/own")
