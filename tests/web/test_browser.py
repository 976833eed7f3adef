"""Every page in a real browser: it opens, says nothing on the console, and what it does arrives."""

from __future__ import annotations

import re
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from network import Network

from rosz.msgs.std_msgs.msg import String
from rosz.reconfigure import Client
from rosz.web.pages.layout import ENTRIES

from .robot import (
    LONG,
    ROBOT,
    THEMES,
    World,
    eventually,
    open_browser,
    set_screen,
    start_server,
    take_picture,
)

pytestmark = [pytest.mark.system]


@pytest.fixture(scope="module")
def world() -> Iterator[World]:
    network = Network()
    try:
        with open_browser() as browser:
            robot = network.program(ROBOT)
            robot.wait_for("ready", LONG)
            bags = network.folder / "bags"
            bags.mkdir()
            server = start_server(network, "--bags", str(bags))
            yield World(network, robot, server, browser)
    finally:
        network.close()


SEEN: dict[str, tuple[str | re.Pattern[str], ...]] = {
    "/bags": ("Record", "Choose a bag to see what is in it", "Compression"),
    "/actions": ("/count", "example_interfaces/Fibonacci", "order"),
    "/": ("/chatter", "/robot", "std_msgs/String", "Hz"),
    "/graph": ("/chatter", "/robot", re.compile(r"\d Hz")),
    "/topics": ("data", "std_msgs/String", "hello"),
    "/plot": ("/wave/data", "Pause"),
    "/console": ("the battery is low", "/robot"),
    "/drive": ("It stands.", "hold the arrow keys"),
    "/images": ("/camera", "80 x 60 mono8"),
    "/3d": ("Fixed frame", "From above", "10 x 10 cells"),
    "/parameters": ("gains", "rate", "1.5"),
    "/reconfigure": ("speed", "How fast it drives", "Camera", "lights"),
    "/services": ("/enable", "std_srvs/SetBool"),
}
QUERY = {
    "/actions": "?action=/count",
    "/graph": "?content=all",
    "/drive": "?topic=/cmd_vel",
    "/images": "?topics=/camera",
    "/plot": "?fields=/wave/data",
    "/reconfigure": "?server=/robot",
    "/services": "?service=/enable",
    "/topics": "?topic=/chatter",
}


@pytest.mark.parametrize("path", [entry.path for entry in ENTRIES])
def test_every_page_opens_without_a_message(
    world: World, path: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.getbasetemp() / "artefacts"
    for screen, theme in THEMES:
        set_screen(world.browser, screen, theme)
        world.open(path + QUERY.get(path, ""))
        texts = SEEN[path]
        world.should_see(*(texts if screen == "laptop" else texts[:1]))
        for colors in (theme, "dark" if theme == "light" else "light"):
            set_screen(world.browser, screen, colors)  # the page follows the browser
            take_picture(
                world.browser, folder, f"{path.strip('/') or 'overview'}-{screen}-{colors}"
            )
        wide = "return document.documentElement.scrollWidth - window.innerWidth"
        assert world.ask(wide) <= 0, f"{path} is wider than a {screen}"
        assert world.messages() == []


def test_what_pages_do_arrives(world: World) -> None:
    set_screen(world.browser, "laptop", "light")
    world.open("/topics?topic=/cmd_vel")
    world.should_hold("textarea", "angular:")
    world.send("linear: {x: 1.5}", "Publish once", lambda: "drives 1.5" in world.robot.output)
    world.open("/topics?topic=/chatter&condition=data+contains+7")
    world.should_see("hello")
    world.open("/topics?topic=/chatter&condition=data+contains+none")
    world.should_see("messages fulfils the condition")
    world.open("/console?begin=00:00&pattern=battery&level=WARN")
    world.should_see("the battery is low")
    world.open("/console?pattern=no+such+text")
    world.should_see("No line yet")
    world.open("/topics?topic=/cmd_vel")
    world.should_hold("textarea", "angular:")
    world.send("linear: {x: much}", "Publish once", lambda: "linear.x" in world.text)
    world.open("/services?service=/enable")
    world.should_hold("textarea", "data: false")
    world.send("data: true", "Call", lambda: "is True" in world.text)
    world.open("/parameters")
    world.should_see("rate")
    world.click_until("rate", lambda: world.sees("Value (int)"))
    world.fill(".q-dialog textarea", "35")
    world.click_until("Set", lambda: "rate is 35" in world.robot.output)
    world.should_see("20 → 35")
    assert world.messages() == []


def test_a_slider_reaches_the_node_and_the_node_the_slider(world: World) -> None:
    set_screen(world.browser, "laptop", "light")
    world.open("/reconfigure?server=/robot")
    world.should_see("How fast it drives")
    from selenium.webdriver import ActionChains

    def move() -> bool:
        slider = world.browser.find_element("css selector", ".q-slider")
        ActionChains(world.browser).move_to_element(slider).click().perform()
        return re.search(r"speed is (0\.9|1\.0)", world.robot.output) is not None

    eventually(move, "the slider moves the setting", LONG)
    with Client(world.network.node("other"), "/robot", timeout=LONG) as client:
        client.update({"speed": 1.75})
    value = "return document.querySelector('input[aria-label=speed]').value"
    eventually(lambda: world.ask(value) == "1.75", "1.75 on the page", LONG)
    assert world.messages() == []


def test_a_key_drives_as_long_as_it_is_held(world: World) -> None:
    from selenium.webdriver import ActionChains
    from selenium.webdriver.common.keys import Keys

    set_screen(world.browser, "laptop", "light")
    world.open("/drive?topic=/cmd_vel")
    world.should_see("It stands.")
    keys = ActionChains(world.browser)

    def press() -> bool:
        keys.key_down(Keys.ARROW_UP).perform()
        return "drives 1.0" in world.robot.output

    eventually(press, "the robot drives", LONG)
    keys.key_up(Keys.ARROW_UP).perform()
    world.robot.wait_for("drives 0.0", LONG)
    world.should_see("It stands.")
    world.ask(
        "window.stick = [0, -0.5];navigator.getGamepads = () => [null, {axes: window.stick}];"
    )
    world.robot.wait_for("drives 0.5", LONG)
    world.ask("window.stick = [0, 0.01]")
    world.should_see("It stands.")
    world.should_see("From above", "by /odom and /scan")
    shown = "return document.querySelector('[aria-label=\"robot from above\"] circle') !== null"
    eventually(lambda: world.ask(shown), "the robot from above", LONG)
    assert world.messages() == []


_DRAG = """
const [from, to] = [...arguments].map((one) => document.querySelector(one));
if (!from || !to) return false;
const data = new DataTransfer();
from.dispatchEvent(new DragEvent('dragstart', {dataTransfer: data, bubbles: true}));
for (const kind of ['dragover', 'drop']) {
  to.dispatchEvent(new DragEvent(kind, {dataTransfer: data, bubbles: true, cancelable: true}));
}
return true;
"""


def test_a_field_is_dragged_into_the_plot_and_the_picture_saved(
    world: World, tmp_path: Path
) -> None:
    set_screen(world.browser, "laptop", "light")
    world.browser.execute_cdp_cmd(
        "Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(tmp_path)}
    )
    world.open("/plot")
    world.should_see("/wave", "No field is plotted")
    leaf = ".q-tree span[draggable]"
    there = "return document.querySelector(arguments[0]) !== null"
    world.click_until("/wave", lambda: bool(world.ask(there, leaf)))
    drag = (leaf, ".nicegui-content .grow.min-w-0")
    eventually(lambda: world.ask(_DRAG, *drag), "a field to drag", LONG)
    world.should_see("/wave/data")
    eventually(lambda: "fields=/wave/data" in world.browser.current_url, "the address", LONG)
    world.click_until("PNG", (tmp_path / "plot.png").exists)
    assert (tmp_path / "plot.png").read_bytes().startswith(b"\x89PNG")
    world.open("/plot?fields=/wave/data@2&window=30&times=stamp")
    world.should_see("/wave/data\n2", "30 s", "Header stamp")
    assert world.messages() == []


def test_the_graph_tells_of_what_is_clicked(world: World) -> None:
    set_screen(world.browser, "laptop", "light")
    world.open("/graph?content=all")
    world.should_see("/chatter")

    def picked() -> bool:
        world.ask(
            "document.querySelector('[data-key=\"topic:/chatter\"]')"
            ".dispatchEvent(new MouseEvent('click', {bubbles: true}))"
        )
        return world.sees("Type: std_msgs/String", "Publishers:")

    eventually(picked, "what the topic is")
    world.open("/graph?content=all&topics=/chatter&hide=unconnected&labels=types")
    world.should_see("std_msgs/String")
    nodes = "return document.querySelectorAll('.node').length"
    eventually(lambda: world.ask(nodes) == 1, "one node", LONG)
    assert world.messages() == []


def test_a_goal_is_sent_followed_and_canceled(
    world: World, tmp_path_factory: pytest.TempPathFactory
) -> None:
    set_screen(world.browser, "laptop", "light")
    world.open("/actions?action=/count")
    world.should_hold("textarea", "order: 0")
    world.fill("input[aria-label=order]", "7")
    world.should_hold("textarea", "order: 7")
    world.click_until("Send goal", lambda: "counts to 7" in world.robot.output)
    world.should_see("executing", "[0, 1, 1, 2, 3, 5, 8]", "Earlier feedback")
    folder = tmp_path_factory.getbasetemp() / "artefacts"
    for screen, theme in (*THEMES, ("laptop", "dark"), ("phone", "light")):
        set_screen(world.browser, screen, theme)
        world.open("/actions?action=/count")  # the goal is of the server of the page
        world.should_see("executing", "[0, 1, 1, 2, 3, 5, 8]")
        take_picture(world.browser, folder, f"goal-{screen}-{theme}")
    world.should_see("Send goal")
    world.click_until("Cancel", lambda: world.sees("canceled"))
    assert world.messages() == []


def test_a_bag_is_recorded_and_played(
    world: World, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.getbasetemp() / "artefacts"
    set_screen(world.browser, "laptop", "light")
    world.open("/bags")
    world.should_see("No bag is in this folder yet")
    world.fill("input[aria-label=Name]", "run")
    world.click_until("Record", lambda: world.sees("run.mcap", "Disk left"))
    world.browser.get("about:blank")  # the recording goes on
    world.open("/bags")
    eventually(lambda: re.search(r"Messages\s+\d\d", world.text), "messages", LONG)
    take_picture(world.browser, folder, "recording-laptop-light")
    bag = world.network.folder / "bags" / "run.mcap"
    world.click_until("Stop", bag.exists)
    world.open("/bags?bag=run.mcap")
    world.should_see("Download", "/chatter", "std_msgs/String")
    size = "return fetch('/bag/run.mcap').then((got) => got.blob()).then((got) => got.size)"
    assert world.ask(size) == bag.stat().st_size
    switch = (
        "[...document.querySelectorAll('.q-toggle')].findLast((one) => one.innerText === 'Loop')"
    )
    world.ask(f"{switch}.click()")
    eventually(
        lambda: world.ask(f"return {switch}.ariaChecked === 'true'"),
        "Loop",
        LONG,
    )
    world.fill("input[aria-label=Prefix]", "/old")
    heard: list[str] = []
    world.network.node("ear").subscription(
        "/old/chatter", String, lambda one: heard.append(one.data)
    )
    world.click_until("Play", lambda: world.sees("Playing"))
    eventually(lambda: heard, "a message of the bag", LONG)
    for screen, theme in (*THEMES, ("laptop", "dark"), ("phone", "light")):
        set_screen(world.browser, screen, theme)
        world.open("/bags?bag=run.mcap")
        world.should_see("Playing", "Download")
        take_picture(world.browser, folder, f"bag-{screen}-{theme}")
    world.press("Stop", lambda: "Playing" not in world.text)
    world.click_until("Delete", lambda: world.sees("It cannot be brought back."))
    world.click_until("Delete it", lambda: world.sees("'run.mcap' is deleted."))
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
