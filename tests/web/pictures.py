"""Pictures of all pages with a lively system: ``python -m tests.web.pictures FOLDER``.

Each is taken on a laptop and a phone, light and dark. With ``--manual``, those of the manual are
taken instead.
"""

from __future__ import annotations

import base64
import sys
from argparse import ArgumentParser
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from network import Network, Program

from rosz.web.pages.layout import ENTRIES

from .robot import LONG, ROBOT, World, eventually, open_browser, set_screen, start_server

LAUNCHES = Path(__file__).parents[2] / "launch"
MANUAL = Path(__file__).parents[2] / "rosz" / "share" / "manual" / "pictures"
SETTLED = 5.0
"""Seconds until rates are measured, and what a page shows fills its window."""
QUERY = {
    "/actions": "?action=/arm/count",
    "/bags": "?bag=run.mcap",
    "/graph": "?content=all",
    "/drive": "?topic=/cmd_vel",
    "/images": "?topics=/arm/camera",
    "/3d": "?frame=odom&show=grid,tf,robot,/scan,/odom",
    "/plot": "?fields=/turtlesim1/turtle1/pose/x:y,/arm/wave/data@2",
    "/reconfigure": "?server=/arm/robot",
    "/services": "?service=/arm/enable",
    "/topics": "?topic=/odom",
}
OF_MANUAL = {
    "overview": ("/", "laptop", "light"),
    "graph": ("/graph?content=all&hide=tf,debug,parameters", "laptop", "light"),
    "plot": ("/plot" + QUERY["/plot"], "laptop", "light"),
    "topics": ("/topics?topic=/turtlesim1/turtle1/cmd_vel", "laptop", "light"),
    "console": ("/console", "laptop", "light"),
    "drive": ("/drive" + QUERY["/drive"], "laptop", "light"),
    "phone": ("/", "phone", "dark"),
}


@contextmanager
def lively() -> Iterator[World]:
    """Start turtles, a TurtleBot3, a robot with settings and a camera, a bag, and the page."""
    network = Network()
    try:
        with open_browser() as browser:
            robot = network.program(ROBOT, ROS_NAMESPACE="/arm")
            robot.wait_for("ready", LONG)
            turtles = str(LAUNCHES / "turtle_mimic.launch")
            network.run("-m", "rosz", "launch", turtles, "headless:=true")
            network.run(
                "-m", "rosz", "launch", "turtlebot3_sim", "turtlebot3_sim.launch", "headless:=true"
            )
            bags = network.folder / "bags"
            bags.mkdir()
            bag = str(bags / "run.mcap")
            recorder: Program = network.run(
                "-m", "rosz", "bag", "record", "-O", bag, "--duration=4", "/odom", "/arm/chatter"
            )
            assert recorder.exit_code(LONG) == 0, recorder.output
            server = start_server(network, "--bags", str(bags))
            yield World(network, robot, server, browser)
    finally:
        network.close()


def take(world: World, path: str, screen: str, theme: str, file: Path) -> None:
    """Open a page, let it fill, and write its picture as WebP."""
    set_screen(world.browser, screen, theme)
    world.open(path)
    filled = f"return performance.now() > {SETTLED * 1000}"
    eventually(lambda: world.ask(filled), f"{path} is filled")
    settings = {"format": "webp", "quality": 80}
    found = world.browser.execute_cdp_cmd("Page.captureScreenshot", settings)
    file.write_bytes(base64.b64decode(found["data"]))
    print(file)


def main() -> None:
    """Take the pictures."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=MANUAL)
    parser.add_argument("--manual", action="store_true", help="those of the manual")
    parser.add_argument("--only", help="one, such as /graph, or graph of the manual")
    options = parser.parse_args()
    options.folder.mkdir(exist_ok=True)
    with lively() as world:
        if options.manual:
            for name, (path, screen, theme) in OF_MANUAL.items():
                if options.only not in (None, name):
                    continue
                take(world, path, screen, theme, options.folder / f"{name}.webp")
            return
        for entry in ENTRIES:
            if options.only not in (None, entry.path):
                continue
            path = entry.path + QUERY.get(entry.path, "")
            for screen in ("laptop", "phone"):
                for theme in ("light", "dark"):
                    name = f"{entry.path.strip('/') or 'overview'}-{screen}-{theme}.webp"
                    take(world, path, screen, theme, options.folder / name)


if __name__ == "__main__":
    main()
