"""The drawing of the graph while the system changes faster than it is drawn."""

from __future__ import annotations

import pytest
from network import TIMEOUT, Network

from .visitor import Visitor

pytestmark = [pytest.mark.system]
LONG = 4 * TIMEOUT

SERVER = """
import sys
from rosz import diagram
from rosz.node import Node
from rosz.web import PageSettings, open_page

make_picture, write_svg, running = diagram.make_picture, diagram.write_svg, []


def names(picture):
    return " ".join(box.name for box in picture.boxes)


def tell_what_is_made(*given):
    picture = make_picture(*given)
    print("sees", names(picture), flush=True)
    return picture


def write_when_told(picture, *rest):
    if picture.boxes:
        running.append(picture)
        print(f"draws {names(picture)}, {len(running)} at a time", flush=True)
        sys.stdin.readline()
        running.pop()
    return write_svg(picture, *rest)


diagram.make_picture, diagram.write_svg = tell_what_is_made, write_when_told
with Node("rosz_web_slow") as node:
    server, (address, *_) = open_page(node, PageSettings(port=0))
    print("the page is at", address, flush=True)
    node.context.wait_for_shutdown()
"""


def test_what_is_drawn_is_shown_though_more_has_come_meanwhile() -> None:
    pytest.importorskip("nicegui")
    network = Network()
    try:
        network.node("first")
        server = network.program(SERVER)
        address = server.wait_for("the page is at", LONG).split()[-1]
        visitor = Visitor(address, "/graph")
        server.wait_for("draws /first, 1 at a time", LONG)
        network.node("second")
        server.wait_for("sees /first /second", LONG)
        server.say("go on")
        visitor.wait_for("node:/first")
        server.wait_for("draws /first /second, 1 at a time", LONG)
        server.say("go on")
        visitor.wait_for("node:/second")
        visitor.close()
    finally:
        network.close()
