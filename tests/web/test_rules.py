"""The rules of a machine hold for every page: it says why, and nothing happens."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

from rosz.msgs.example_interfaces.action import Fibonacci
from rosz.msgs.geometry_msgs.msg import Twist
from rosz.msgs.std_msgs.msg import String
from rosz.msgs.std_srvs.srv import SetBool
from rosz.reconfigure import Description, Server, Setting

from .visitor import Visitor

pytestmark = [pytest.mark.system, pytest.mark.timeout(240)]
LONG = 4 * TIMEOUT

SERVER = """
import sys
from pathlib import Path
from rosz.node import Node
from rosz.security import read_rules
from rosz.web.middleware import AccessMiddleware
from rosz.access import PagePolicy
from rosz.web.server import PageServer
rules = read_rules(sys.argv[1], "rules.yaml")
with Node("web") as node:
    permission = PagePolicy(rules.permit_at_bridge("web"))
    server = PageServer(node, "127.0.0.1", 0, permission=permission, middleware=AccessMiddleware(),
                        bags=Path(sys.argv[2]))
    print(f"the page is at http://127.0.0.1:{server.port}", flush=True)
    sys.stdin.readline()
    server.close()
"""
RULES = "web: {subscribe: ['/chatter', '/settings/**'], get: true}"
REFUSED = "the rules of this machine do not let"


class Site:
    """A robot, and a page that may only look at some of it."""

    def __init__(self, network: Network) -> None:
        self.network = network
        self.node = node = network.node("robot")
        self.done: list[str] = []
        self.chatter = node.publisher("chatter", String, latch=True)
        self.chatter.publish(String("hello"))
        self.note("chatter", String)
        self.note("cmd_vel", Twist)
        node.service("enable", SetBool, self.enable)
        node.action_server("count", Fibonacci, self.count)
        node.params.set("/gain", 1.5)
        speed = Setting("speed", 0.5, min=0.0, max=2.0)
        self.settings = Server(network.node("settings"), Description([speed], []), self.apply)
        self.bags = network.folder / "bags"
        self.bags.mkdir()
        (self.bags / "kept.mcap").write_bytes(b"kept")
        server = network.program(SERVER, RULES, str(self.bags))
        self.address = server.wait_for("the page is at", LONG).split()[-1]

    def note(self, topic: str, cls: type[Any]) -> None:
        def receive(message: Any) -> None:
            if message != String("hello"):
                self.done.append(f"{topic}: {message}")

        self.node.subscription(topic, cls, receive)

    def enable(self, request: Any) -> Any:
        self.done.append("called")
        return SetBool.Response(True, str(request.data))

    def count(self, _goal: Any) -> Any:
        self.done.append("goal")
        return Fibonacci.Result()

    def apply(self, config: Any, _level: int) -> Any:
        if config["speed"] != 0.5:
            self.done.append("reconfigured")
        return config


@pytest.fixture(scope="module")
def site() -> Iterator[Site]:
    pytest.importorskip("nicegui")
    network = Network()
    try:
        yield Site(network)
    finally:
        network.close()


@pytest.fixture
def visit(site: Site) -> Iterator[Any]:
    opened: list[Visitor] = []

    def open_page(path: str) -> Visitor:
        opened.append(Visitor(site.address, path))
        return opened[-1]

    yield open_page
    for one in opened:
        one.close()
    assert site.done == []


def test_publishing(visit: Any) -> None:
    page = visit("/topics?topic=/chatter")
    page.should_see("hello")
    page.write("Fields in YAML; those left out have their default value", "data: no")
    page.press("Publish once")
    page.wait_for(f"{REFUSED} clients publish '/chatter'")
    page.press("Repeat")
    page.wait_for(f"{REFUSED} clients publish '/chatter'")


def test_driving(visit: Any) -> None:
    page = visit("/drive?topic=/cmd_vel")
    page.should_see(f"{REFUSED} clients publish '/cmd_vel'")


def test_calling(visit: Any) -> None:
    page = visit("/services?service=/enable")
    page.should_see("std_srvs/SetBool")
    page.should_see("data: false")
    page.press("Call")
    page.wait_for(f"{REFUSED} clients call '/enable'")


def test_goals(visit: Any) -> None:
    page = visit("/actions?action=/count")
    page.should_see("order: 0")
    page.press("Send goal")
    page.wait_for(REFUSED)


def test_parameters(site: Site, visit: Any) -> None:
    page = visit("/parameters?name=/gain")
    page.write("Value (float)", "2.5")
    page.press("Set")
    page.wait_for(f"{REFUSED} clients set '/gain'")
    page.press("Delete")
    page.wait_for(f"{REFUSED} clients set '/gain'")
    assert site.node.params.get("/gain") == 1.5


def test_settings(visit: Any) -> None:
    page = visit("/reconfigure?server=/settings")
    page.write("speed", 1.75)
    page.wait_for(REFUSED)


def test_ending_a_node(site: Site, visit: Any) -> None:
    page = visit("/")
    page.should_see("/robot")
    page.act("", "kill", {"name": "/robot", "key": "/robot"})
    page.press("End")
    page.wait_for(f"{REFUSED} this page control '/robot'")
    assert site.node.params.get("/gain") == 1.5


def test_bags(site: Site, visit: Any) -> None:
    page = visit("/bags?bag=kept.mcap")
    page.press("Record")
    page.wait_for(f"{REFUSED} this page record bags")
    page.press("Delete")
    page.press("Delete it")
    page.wait_for(f"{REFUSED} this page delete bags")
    assert [one.name for one in site.bags.iterdir()] == ["kept.mcap"]


def test_looking(site: Site, visit: Any) -> None:
    """What the page may not subscribe to is neither shown nor measured."""
    log = visit("/console")
    frames = visit("/3d")
    overview = visit("/")
    overview.should_see("/cmd_vel")
    assert f"{REFUSED} clients subscribe '/rosout'" in log.first
    assert f"{REFUSED} clients subscribe '/tf'" in frames.first

    def subscribed(topic: str) -> bool:
        view = site.node.context.graph.view()
        return any(one.node_name == "/web" for one in view.subscriptions(topic))

    eventually(lambda: subscribed("/chatter"), "the topic that may be measured", LONG)
    assert not any(map(subscribed, ("/rosout", "/tf", "/tf_static", "/cmd_vel")))
