"""The programs that the page is tried with: a robot, and a browser."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

__all__ = ("ROBOT", "THEMES", "open_browser", "set_screen", "take_picture")

ROBOT = """
import math
import rosz
from rosz.msgs.geometry_msgs.msg import Twist
from rosz.msgs.sensor_msgs.msg import Image
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


with rosz.Node("robot") as node:
    chatter = node.publisher("chatter", String)
    wave = node.publisher("wave", Float64)
    node.subscription("cmd_vel", Twist, lambda got: print("drives", got.linear.x, flush=True))
    node.service("enable", SetBool, lambda request: SetBool.Response(True, f"is {request.data}"))
    node.params.set("~rate", 20)
    node.params.set("~gains", {"p": 1.5, "names": ["a", "b"], "on": True})
    node.params.watch("~rate", lambda change: print("rate is", change.new, flush=True))
    camera = node.publisher("camera", Image)
    server = Server(node, SETTINGS, reconfigured)
    node.timer(1.0, lambda event: node.log.warning("the battery is low"))
    print("ready", flush=True)
    for tick in node.rate(20):
        chatter.publish(String(data=f"hello {tick}"))
        if tick % 4 == 0:
            rows = bytes((x * 3 + tick) % 256 for x in range(80)) * 60
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
