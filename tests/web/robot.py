"""The programs that the page is tried with: a robot, and a browser."""

from __future__ import annotations

import base64
import re
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from network import TIMEOUT, Network, Program
from network import eventually as eventually_at_once

__all__ = (
    "LONG",
    "ROBOT",
    "SPACE",
    "THEMES",
    "World",
    "eventually",
    "open_browser",
    "set_screen",
    "start_server",
    "take_picture",
)

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

SPACE = """
import math
import struct
import rosz
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import *
from rosz.msgs.nav_msgs.msg import MapMetaData, OccupancyGrid, Path
from rosz.msgs.sensor_msgs.msg import LaserScan, PointCloud2, PointField
from rosz.msgs.std_msgs.msg import ColorRGBA, Header
from rosz.msgs.visualization_msgs.msg import Marker, MarkerArray
from rosz.transforms import StaticTransformBroadcaster, TransformBroadcaster, from_rpy

URDF = '''<robot name="r"><material name="blue"><color rgba="0.15 0.35 0.85 1"/></material>
<link name="base_link"><visual><origin xyz="0 0 0.2"/>
<geometry><box size="0.8 0.5 0.25"/></geometry>
<material name="blue"/></visual><visual><origin xyz="0 0.3 0.15" rpy="1.5708 0 0"/>
<geometry><cylinder radius="0.15" length="0.08"/></geometry></visual>
<visual><origin xyz="0 -0.3 0.15" rpy="1.5708 0 0"/>
<geometry><cylinder radius="0.15" length="0.08"/></geometry></visual></link>
<link name="laser"><visual><geometry><mesh filename="package://nowhere/laser.stl"/></geometry></visual>
</link></robot>'''
FLAT = Quaternion(0, 0, 0, 1)


def marker(number, kind, **fields):
    return Marker(header=Header(frame_id="map"), ns="things", id=number, type=kind, **fields)


with rosz.Node("robot") as node:
    moving, fixed = TransformBroadcaster(node), StaticTransformBroadcaster(node)
    header = Header(frame_id="base_link")
    fixed.send(TransformStamped(header, "laser", Transform(Vector3(0.2, 0, 0.4), FLAT)))
    node.params.set("/robot_description", URDF)
    cells = [100 if x in (0, 99) or y in (0, 79) else 0 for y in range(80) for x in range(100)]
    info = MapMetaData(resolution=0.1, width=100, height=80, origin=Pose(Point(-5, -4, 0), FLAT))
    map_ = node.publisher("map", OccupancyGrid, latch=True)
    map_.publish(OccupancyGrid(header=Header(frame_id="map"), info=info, data=cells))
    markers = node.publisher("markers", MarkerArray, latch=True)
    green, gold = ColorRGBA(0.1, 0.7, 0.3, 1), ColorRGBA(0.9, 0.6, 0.1, 1)
    markers.publish(MarkerArray([
        marker(1, Marker.CYLINDER, pose=Pose(Point(-2, 2, 0.5), FLAT), scale=Vector3(0.6, 0.6, 1),
               color=green),
        marker(2, Marker.TEXT_VIEW_FACING, pose=Pose(Point(-2, 2, 1.3), FLAT), text="a marker",
               scale=Vector3(0, 0, 0.3), color=green),
        marker(3, Marker.LINE_STRIP, pose=Pose(Point(), FLAT), scale=Vector3(0.05, 0, 0),
               color=gold, points=[Point(-4, -3, 0), Point(-2, -3, 0.5), Point(-2, -1, 0)]),
        marker(4, Marker.SPHERE, pose=Pose(Point(3, 2.5, 0.4), FLAT), scale=Vector3(.8, .8, .8),
               color=ColorRGBA(0.8, 0.2, 0.2, 0.6)),
    ]))
    scan, path = node.publisher("scan", LaserScan), node.publisher("path", Path)
    cloud = node.publisher("cloud", PointCloud2)
    fields = [PointField(name, 4 * at, PointField.FLOAT32, 1) for at, name in enumerate("xyz")]
    points = b"".join(
        struct.pack("<3f", 1 + x / 100, 1 + y / 100, 0.6 + math.sin(x / 15) * math.cos(y / 20) / 5)
        for x in range(320) for y in range(320)
    )
    goal = lambda got: print(f"goes to {got.pose.position.x:.1f} {got.pose.position.y:.1f}",
                             got.header.frame_id, flush=True)
    node.subscription("move_base_simple/goal", PoseStamped, goal)
    node.subscription("initialpose", PoseWithCovarianceStamped,
                      lambda got: print("starts at", got.pose.covariance[0], flush=True))
    node.subscription("clicked_point", PointStamped,
                      lambda got: print(f"point {got.point.z:.1f}", flush=True))
    poses = []
    print("ready", flush=True)
    for tick in node.rate(10):
        now, angle = Time.from_nsec(node.now()), tick / 50
        turned = Quaternion(*from_rpy(0, 0, angle + math.pi / 2))
        place = Point(2 * math.cos(angle), 2 * math.sin(angle), 0)
        header = Header(stamp=now, frame_id="map")
        moving.send(TransformStamped(header, "base_link",
                                     Transform(Vector3(place.x, place.y, 0), turned)))
        poses = [*poses[-300:], PoseStamped(header, Pose(place, turned))]
        path.publish(Path(header, poses))
        scan.publish(LaserScan(header=Header(stamp=now, frame_id="laser"), angle_min=-math.pi,
                               angle_increment=math.pi / 180, range_max=9.0,
                               ranges=[1.6 + 0.3 * math.sin(i / 10) for i in range(360)]))
        if tick % 5 == 0:
            width = len(points) // 12
            cloud.publish(PointCloud2(header=header, height=1, width=width, fields=fields,
                                      point_step=12, row_step=len(points), data=points))
"""
"""A robot that drives in a circle, and everything around it."""

_SERVER = """
import os
os.nice = lambda increment: 0
from rosz.__main__ import main
main()
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
_ATTEMPT = 10.0
_LOOK_SECONDS = 0.05
"""A browser that is asked without a pause has no time to draw."""
_BROWSER_SECONDS = 300
_CONNECTED = "return window.did_handshake === true && window.socket.connected"
_CLICK = """
if (!(window.did_handshake && window.socket.connected)) return false;
const found = [...document.querySelectorAll('.q-btn, .q-tree__node-header-content span')]
  .filter((one) => one.innerText.trim().endsWith(arguments[0]) && one.offsetParent !== null);
if (found.length) found.at(-1).click();
return found.length > 0;
"""
_PRESS = """
if (!(window.did_handshake && window.socket.connected)) return false;
const found = document.querySelector(`button[aria-label="${arguments[0]}"]`);
if (found) found.click();
return found !== null;
"""
_FILL = """
if (!(window.did_handshake && window.socket.connected)) return false;
const field = document.querySelector(arguments[0]);
if (!field) return false;
Object.getOwnPropertyDescriptor(Object.getPrototypeOf(field), 'value').set.call(
  field, arguments[1]);
field.dispatchEvent(new Event('input', {bubbles: true}));
return true;
"""
_KEEP_NOTIFICATIONS = """
window.notified = new Set();
new MutationObserver(() => {
  for (const one of document.querySelectorAll('.q-notification')) {
    window.notified.add(one.textContent);
  }
}).observe(document, {childList: true, subtree: true, characterData: true});
"""
"""Notifications disappear after seconds, in which a busy machine may not look at the page."""
_SEEN = "return [document.body.innerText, ...window.notified].join('\\n')"


def start_server(network: Network, *options: str, **variables: str) -> Program:
    """Start ``rosz web`` at a free port. It would give way to all other programs: other tests."""
    return network.program(_SERVER, "web", "--port", "0", *options, **variables)


def _start(options: Any) -> Any:
    """Start the browser; again if that takes longer than the minute which its driver waits."""
    from selenium import webdriver
    from selenium.common.exceptions import WebDriverException
    from selenium.webdriver.chrome.service import Service

    for _ in range(2):
        with suppress(WebDriverException):
            return webdriver.Chrome(options=options, service=Service(_DRIVER))
    return webdriver.Chrome(options=options, service=Service(_DRIVER))


@contextmanager
def open_browser() -> Iterator[Any]:
    """Open Debian's Chromium without a window; skip the test where it is missing."""
    if _CHROMIUM is None or _DRIVER is None:
        pytest.skip("Debian's chromium and chromium-driver are not installed")
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    for argument in _ARGUMENTS:
        options.add_argument(argument)
    options.binary_location = _CHROMIUM
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    browser = _start(options)
    try:
        browser.set_page_load_timeout(_BROWSER_SECONDS)
        browser.set_script_timeout(_BROWSER_SECONDS)
        browser.execute_cdp_cmd(
            "Page.addScriptToEvaluateOnNewDocument", {"source": _KEEP_NOTIFICATIONS}
        )
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
    """Save what the browser shows; its driver's own command would give up after 10 s."""
    folder.mkdir(exist_ok=True)
    found = browser.execute_cdp_cmd("Page.captureScreenshot", {"format": "png"})
    (folder / f"{name}.png").write_bytes(base64.b64decode(found["data"]))


def eventually(condition: Callable[[], Any], what: str, timeout: float = LONG) -> None:
    """Wait until a condition of a page holds; a page that is loaded again meanwhile is no error."""
    from selenium.common.exceptions import (
        JavascriptException,
        NoSuchElementException,
        StaleElementReferenceException,
        TimeoutException,
    )

    not_yet = (
        JavascriptException,
        NoSuchElementException,
        StaleElementReferenceException,
        TimeoutException,
    )

    def holds() -> bool:
        with suppress(*not_yet):
            if condition():
                return True
        threading.Event().wait(_LOOK_SECONDS)
        return False

    eventually_at_once(holds, what, timeout)


def _is_so_soon(condition: Callable[[], bool]) -> bool:
    deadline = time.monotonic() + _ATTEMPT
    while not (found := condition()) and time.monotonic() < deadline:
        threading.Event().wait(_LOOK_SECONDS)
    return found


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
        eventually(lambda: self.ask(_CONNECTED), f"{path} is connected")

    def ask(self, script: str, *arguments: Any) -> Any:
        """Return what a script gives that runs in the page."""
        return self.browser.execute_script(script, *arguments)

    @property
    def text(self) -> str:
        """All text that the browser shows."""
        return str(self.ask("return document.body.innerText"))

    def sees(self, *texts: str | re.Pattern[str]) -> bool:
        """Return whether texts are on the page, or have been in its notifications."""
        seen = str(self.ask(_SEEN))
        return all(
            text in seen if isinstance(text, str) else text.search(seen) is not None
            for text in texts
        )

    def should_see(self, *texts: str | re.Pattern[str]) -> None:
        """Wait until texts are on the page, or have been in its notifications."""
        for text in texts:
            eventually(lambda text=text: self.sees(text), f"'{text}' on the page")  # type: ignore[misc]

    def click(self, text: str) -> None:
        """Click the innermost thing with a text, as soon as there is one."""
        eventually(lambda: self.ask(_CLICK, text), f"'{text}' to click")

    def press(self, label: str, arrived: Callable[[], bool] = lambda: True) -> None:
        """Click the button with an accessible name.

        Args:
            label: The name.
            arrived: Function that returns whether the click has reached the server. If not, it is
                repeated: a table that is drawn anew has other buttons, and one that is no more on
                the page when the click comes does nothing.
        """
        self._repeat(lambda: bool(self.ask(_PRESS, label)), arrived, f"the button '{label}'")

    def fill(self, selector: str, text: str) -> None:
        """Write into a field in place of what is there."""
        eventually(lambda: self.ask(_FILL, selector, text), f"a {selector}")

    def click_until(self, text: str, arrived: Callable[[], bool]) -> None:
        """Click what has a text, again if the page was not yet complete the first time."""
        self._repeat(lambda: bool(self.ask(_CLICK, text)), arrived, f"what '{text}' does")

    def _repeat(self, act: Callable[[], bool], arrived: Callable[[], bool], what: str) -> None:
        acted = False

        def attempt() -> bool:
            nonlocal acted
            if acted and arrived():
                return True
            acted = act() or acted
            return acted and _is_so_soon(arrived)

        eventually(attempt, what)

    def send(self, text: str, button: str, arrived: Callable[[], bool]) -> None:
        """Fill in a form and send it, again if the page was not yet complete the first time."""

        def attempt() -> bool:
            self.fill("textarea", text)
            self.click(button)
            return _is_so_soon(arrived)

        eventually(attempt, f"what '{text}' does")

    def should_hold(self, selector: str, text: str) -> None:
        """Wait until a field holds a text."""
        value = "return document.querySelector(arguments[0])?.value ?? ''"
        eventually(lambda: text in self.ask(value, selector), f"{text} in a field")

    def messages(self) -> list[str]:
        """Return what is on the console of the browser, and forget it."""
        entries = [f"{one['level']} {one['message']}" for one in self.browser.get_log("browser")]
        # INFO are remarks: that a button took no focus from a field where somebody is, and that a
        # page which the browser was too busy to keep connected is loaded again.
        return [text for text in entries if not text.startswith("INFO ")]
