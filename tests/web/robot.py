"""The programs that the page is tried with: a robot, and a browser."""

from __future__ import annotations

import re
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from network import TIMEOUT, Network, Program, eventually

__all__ = ("LONG", "ROBOT", "THEMES", "World", "open_browser", "set_screen", "take_picture")

ROBOT = """
import math
import rosz
from rosz.msgs.example_interfaces.action import Fibonacci
from rosz.msgs.geometry_msgs.msg import Pose, PoseWithCovariance, Quaternion, Twist
from rosz.msgs.nav_msgs.msg import Odometry
from rosz.msgs.sensor_msgs.msg import Image, LaserScan
from rosz.msgs.std_msgs.msg import Float64, String
from rosz.msgs.std_srvs.srv import SetBool
from rosz.reconfigure import Choice, Description, Group, Server, Setting, enumeration

SETTINGS = Description(
    [
        Setting("speed", 0.5, "How fast it drives", min=0.0, max=2.0),
        Setting("count", 3, "How often", min=0, max=10),
        Setting("lights", True, "Whether the lights are on"),
    ],
    [
        Group(
            "Camera",
            (
                Setting("label", "front", "Text in the picture"),
                Setting("mode", 1, edit_method=enumeration([Choice("slow", 0), Choice("fast", 1)])),
            ),
        )
    ],
)


def reconfigured(config, level):
    print("speed is", config["speed"], flush=True)
    return config


def count(goal):
    print("counts to", goal.request.order, flush=True)
    sequence = [0, 1]
    while len(sequence) < goal.request.order:
        sequence.append(sequence[-1] + sequence[-2])
        goal.feedback(Fibonacci.Feedback(sequence))
    goal.wait_for_cancel(3600)
    goal.canceled(Fibonacci.Result(sequence))


with rosz.Node("robot") as node:
    chatter = node.publisher("chatter", String)
    wave = node.publisher("wave", Float64)
    node.subscription("cmd_vel", Twist, lambda got: print("drives", got.linear.x, flush=True))
    node.service("enable", SetBool, lambda request: SetBool.Response(True, f"is {request.data}"))
    node.action_server("count", Fibonacci, count)
    node.params.set("~rate", 20)
    node.params.set("~gains", {"p": 1.5, "names": ["a", "b"], "on": True})
    node.params.watch("~rate", lambda change: print("rate is", change.new, flush=True))
    camera = node.publisher("camera", Image)
    odometry = node.publisher("odom", Odometry)
    scan = node.publisher("scan", LaserScan)
    server = Server(node, SETTINGS, reconfigured)
    node.timer(1.0, lambda event: node.log.warning("the battery is low"))
    print("ready", flush=True)
    for tick in node.rate(20):
        chatter.publish(String(data=f"hello {tick}"))
        if tick % 4 == 0:
            rows = bytes((x * 3 + tick) % 256 for x in range(80)) * 60
            odometry.publish(Odometry(pose=PoseWithCovariance(pose=Pose(orientation=Quaternion(w=1)))))
            scan.publish(
                LaserScan(angle_increment=0.1, range_max=9.0, ranges=[2 + x % 3 for x in range(60)])
            )
            camera.publish(Image(height=60, width=80, encoding="mono8", step=80, data=rows))
        wave.publish(Float64(data=math.sin(tick / 10)))
"""

_CHROMIUM, _DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
_ARGUMENTS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-dev-shm-usage",
    "--use-angle=swiftshader",  # draws 3D without a graphics processor
    "--enable-unsafe-swiftshader",
)
_LAPTOP, _PHONE = (1280, 800), (390, 844)
THEMES = (("laptop", "light"), ("phone", "dark"))
"""The screens and colors that each page is opened with."""
LONG = 4 * TIMEOUT
_ATTEMPT = 3.0
_CLICK = """
const found = [...document.querySelectorAll('.q-btn, .q-tree__node-header-content span')]
  .filter((one) => one.innerText.trim().endsWith(arguments[0]) && one.offsetParent !== null);
if (found.length) found.at(-1).click();
return found.length > 0;
"""
_FILL = """
const field = document.querySelector(arguments[0]);
if (!field) return false;
Object.getOwnPropertyDescriptor(Object.getPrototypeOf(field), 'value').set.call(
  field, arguments[1]);
field.dispatchEvent(new Event('input', {bubbles: true}));
return true;
"""


@contextmanager
def open_browser() -> Iterator[Any]:
    """Open Debian's Chromium without a window; skip the test where it is missing."""
    if _CHROMIUM is None or _DRIVER is None:
        pytest.skip("Debian's chromium and chromium-driver are not installed")
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    for argument in _ARGUMENTS:
        options.add_argument(argument)
    options.binary_location = _CHROMIUM
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    browser = webdriver.Chrome(options=options, service=Service(_DRIVER))
    try:
        browser.set_page_load_timeout(60)
        yield browser
    finally:
        browser.quit()


def set_screen(browser: Any, screen: str, theme: str) -> None:
    """Give the browser the size of a laptop or phone, light or dark."""
    width, height = _LAPTOP if screen == "laptop" else _PHONE
    browser.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": screen == "phone"},
    )
    browser.execute_cdp_cmd(
        "Emulation.setEmulatedMedia",
        {"features": [{"name": "prefers-color-scheme", "value": theme}]},
    )


def take_picture(browser: Any, folder: Path, name: str) -> None:
    """Save what the browser shows."""
    folder.mkdir(exist_ok=True)
    browser.save_screenshot(str(folder / f"{name}.png"))


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
        """Open a page, and wait until what one does there reaches the server."""
        self.browser.get(self.address + path)
        eventually(
            lambda: self.browser.execute_script("return window.did_handshake === true"),
            f"{path} is connected",
            LONG,
        )

    @property
    def text(self) -> str:
        """All text that the browser shows."""
        return str(self.browser.execute_script("return document.body.innerText"))

    def should_see(self, *texts: str) -> None:
        """Wait until texts are on the page."""
        for text in texts:
            eventually(lambda text=text: text in self.text, f"'{text}' on the page", LONG)  # type: ignore[misc]

    def click(self, text: str) -> None:
        """Click the innermost thing with a text, as soon as there is one."""
        eventually(lambda: self.browser.execute_script(_CLICK, text), f"'{text}' to click", LONG)

    def press(self, label: str) -> None:
        """Click the button with an accessible name, as soon as there is one."""
        script = """const found = document.querySelector(`button[aria-label="${arguments[0]}"]`);
            if (found) found.click(); return found !== null"""
        eventually(
            lambda: self.browser.execute_script(script, label), f"the button '{label}'", LONG
        )

    def fill(self, selector: str, text: str) -> None:
        """Write into a field in place of what is there."""
        eventually(
            lambda: self.browser.execute_script(_FILL, selector, text), f"a {selector}", LONG
        )

    def send(self, text: str, button: str, arrived: Callable[[], bool]) -> None:
        """Fill in a form and send it, again if the page was not yet complete the first time."""

        def attempt() -> bool:
            self.fill("textarea", text)
            self.click(button)
            deadline = time.monotonic() + _ATTEMPT
            while not arrived() and time.monotonic() < deadline:
                threading.Event().wait(0.01)
            return arrived()

        eventually(attempt, f"what '{text}' does", LONG)

    def should_hold(self, selector: str, text: str) -> None:
        """Wait until a field holds a text."""
        value = "return document.querySelector(arguments[0])?.value ?? ''"
        eventually(
            lambda: text in self.browser.execute_script(value, selector), f"{text} in a field", LONG
        )

    def messages(self) -> list[str]:
        """Return what is on the console of the browser, and forget it."""
        return [f"{one['level']} {one['message']}" for one in self.browser.get_log("browser")]
