"""Every page in a real browser: it opens, says nothing on the console, and what it does arrives."""

from __future__ import annotations

import re
import signal
from collections.abc import Iterator
from typing import Any

import pytest
from network import TIMEOUT, Network, Program, eventually

from rosz.web.pages.layout import ENTRIES

from .robot import ROBOT, THEMES, open_browser, set_screen, take_picture

pytestmark = [pytest.mark.system, pytest.mark.timeout(240)]
LONG = 4 * TIMEOUT


class World:
    """A robot, the page that shows it, and a browser."""

    def __init__(self, network: Network, robot: Program, server: Program, browser: Any) -> None:
        self.network = network
        self.robot = robot
        self.server = server
        self.browser = browser
        found = re.search(r"http://\S+", server.wait_for("the page is at", LONG))
        assert found is not None
        self.address = found.group().rstrip("/")

    def open(self, path: str) -> None:
        """Open a page."""
        self.browser.get(self.address + path)

    @property
    def text(self) -> str:
        """All text that the browser shows."""
        return str(self.browser.execute_script("return document.body.innerText"))

    def should_see(self, *texts: str) -> None:
        """Wait until texts are on the page."""
        for text in texts:
            eventually(lambda text=text: text in self.text, f"'{text}' on the page", LONG)  # type: ignore[misc]

    def messages(self) -> list[str]:
        """Return what is on the console of the browser, and forget it."""
        return [f"{one['level']} {one['message']}" for one in self.browser.get_log("browser")]


@pytest.fixture(scope="module")
def world() -> Iterator[World]:
    network = Network()
    try:
        with open_browser() as browser:
            robot = network.program(ROBOT)
            robot.wait_for("ready", LONG)
            server = network.run("-m", "rosz", "web", "--port", "0")
            yield World(network, robot, server, browser)
    finally:
        network.close()


SEEN = {
    "/": ("/robot", "/chatter", "std_msgs/String", "Hz"),
}


@pytest.mark.parametrize("path", [entry.path for entry in ENTRIES])
def test_every_page_opens_without_a_message(
    world: World, path: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.getbasetemp() / "artefacts"
    for screen, theme in THEMES:
        set_screen(world.browser, screen, theme)
        world.open(path)
        texts = SEEN[path]
        world.should_see(*(texts if screen == "laptop" else texts[:1]))
        take_picture(world.browser, folder, f"{path.strip('/') or 'overview'}-{screen}-{theme}")
        wide = "return document.documentElement.scrollWidth - window.innerWidth"
        assert world.browser.execute_script(wide) <= 0, f"{path} is wider than a {screen}"
        assert world.messages() == []


def test_a_closed_page_costs_nothing_and_ctrl_c_ends_at_once() -> None:
    network = Network()
    try:
        with open_browser() as browser:
            robot = network.node("robot")
            robot.publisher("chatter", "std_msgs/String")
            world = World(
                network,
                network.program("print('none')"),
                network.run("-m", "rosz", "web", "--port", "0"),
                browser,
            )
            world.open("/")
            world.should_see("/chatter")
            with robot.context.graph.follow_all() as followed:
                eventually(lambda: followed.view().subscriptions("/chatter"), "a measured topic")
                browser.get("about:blank")
                eventually(
                    lambda: not followed.view().subscriptions("/chatter"),
                    "no subscription without a page",
                    LONG,
                )
            world.open("/")
            world.should_see("/chatter")
            world.server.send(signal.SIGINT)
            assert world.server.exit_code() == 0
            assert "Traceback" not in world.server.output
    finally:
        network.close()
