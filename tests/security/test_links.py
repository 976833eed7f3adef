"""Keys and rules between hosts: which links are accepted, and what each may do."""

from __future__ import annotations

import shutil
import time
from pathlib import Path

import pytest
from hosts.host import HostProgram
from hosts.world import World
from network import eventually

from rosz.security import Authority

ROBOT = """
    import rosz
    from rosz.msgs.std_msgs.msg import String
    from rosz.msgs.std_srvs.srv import Trigger, TriggerResponse

    def answer(name):
        def serve(request):
            print("served", name, flush=True)
            return TriggerResponse(success=True, message=name)
        return serve

    with rosz.Node("robot") as node:
        node.params.set("/gains/p", 1)
        node.params.set("/secrets/pin", "vault-4711")
        out = {name: node.publisher(name, String) for name in ("camera", "odom")}
        for name in ("map", "plan"):
            node.publisher(name, String, latch=True).publish(name)
        for name in ("cmd_vel", "lift"):
            node.subscription(name, String, lambda m, n=name: print("got", n, m.data, flush=True))
        for name in ("reset", "format"):
            node.service(name, Trigger, answer(name))
        node.params.watch("/", lambda c: print("param", c.name, c.new, flush=True))
        print("up", flush=True)
        for tick in node.rate(20):
            for name, publisher in out.items():
                publisher.publish(f"{name} {tick}")
"""

LAPTOP = """
    import sys, time
    import rosz
    from rosz.msgs.std_msgs.msg import String
    from rosz.msgs.std_srvs.srv import Trigger

    with rosz.Node("laptop") as node:
        for name in ("odom", "camera", "map", "plan"):
            kept = "transient_local" if name in ("map", "plan") else "volatile"
            qos = rosz.QoS(depth=1, durability=kept)
            seen = set()
            def hear(message, name=name, seen=seen):
                if name not in seen:
                    seen.add(name)
                    print("heard", name, flush=True)
            node.subscription(name, String, hear, qos=qos)
        out = [node.publisher(name, String) for name in ("lift", "cmd_vel")]
        print("up", flush=True)
        for order in sys.stdin:
            verb, *rest = order.split()
            try:
                if verb == "publish":
                    for publisher in out:
                        publisher.publish("go")
                elif verb == "call":
                    client, limit = node.client(rest[0], Trigger), float(rest[1])
                    client.wait_for_service(limit)
                    print("answer", client(timeout=limit).message, flush=True)
                elif verb == "set":
                    node.params.set(rest[0], rest[1])
                    print("set", rest[0], flush=True)
                elif verb == "names":
                    tokens = node.context.graph.view().entities()
                    names = {token.name for token in tokens if token.node_name == "/robot"}
                    print("robot has", *sorted(names), flush=True)
                elif verb == "get":
                    print("value", node.params.get(rest[0], None), flush=True)
            except rosz.RoszError as error:
                print("error", verb, *rest, type(error).__name__, flush=True)
            print("done", *order.split(), flush=True)
"""


class Pair:
    """A robot with a core, and a laptop that connects to it."""

    def __init__(self, world: World, authority: Authority) -> None:
        self.robot, self.laptop = world.host("robot"), world.host("laptop")
        self.authority = authority
        for host in (self.robot, self.laptop):
            authority.add(host.name, [host.address])
            host.variables["ROSZ_KEYS"] = str(authority.folder)
        self.laptop.variables["ROSZ_CONNECT"] = "tcp/robot:7447"

    def rules(self, text: str) -> None:
        (self.authority.folder / "robot" / "rules.yaml").write_text(text)

    def start(self) -> tuple[HostProgram, HostProgram]:
        core = self.robot.rosz("core", "--listen", f"tcp/{self.robot.address}:7447")
        core.wait_for("started core")
        robot = self.robot.program(ROBOT)
        robot.wait_for("up")
        return core, robot


@pytest.fixture
def pair(world: World, authority: Authority) -> Pair:
    return Pair(world, authority)


def test_everything_works_with_keys(pair: Pair) -> None:
    _, robot = pair.start()
    laptop = pair.laptop.program(LAPTOP)
    for name in ("odom", "camera", "map", "plan"):
        laptop.wait_for(f"heard {name}")

    def got() -> bool:
        laptop.say("publish")
        return all(f"got {name} go" in robot.output for name in ("cmd_vel", "lift"))

    eventually(got, "messages of the laptop")
    laptop.say("call reset 50")
    laptop.wait_for("answer reset")
    laptop.say("set /gains/p 7")
    robot.wait_for("param /gains/p 7")


RULES = """
laptop:
  subscribe: [/odom, /map]
  publish: [/cmd_vel]
  call: [/reset]
  set: ["/gains/**"]
  get: true
"""


def test_rules_allow_only_what_they_say(pair: Pair) -> None:
    pair.rules(RULES)
    _, robot = pair.start()
    laptop = pair.laptop.program(LAPTOP)
    laptop.wait_for("heard odom")
    laptop.wait_for("heard map")

    def got() -> bool:
        laptop.say("publish")
        return robot.output.count("got cmd_vel go") >= 3

    eventually(got, "messages on '/cmd_vel'")
    laptop.say("call reset 50")
    laptop.wait_for("answer reset")
    laptop.say("call format 2")
    laptop.wait_for("error call format")
    laptop.say("get /secrets/pin")
    laptop.wait_for("value vault-4711")
    laptop.say("set /gains/p 7")
    robot.wait_for("param /gains/p 7")
    laptop.say("set /secrets/pin 0")
    laptop.wait_for("done set /secrets/pin", 60)
    assert pair.robot.ask("param", "get", "/secrets/pin") == "vault-4711"
    laptop.say("names")
    assert laptop.wait_for("robot has") == "robot has /cmd_vel /map /odom /reset"
    for unheard in ("lift", "secrets"):
        assert unheard not in robot.output
    assert "heard camera" not in laptop.output
    assert "heard plan" not in laptop.output
    assert "served format" not in robot.output


@pytest.mark.parametrize("pattern", ["/gains/**", "/**"])
def test_permission_to_set_is_not_permission_to_read(pair: Pair, pattern: str) -> None:
    pair.rules(f"laptop: {{set: ['{pattern}']}}\n")
    core, robot = pair.start()
    laptop = pair.laptop.program(LAPTOP)
    laptop.wait_for("up")
    began = time.monotonic()
    laptop.say("set /gains/p 7")
    robot.wait_for("param /gains/p 7")
    laptop.wait_for("set /gains/p")
    print(f"set by a holder that may not read: {time.monotonic() - began:.2f} s")
    laptop.say("get /secrets/pin")
    assert laptop.wait_for("value") == "value None"
    pair.laptop.ask("param", "set", "/gains/q", "8")
    robot.wait_for("param /gains/q 8")
    # Nor does it hear of what others set, and nobody waits for it.
    began = time.monotonic()
    pair.robot.ask("param", "set", "/secrets/pin", "vault-4321")
    print(f"set on the robot meanwhile: {time.monotonic() - began:.2f} s")
    laptop.say("get /secrets/pin")
    assert laptop.wait_for("value", times=2) == "value None"
    reading = pair.laptop.rosz("param", "get", "/secrets/pin")
    assert reading.exit_code() == 1
    assert "vault" not in reading.output
    assert pair.laptop.rosz("param", "list").exit_code() == 1
    for program in (core, robot, laptop):
        assert "WARNING" not in program.output


def test_a_holder_that_may_do_everything(pair: Pair) -> None:
    pair.rules("laptop: all\n'*': {}\n")
    _, robot = pair.start()
    laptop = pair.laptop.program(LAPTOP)
    laptop.wait_for("heard plan")
    laptop.say("set /secrets/pin 0")
    robot.wait_for("param /secrets/pin 0")


def test_a_holder_that_is_not_named(pair: Pair) -> None:
    pair.rules("somebody: all\n")
    _, robot = pair.start()
    laptop = pair.laptop.program(LAPTOP)
    laptop.wait_for("up")
    for order in ("publish", "call reset 2", "names"):
        laptop.say(order)
    assert laptop.wait_for("robot has").strip() == "robot has"
    assert robot.output == "up"
    assert "heard" not in laptop.output


def test_without_a_key(pair: Pair) -> None:
    core, robot = pair.start()
    pair.laptop.ask("topic", "list")
    assert "WARNING" not in core.output
    del pair.laptop.variables["ROSZ_KEYS"]
    listing = pair.laptop.rosz("topic", "list")
    assert listing.exit_code() == 1
    assert "/odom" not in listing.output
    assert "'tcp/robot:7447': it requires keys, and this machine has none" in listing.output
    core.wait_for("WARNING: a link is refused: received corrupt message of type InvalidContentType")
    assert robot.output == "up"


def test_with_a_key_of_another_authority(pair: Pair, tmp_path: Path) -> None:
    core, _ = pair.start()
    other = Authority.create(tmp_path / "other")
    other.add("laptop", [pair.laptop.address])
    listing = pair.laptop.rosz("topic", "list", ROSZ_KEYS=str(other.folder))
    assert listing.exit_code() == 1
    assert "its certificate is refused here" in listing.output
    core.wait_for("WARNING: a link is refused: received fatal alert")


def test_with_an_expired_key(pair: Pair) -> None:
    core, _ = pair.start()
    shutil.rmtree(pair.authority.folder / "laptop")
    pair.authority.add("laptop", days=-1)
    # Each tries several times; then a marker follows whatever the core logged.
    for listing in [pair.laptop.rosz("topic", "list") for _ in range(2)]:
        assert listing.exit_code() == 1
        assert "it refuses: sslv3 alert certificate expired" in listing.output
    refused = "WARNING: a link is refused: invalid peer certificate: certificate expired"
    core.wait_for(refused)
    pair.laptop.rosz("topic", "list", ROSZ_KEYS="").exit_code()
    core.wait_for("received corrupt message of type InvalidContentType")
    assert core.output.count(refused) == 1


def test_cores_log_why_a_link_is_refused(pair: Pair) -> None:
    _, robot = pair.start()
    del pair.laptop.variables["ROSZ_KEYS"]
    without = pair.laptop.rosz("core", "--connect", "tcp/robot:7447")
    without.wait_for("no link to tcp/robot:7447: it requires keys")
    robot.kill()


def test_the_other_end_has_no_keys(pair: Pair) -> None:
    del pair.robot.variables["ROSZ_KEYS"]
    pair.start()
    listing = pair.laptop.rosz("topic", "list")
    assert listing.exit_code() == 1
    assert "it says nothing within 2 s" in listing.output
    assert "'ROSZ_KEYS' is missing there" in listing.output


def test_a_key_for_another_name(pair: Pair) -> None:
    """The holder of a key cannot pose as another machine."""
    shutil.rmtree(pair.authority.folder / "robot")
    (pair.authority.add("other")).rename(pair.authority.folder / "robot")
    pair.start()
    listing = pair.laptop.rosz("topic", "list")
    assert listing.exit_code() == 1
    assert "Hostname mismatch" in listing.output


def test_a_certificate_of_another_machine(pair: Pair) -> None:
    """A core that others would refuse says so at its start."""
    pair.robot.variables["ROSZ_KEYS"] = str(pair.authority.folder / "laptop")
    core = pair.robot.rosz("core", "--listen", "tcp/0.0.0.0:7447")
    core.wait_for(f"is for 'laptop', '{pair.laptop.address}', and this machine is 'robot'")
    core.wait_for("started core")
