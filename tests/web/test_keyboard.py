"""What a click chooses is chosen with the keyboard too, and stands in the address."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from network import Network

import rosz.bags
from rosz.msgs.std_msgs.msg import String

from .robot import LONG, World, eventually, open_browser, start_server

pytestmark = [pytest.mark.system]

NODE = """
import rosz
from rosz.msgs.example_interfaces.action import Fibonacci
from rosz.msgs.std_msgs.msg import String
from rosz.msgs.std_srvs.srv import Empty
with rosz.Node("robot") as node:
    node.service("reset", Empty, lambda _: Empty.Response())
    node.action_server("count", Fibonacci, lambda _: Fibonacci.Result())
    node.publisher("chatter", String)
    node.params.set("~gain", 1.5)
    node.timer(1.0, lambda _: node.log.warning("it is low"))
    print("ready", flush=True)
    node.spin()
"""


@pytest.fixture(scope="module")
def world() -> Iterator[World]:
    network = Network()
    try:
        with open_browser() as browser:
            robot = network.program(NODE)
            bags = network.folder / "bags"
            bags.mkdir()
            with rosz.bags.open(bags / "run.mcap", "w") as bag:
                bag.write("/chatter", String("hello"), 1)
            server = start_server(network, "--bags", str(bags))
            robot.wait_for("ready", LONG)
            yield World(network, robot, server, browser)
    finally:
        network.close()


# The page, a part of it that can be chosen, the address then, and a text that shows it.
CHOICES = [
    ("/services", 'a[href*="service="]', "?service=/reset", "It has no fields."),
    ("/actions", 'a[href*="action="]', "?action=/count", "order"),
    ("/bags", 'a[href*="bag="]', "?bag=run.mcap", "std_msgs/String"),
    ("/console", 'td a[href*="node="]', "?node=/robot", "it is low"),
    (
        "/parameters",
        ".q-tree__node--child .q-tree__node-header",
        "?name=/robot/gain",
        "Value (float)",
    ),
    (
        "/graph?content=all",
        '[data-key="node:/robot"]',
        "pick=node:/robot",
        "* /reset",
    ),
    ("/", 'a[href*="pick="]', "pick=node:/robot", "* /reset"),
]
_FOCUS = """
const found = document.querySelector(arguments[0]);
if (!found) return false;
found.focus();
return document.activeElement === found;
"""


@pytest.mark.parametrize(("path", "part", "address", "text"), CHOICES)
def test_the_keyboard_chooses(world: World, path: str, part: str, address: str, text: str) -> None:
    from selenium.webdriver import ActionChains
    from selenium.webdriver.common.keys import Keys

    world.open(path)

    def choose() -> bool:
        if address in world.browser.current_url:
            return True
        if world.ask(_FOCUS, part):
            ActionChains(world.browser).send_keys(Keys.ENTER).perform()
        return False

    eventually(choose, f"{part} is chosen", LONG)
    world.should_see(text)
    here = world.browser.current_url.removeprefix(world.address)
    world.open(here)
    world.should_see(text)
    assert world.messages() == []
