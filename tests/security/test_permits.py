"""Rules about serving and control, between hosts."""

from __future__ import annotations

import pytest
from hosts.host import Host, HostProgram
from network import eventually

SERVER = """
    import sys, threading
    import rosz
    from rosz.msgs.std_srvs.srv import Trigger, TriggerResponse
    with rosz.Node("server") as node:
        for name in ("lamp", "door"):
            node.service(name, Trigger, lambda request: TriggerResponse(success=True))
        print("up", flush=True)
        node.spin()
"""


@pytest.fixture
def pair(pair: tuple[Host, Host]) -> tuple[Host, Host]:
    _, laptop = pair
    laptop.variables["ROSZ_CONNECT"] = "tcp/robot:7447"
    return pair


def start(pair: tuple[Host, Host], rules: str) -> HostProgram:
    """Start a core with rules on the robot, and a node there."""
    robot, _ = pair
    (robot.home / "keys").symlink_to(robot.variables["ROSZ_KEYS"])
    (robot.home / "keys/rules.yaml").write_text(rules)
    robot.rosz("core", "--listen", "tcp/0.0.0.0:7447").wait_for("started core")
    return robot.rosz("run", "rosz_tutorials", "publisher.py", "__name:=publisher")


def test_permission_to_serve(pair: tuple[Host, Host]) -> None:
    robot, laptop = pair
    start(pair, "laptop: {serve: [/lamp]}\n")
    laptop.program(SERVER).wait_for("up")
    assert "success: True" in robot.ask("service", "call", "/lamp")
    listed = robot.ask("service", "list").split()
    assert "/lamp" in listed
    assert "/door" not in listed
    refused = robot.rosz("service", "call", "/door")
    assert refused.exit_code() == 2


LARGE = """
    import sys
    import rosz
    from rosz.msgs.std_msgs.msg import UInt8MultiArray
    with rosz.Node(sys.argv[1]) as node:
        if sys.argv[1] == "listener":
            node.subscription("large", UInt8MultiArray, lambda m: print(len(m.data), flush=True))
            print("up", flush=True)
        else:
            large = node.publisher("large", UInt8MultiArray)
            large.wait_for_subscribers(timeout=60)
            large.publish(data=bytes(1_000_000))
        node.spin()
"""


def test_permission_to_receive_large_messages(pair: tuple[Host, Host]) -> None:
    """They are fetched in pieces, by queries below the key of the topic."""
    robot, laptop = pair
    start(pair, "laptop: {subscribe: [/large]}\n")
    listener = laptop.program(LARGE, "listener")
    listener.wait_for("up")
    robot.program(LARGE, "talker")
    listener.wait_for("1000000", 60)


@pytest.mark.parametrize("control", [True, False])
def test_permission_to_end_nodes(pair: tuple[Host, Host], control: bool) -> None:
    robot, laptop = pair
    node = start(pair, f"laptop: {{subscribe: ['/**'], control: {str(control).lower()}}}\n")
    eventually(lambda: laptop.lists("/publisher"), "the node")
    killed = laptop.rosz("node", "kill", "/publisher")
    assert killed.exit_code() == (0 if control else 1), killed.output
    if control:
        node.exit_code()
    else:
        assert robot.ask("node", "list") == "/publisher"
