"""Visitors who are too many, who sleep, or who may not come: others are not affected."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from urllib.error import HTTPError

import pytest
from network import TIMEOUT, Network, eventually
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from rosz.msgs.std_srvs.srv import Empty

from .visitor import Visitor

pytestmark = [pytest.mark.system]
LONG = 4 * TIMEOUT


SERVER = """
import sys
from rosz.node import Node
from rosz.web import PageSettings, open_page
with Node("web") as node:
    server, (address, *_) = open_page(node, PageSettings(port=0, most_pages=int(sys.argv[1])))
    print("the page is at", address, flush=True)
    print("aiohttp is loaded:", "aiohttp" in sys.modules, flush=True)
    from nicegui import core
    for line in sys.stdin:
        core.sio.eio.ping_timeout = float(line)
        print("waits for answers", line, flush=True)
"""
MOST = 5
SOCKET = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"


class Pages:
    """A server of few pages, and a node that they show."""

    def __init__(self, network: Network) -> None:
        self.network = network
        self.node = network.node("robot")
        self.server = server = network.program(SERVER, str(MOST))
        self.address = server.wait_for("the page is at", LONG).split()[-1]

    @contextmanager
    def waiting(self, seconds: int) -> Iterator[None]:
        """Let the server wait for answers to its pings for some seconds rather than 20."""
        self._wait_for_answers(seconds)
        yield
        self._wait_for_answers(20)

    def _wait_for_answers(self, seconds: int) -> None:
        before = len(self.server.lines)
        self.server.say(f"{seconds}")
        self.server.wait_for("waits for answers", after=before)

    def observed(self) -> bool:
        """Return whether a page observes the log."""
        view = self.node.context.graph.view()
        return any(token.node_name == "/web" for token in view.subscriptions("/rosout"))


@pytest.fixture(scope="module")
def pages() -> Iterator[Pages]:
    pytest.importorskip("nicegui")
    network = Network()
    try:
        yield Pages(network)
    finally:
        network.close()


def test_pages_give_way_to_other_programs(pages: Pages) -> None:
    own = os.getpriority(os.PRIO_PROCESS, 0)
    found = set()
    for thread in Path(f"/proc/{pages.server.pid}/task").iterdir():
        with suppress(ProcessLookupError):  # it has ended
            found.add(os.getpriority(os.PRIO_PROCESS, int(thread.name)))
    assert found == {own, min(19, own + 10)}


def refusal(address: str) -> tuple[int, str]:
    """Return the status and the text with which a visitor is refused."""
    with pytest.raises(HTTPError) as caught:
        Visitor(address)
    with caught.value as error:
        return error.code, error.read().decode()


def visit(pages: Pages, path: str = "/", *, awake: bool = True) -> Visitor:
    """Open a page when there is room: those of the tests before are kept for a while."""
    opened: list[Visitor] = []

    def opens() -> bool:
        try:
            opened.append(Visitor(pages.address, path, awake=awake))
        except HTTPError:
            return False
        return True

    eventually(opens, "room for a page", LONG)
    return opened[0]


def test_the_start_leaves_out_what_serves_no_page(pages: Pages) -> None:
    assert pages.server.wait_for("aiohttp is loaded", LONG).endswith("False")


def test_too_many(pages: Pages) -> None:
    """Beyond the limit pages are refused in words, and those that are open go on."""
    visitors = [Visitor(pages.address, "/graph") for _ in range(MOST)]
    status, text = refusal(pages.address)
    assert status == 503
    assert f"{MOST} pages are open, which is the limit" in text
    pages.network.node("newcomer")
    for one in visitors:
        one.wait_for("newcomer")
        one.close()
    visit(pages).close()


def test_one_that_is_busy(pages: Pages) -> None:
    """A browser that draws for seconds before it answers a ping keeps its page."""
    one = visit(pages)
    one.wait_for('"pingTimeout":20000')
    one.close()


def test_one_that_sleeps(pages: Pages) -> None:
    """A page whose browser reads nothing is closed, with what it observes; another one goes on."""
    with pages.waiting(6):
        asleep = visit(pages, "/console", awake=False)
        eventually(pages.observed, "the page to observe the log", LONG)
        awake = visit(pages, "/services")
        eventually(lambda: not pages.observed(), "the end of the page that sleeps", LONG)
    pages.node.service("late", Empty, lambda _: Empty.Response())
    awake.wait_for("/late")
    awake.close()
    asleep.close()


def test_foreign_pages_and_garbage(pages: Pages) -> None:
    """A websocket of another origin is refused; frames that are no messages end theirs alone."""
    one = visit(pages, "/graph")
    place = pages.address.replace("http", "ws", 1) + SOCKET
    with pytest.raises(InvalidStatus, match="403"), connect(place, origin=Origin("http://evil")):
        pass
    garbage = ("x" * 1000, b"\x00" * 1000, '42["event",{"client_id":"none"}]', '42["handshake",5]')
    for data in garbage:
        with connect(place, open_timeout=LONG, max_size=None) as link:
            link.recv(timeout=LONG)
            link.send("40")
            link.send(data)
    with connect(place, open_timeout=LONG) as link:
        link.recv(timeout=LONG)
        link.socket.sendall(b"\x82\xff" + (1 << 30).to_bytes(8, "big") + bytes(4))
        with pytest.raises(ConnectionClosed, match="1009"):
            list(link)
    pages.network.node("third")
    one.wait_for("third")
    one.close()
