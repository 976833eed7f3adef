"""``rosz core --listen tcp/0.0.0.0:7447`` with keys: plain within the machine, TLS beyond it."""

from __future__ import annotations

import pytest
from hosts.host import Host, HostProgram
from hosts.scripts import LISTENER, TALKER
from hosts.world import World
from network import eventually

from rosz.security import Authority
from rosz.session import connect_endpoint, listen_endpoints

ONE = "127.0.0.1 localhost\n"
BOTH = "127.0.0.1 localhost\n::1 localhost\n"

HANDSHAKE = """
import socket, ssl, sys
context = ssl.create_default_context(cafile=f"{sys.argv[1]}/authority.pem")
context.load_cert_chain(f"{sys.argv[1]}/certificate.pem", f"{sys.argv[1]}/key.pem")
plain = socket.create_connection(("robot", 7447))
with context.wrap_socket(plain, server_hostname="robot") as link:
    print(link.version(), link.getpeercert()["subject"][0][0][1])
"""


def pair(world: World, authority: Authority, names: str = BOTH) -> tuple[Host, Host]:
    """Return a robot and a laptop that both have keys."""
    (world.folder / "hosts").write_text(names)
    robot, laptop = world.hosts("robot", "laptop")
    for host in (robot, laptop):
        host.variables["ROSZ_KEYS"] = str(authority.add(host.name))
    return robot, laptop


def started(host: Host, *options: str) -> HostProgram:
    core = host.rosz("core", *options)
    core.wait_for("started core")
    return core


def assert_tls_beyond_and_plain_within(robot: Host, laptop: Host) -> None:
    """Check that the right machines hear a talker on the robot."""
    handshake = laptop.program(HANDSHAKE, laptop.variables["ROSZ_KEYS"])
    assert handshake.exit_code() == 0, handshake.output
    assert handshake.output == "TLSv1.3 robot"
    for place in ("tcp/robot:7447", "tls/robot:7447"):
        assert laptop.ask("node", "list", ROSZ_CONNECT=place) == "/talker"
    laptop.program(LISTENER, ROSZ_CONNECT="tcp/robot:7447").wait_for("heard")
    without = laptop.rosz("node", "list", ROSZ_CONNECT="tcp/robot:7447", ROSZ_KEYS="")
    assert without.exit_code() == 1
    assert "/talker" not in without.output
    assert robot.ask("node", "list", ROSZ_KEYS="").split() == ["/listener", "/talker"]
    itself = {"ROSZ_CONNECT": "tcp/robot:7447"}
    assert robot.ask("node", "list", **itself).split() == ["/listener", "/talker"]


@pytest.mark.parametrize(
    ("place", "names"),
    [("tcp/0.0.0.0:7447", ONE), ("tls/0.0.0.0:7447", BOTH), ("tcp/[::]:7447", BOTH)],
)
def test_a_core(world: World, authority: Authority, place: str, names: str) -> None:
    robot, laptop = pair(world, authority, names)
    core = started(robot, "--listen", place)
    said = [line.split()[-1] for line in core.lines if line.startswith("listening on")]
    everywhere = place.partition("/")[2]
    own = ["tcp/127.0.0.1:7447#iface=lo"]
    own += ["tcp/[::1]:7447#iface=lo"] if names == BOTH else []
    assert said[0] == f"tls/{everywhere}#iface=eth0"
    assert sorted(said[1:]) == own
    rows = [row.split()[3] for row in robot.run("ss", "-Hlnt").splitlines()]
    assert len(rows) == len(said)
    robot.program(TALKER, ROSZ_KEYS="").wait_for("talking")
    assert_tls_beyond_and_plain_within(robot, laptop)


def test_a_node_without_a_core(world: World, authority: Authority) -> None:
    robot, laptop = pair(world, authority, ONE)
    robot.program(TALKER, ROSZ_LISTEN="tcp/0.0.0.0:7447").wait_for("talking")
    assert_tls_beyond_and_plain_within(robot, laptop)


def test_a_node_without_keys(world: World) -> None:
    (world.folder / "hosts").write_text(ONE)
    robot, laptop = world.hosts("robot", "laptop")
    robot.program(TALKER, ROSZ_LISTEN="tcp/0.0.0.0:7447").wait_for("talking")
    assert laptop.ask("node", "list", ROSZ_CONNECT="tcp/robot:7447") == "/talker"
    assert robot.ask("node", "list") == "/talker"


def test_an_address_that_comes_later(world: World, authority: Authority) -> None:
    """A robot boots before its wireless network is there."""
    robot, laptop = pair(world, authority)
    robot.run("ip", "address", "flush", "dev", "eth0")
    started(robot, "--listen", "tcp/0.0.0.0:7447")
    robot.program(TALKER).wait_for("talking")
    robot.run("ip", "address", "add", f"{robot.address}/24", "dev", "eth0")
    listing = laptop.ask("node", "list", ROSZ_CONNECT="tcp/robot:7447")
    assert listing == "/talker"


def test_an_interface_that_comes_later(world: World, authority: Authority) -> None:
    """A VPN comes up, or an adapter is plugged in, out, and in again."""
    robot = world.host("robot")
    laptop = world.host("laptop", "later")
    for host in (robot, laptop):
        host.variables["ROSZ_KEYS"] = str(authority.add(host.name))
    core = started(robot, "--listen", "tcp/0.0.0.0:7447")
    robot.program(TALKER).wait_for("talking")
    for _ in range(2):
        link = world.lan("later").join(robot)
        core.wait_for("listening on tls/0.0.0.0:7447#iface=eth1, which has come up")
        (world.folder / "hosts").write_text(f"{BOTH}{link.address} robot\n")
        assert laptop.ask("node", "list", ROSZ_CONNECT="tcp/robot:7447") == "/talker"
        listener = laptop.program(LISTENER, ROSZ_CONNECT="tcp/robot:7447")
        listener.wait_for("heard")
        listener.kill()
        robot.run("ip", "link", "delete", "eth1")
        del robot.links["later"]
        core.lines.clear()


def test_a_core_on_each_machine(world: World, authority: Authority) -> None:
    robot, laptop = pair(world, authority)
    started(robot, "--listen", "tcp/0.0.0.0:7447")
    linked = started(laptop, "--connect", "tcp/robot:7447")
    linked.wait_for("connected to tls/robot:7447")
    robot.program(TALKER, ROSZ_KEYS="").wait_for("talking")
    laptop.program(LISTENER, ROSZ_KEYS="").wait_for("heard")
    eventually(lambda: robot.lists("/listener"), "the graph on the other side")


def test_another_port_needs_no_sharing() -> None:
    places = listen_endpoints("tcp/127.0.0.1:7447", ["tcp/0.0.0.0:9000"], keys=True)
    assert places == ("tcp/127.0.0.1:7447", "tls/0.0.0.0:9000")
    socket = "unixsock-stream//run/z.sock"
    assert listen_endpoints(socket, ["tcp/0.0.0.0:7447"], keys=True) == (socket, "tls/0.0.0.0:7447")


@pytest.mark.parametrize("own", ["127.0.1.1", "localhost"])
def test_a_machine_that_connects_to_itself_uses_the_loopback(own: str) -> None:
    assert connect_endpoint(f"tls/{own}:7447") == "tcp/localhost:7447"
    assert connect_endpoint("tcp/192.0.2.1:7447") == "tls/192.0.2.1:7447"
