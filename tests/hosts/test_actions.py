"""Goals of actions while a link is cut."""

from __future__ import annotations

import time

from hosts.scripts import slack
from hosts.world import World

SERVER = """
import rosz
from rosz.msgs.example_interfaces.action import Fibonacci

def execute(goal):
    print("started", flush=True)
    input()
    goal.succeed(Fibonacci.Result([goal.request.order]))

with rosz.Node("server") as node:
    node.action_server("fib", Fibonacci, execute)
    print("ready", flush=True)
    node.spin()
"""

CLIENT = """
import rosz
from rosz.errors import ServerSilent
from rosz.msgs.example_interfaces.action import Fibonacci

with rosz.Node("client") as node:
    client = node.action_client("fib", Fibonacci)
    client.wait_for_server(60)
    goal = client.send(Fibonacci.Goal(7), timeout=60)
    print("accepted", flush=True)
    try:
        goal.result(silence=2.0)
    except ServerSilent as error:
        print("silent", error, flush=True)
    print("result", goal.result().sequence[0], flush=True)
"""


def test_a_goal_survives_a_cut_link(world: World) -> None:
    """It is followed again after a cut that is longer than links last."""
    robot, laptop = world.hosts("robot", "laptop")
    core = robot.rosz("core", "--listen", "tcp/0.0.0.0:7447")
    core.wait_for("started core")
    laptop.variables["ROSZ_CONNECT"] = "tcp/robot:7447"
    server = robot.program(SERVER)
    server.wait_for("ready")
    client = laptop.program(CLIENT)
    client.wait_for("accepted")
    server.wait_for("started")
    laptop.link.cut()
    began = time.monotonic()
    client.wait_for("silent")
    noticed = time.monotonic() - began
    print(f"the waiting client noticed the cut after {noticed:.2f} s")
    assert noticed < 2 * slack() + 1
    time.sleep(max(0.0, began + 10.0 - time.monotonic()))  # links are lost after 8 s
    laptop.link.heal()
    server.say("")
    client.wait_for("result 7")
    assert server.output.count("started") == 1
    assert client.exit_code() == 0
