"""Launches on the page: their nodes are restarted and stopped, and their output is shown."""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from network import Network

from rosz.access import PagePolicy
from rosz.errors import LaunchError, UsageError
from rosz.security import Permit
from rosz.web.model import Launches, NodeOutput, RunningLaunch

from .robot import LONG, World, eventually, open_browser, set_screen, start_server, take_picture

pytestmark = [pytest.mark.system]

_LOUD = """
echo begun; test -e {go} && {{ echo again; exec sleep 600; }}
touch {go}; yes 'many words of a loud node' | head -c {size}; echo the last line; exec sleep 600
"""


def launch_file(folder: Path, size: int = 100) -> str:
    loud = folder / "loud.sh"
    loud.write_text("#!/bin/sh\n" + _LOUD.format(go=folder / "go", size=size))
    loud.chmod(0o755)
    file = folder / "demo.launch"
    file.write_text(
        '<launch>\n  <node name="talker" pkg="rosz_tutorials" type="publisher.py" />\n'
        f'  <executable name="loud" cmd="{loud}" required="true" output="screen" />\n</launch>\n'
    )
    return str(file)


class Site:
    """A launch, and what a page knows of it."""

    def __init__(self, network: Network, folder: Path, size: int = 100) -> None:
        self.network = network
        self.program = network.run("-m", "rosz", "launch", launch_file(folder, size))
        self.program.wait_for("process[loud-2]: started", LONG)
        self.node = network.node("page")
        self.launches = Launches(self.node, PagePolicy())
        eventually(lambda: self.launches.found, "the launch", LONG)

    @property
    def launch(self) -> RunningLaunch:
        found = self.launches.found
        assert found
        return found[0]

    def pid(self, name: str) -> int:
        node = self.launch.find(name)
        assert node is not None
        return node.pid


@pytest.fixture
def site(network: Network, tmp_path: Path) -> Iterator[Site]:
    made = Site(network, tmp_path)
    yield made
    made.launches.close()


def test_a_killed_node_is_restarted(site: Site) -> None:
    first = site.pid("/talker")
    os.kill(first, signal.SIGKILL)
    eventually(lambda: site.pid("/talker") == 0, "the end of the talker", LONG)
    node = site.launch.find("/talker")
    assert node is not None
    assert (node.state, node.detail) == ("ended", "was ended by SIGKILL")
    site.launches.act(site.launch.key, "restart", "/talker")
    eventually(lambda: site.pid("/talker") not in {0, first}, "another talker", LONG)
    with pytest.raises(UsageError, match="read-only"):
        Launches(site.node, PagePolicy(read_only=True)).act(site.launch.key, "stop", "/talker")
    with pytest.raises(UsageError, match="the rules of this machine do not let this page"):
        Launches(site.node, PagePolicy(Permit())).act(site.launch.key, "stop", "/talker")
    assert not PagePolicy(Permit()).sees_launches


def test_a_required_node_is_stopped_and_the_last_one_ends_the_launch(site: Site) -> None:
    launches, launch = site.launches, site.launch
    assert "a stop on request does not end the launch" in launches.describe(launch, "/loud", "stop")
    assert launches.describe(launch, "/loud", "restart") == ""
    launches.act(launch.key, "stop", "/loud")
    eventually(lambda: site.pid("/loud") == 0, "the end of the loud one", LONG)
    text = launches.describe(site.launch, "/talker", "stop")
    assert text == "No other node of its launch runs: the launch ends with it."
    launches.act(launch.key, "stop", "/talker")
    assert site.program.exit_code(LONG) == 0
    eventually(lambda: launches.found == (), "no launch", LONG)


def test_a_killed_launch_disappears(site: Site) -> None:
    key = site.launch.key
    output = NodeOutput(site.node, "/loud")
    text = ""

    def heard() -> bool:
        nonlocal text
        text += output.take()
        return "the last line" in text

    eventually(heard, "the output", LONG)
    assert text.startswith("begun\n")
    site.program.kill()
    eventually(lambda: site.launches.found == (), "no launch", LONG)
    eventually(lambda: output.state == "no launch runs '/loud'", "its end in words", LONG)
    with pytest.raises(LaunchError, match="ended without a reply"):
        site.launches.act(key, "restart", "/talker")
    output.close()


def test_a_node_that_writes_much_costs_little(network: Network, tmp_path: Path) -> None:
    site = Site(network, tmp_path, 20_000_000)
    output = NodeOutput(site.node, "/loud")
    kept = ""

    def heard() -> bool:
        nonlocal kept
        part = output.take()
        assert len(part) <= 262_144
        kept = (kept + part)[-1000:]
        return kept.endswith("the last line\n")

    eventually(heard, "the last line", LONG)
    assert output.skipped >= 0
    output.close()
    site.launches.close()


def test_a_browser_restarts_a_node_and_follows_its_output(
    site: Site, tmp_path_factory: pytest.TempPathFactory
) -> None:
    network = site.network
    with open_browser() as browser:
        server = start_server(network)
        world = World(network, site.program, server, browser)
        set_screen(browser, "laptop", "light")
        world.open("/")
        world.should_see("demo.launch", "/talker", "running", re.compile(r"\d min"))
        folder = tmp_path_factory.getbasetemp() / "artefacts"
        take_picture(browser, folder, "launches-laptop-light")
        first = site.pid("/talker")
        world.press("Restart /talker", lambda: site.pid("/talker") not in {0, first})
        world.should_see("/talker runs again")
        # Among the nodes too, where the button belongs to one process.
        eventually(
            lambda: world.text.count(str(site.pid("/talker"))) > 1, "the other talker on the page"
        )
        world.press("End /talker", lambda: world.sees("as by rosnode kill"))
        world.click_until("End", lambda: site.pid("/talker") == 0)
        world.press("Start /talker", lambda: site.pid("/talker") != 0)
        world.press("Stop /loud", lambda: world.sees("a stop on request does not end the launch"))
        world.click_until("Stop", lambda: site.pid("/loud") == 0)
        world.open("/output?node=/loud")
        world.should_see("the last line", "ended")
        world.click_until("Restart", lambda: world.sees("again", "running"))
        take_picture(browser, folder, "output-laptop-light")
        assert world.messages() == []
