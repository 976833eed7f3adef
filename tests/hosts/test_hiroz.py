"""A robot whose nodes are of hiroz, which speaks rmw_zenoh, and a laptop with rosz."""

from __future__ import annotations

import pytest
from cached import hiroz_peer
from interop.hiroz.city import Peer
from network import eventually

from hosts.host import Host
from hosts.test_zenohd import LISTEN, router
from hosts.world import World

STRING = "std_msgs/msg/String"
HEARS = """
    import sys
    import rosz
    from rosz.msgs.std_msgs.msg import String

    with rosz.Node("laptop") as node:
        node.subscription("/chatter", String, lambda m: print("heard", m.data, flush=True))
        orders = node.publisher("/orders", String)
        print("up", flush=True)
        for line in sys.stdin:
            orders.publish(line.strip())
"""


@pytest.fixture
def robot(world: World) -> Host:
    """A machine whose programs are those of ROS 2."""
    return world.host("robot")


def start(robot: Host, mode: str = "peer") -> Peer:
    """Start the robot's node."""
    words = (mode, "tcp/127.0.0.1:7447", "/robot/base")
    return Peer(robot.execute(str(hiroz_peer()), *words, ROS_DOMAIN_ID="0"))


def talk(robot: Peer, laptop: Host) -> None:
    """See that topics, services, parameters and listings work, in both directions."""
    robot.do("listen", STRING, "/orders", "-")
    robot.do("serve", "/add")
    robot.do("declare", "speed", 5)
    program = laptop.program(HEARS)
    program.wait_for("up")

    def hears() -> bool:
        robot.do("publish", STRING, "/chatter", "-", '{"data": "hello"}')
        return "heard hello" in program.lines

    eventually(hears, "the laptop hears the robot")
    eventually(lambda: laptop.lists("/robot/base"), "the robot's node")
    assert "sum: 42" in laptop.ask("service", "call", "/add", "20", "22")
    assert laptop.ask("ros2", "param", "get", "/robot/base", "speed") == "Integer value is: 5"
    program.say("stop")
    assert robot.next("heard /orders") == {"data": "stop"}
    eventually(lambda: "laptop" in robot.nodes(), "the laptop's node in the graph of hiroz")


@pytest.mark.parametrize("mode", ["peer", "client"])
def test_two_routers_in_a_chain(world: World, robot: Host, mode: str) -> None:
    """Zenoh's router on the robot, a core on the laptop; then the robot's begins again."""
    laptop = world.host("laptop")
    first = router(robot, "--listen", LISTEN)
    laptop.rosz("core", "--connect", "tcp/robot:7447").wait_for("started core")
    peer = start(robot, mode)
    talk(peer, laptop)
    first.kill()
    router(robot, "--listen", LISTEN)
    eventually(lambda: laptop.lists("/robot/base"), "the robot's node")
    assert "sum: 42" in laptop.ask("service", "call", "/add", "20", "22")


def test_a_core_on_each(world: World, robot: Host) -> None:
    laptop = world.host("laptop")
    robot.rosz("core", "--listen", LISTEN).wait_for("started core")
    laptop.rosz("core", "--connect", "tcp/robot:7447").wait_for("started core")
    talk(start(robot), laptop)


def test_keys(world: World, robot: Host) -> None:
    """On its own machine hiroz needs no keys; beyond, a core refuses it and says why."""
    pytest.importorskip("cryptography", reason="keys are made with the extra 'keys'")
    laptop, stranger = world.hosts("laptop", "stranger")
    made = world.folder / "keys"
    laptop.ask("keys", "init", str(made))
    laptop.ask("keys", "add", "robot", "laptop", "--dir", str(made))
    for host in (robot, laptop):
        host.variables["ROSZ_KEYS"] = str(made / host.name)
    core = robot.rosz("core", "--listen", LISTEN)
    core.wait_for("started core")
    laptop.rosz("core", "--connect", "tcp/robot:7447").wait_for("connected to")
    talk(start(robot), laptop)
    words = ("peer", "tcp/robot:7447", "/stranger")
    intruder = Peer(stranger.execute(str(hiroz_peer()), *words, ROS_DOMAIN_ID="0"))
    core.wait_for("WARNING: a link is refused: received corrupt message of type InvalidContentType")
    assert intruder.nodes() == {"stranger"}
    assert "/stranger" not in laptop.ask("node", "list")
