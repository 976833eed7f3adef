"""Clients that send what no browser sends: the page's server goes on, and logs no traceback."""

from __future__ import annotations

import json
import random
import re
import socket
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from network import TIMEOUT, Network
from websockets.exceptions import ConnectionClosed

from .visitor import Visitor

pytestmark = [pytest.mark.system]
LONG = 4 * TIMEOUT
MOST_BYTES = 600 << 20
POLLING = "/_nicegui_ws/socket.io/?EIO=4&transport=polling"


class Page:
    """A server of the page, which may need a password, and the node that it shows."""

    def __init__(self, network: Network, password: str) -> None:
        self.network = network
        self.node = network.node("robot")
        self.password = password
        word = network.folder / "word"
        word.write_text(password)
        options = ("--password-file", str(word)) if password else ()
        self.server = network.run("-m", "rosz", "web", "--port", "0", *options)
        line = self.server.wait_for("the page is at", LONG)
        self.address = line.split()[-1]
        self.cookie = ""
        if password:
            answer = self.send(request(urlsplit(self.address).netloc, f"GET /?token={password}"))
            self.cookie = re.findall(r"(?i)set-cookie: ([^;]*)", answer.decode())[0]

    def send(self, data: bytes, *, wait: bool = True) -> bytes:
        """Send bytes on a connection of their own, and return the beginning of what comes back."""
        host = urlsplit(self.address)
        place = host.hostname, host.port or 80
        with socket.create_connection(place, TIMEOUT) as link, suppress(ConnectionError):
            link.sendall(data)
            return link.recv(1 << 16) if wait else b""
        return b""

    def check(self) -> None:
        """Check that the server serves, has logged no traceback, and is not large."""
        visitor = Visitor(self.address, "/graph", cookie=self.cookie)
        visitor.should_see("/robot")
        visitor.close()
        assert "Traceback" not in self.server.output
        status = Path(f"/proc/{self.server.pid}/status").read_text()
        rows = dict(line.split(":", 1) for line in status.splitlines())
        assert int(rows["VmHWM"].split()[0]) << 10 < MOST_BYTES


@pytest.fixture(scope="module", params=["", "secret"], ids=["open", "password"])
def page(request: pytest.FixtureRequest) -> Iterator[Page]:
    pytest.importorskip("nicegui")
    network = Network()
    try:
        yield Page(network, request.param)
    finally:
        network.close()


def request(host: str, head: str, *more: str) -> bytes:
    """Return a request with a host and some lines."""
    lines = [f"{head} HTTP/1.1", f"Host: {host}", *more, "", ""]
    return "\r\n".join(lines).encode(errors="surrogateescape")


def test_requests_that_are_not_finished(page: Page) -> None:
    """A client leaves before its request is read."""
    host = urlsplit(page.address).netloc
    for path in (POLLING, "/", "/graph", "/3d?show=grid", "/none"):
        for number in range(10):
            page.send(
                request(host, f"POST {path}", f"Content-Length: {1 + 1000 * number}"), wait=False
            )
            page.send(request(host, f"GET {path}"), wait=False)
    page.check()


def test_odd_requests(page: Page) -> None:
    host, rng = urlsplit(page.address).netloc, random.Random()
    seed = rng.randrange(1 << 32)
    print("seed", seed)
    rng.seed(seed)
    heads = [
        f"{method} {path}"
        for method in ("GET", "POST", "OPTIONS", "PUT", "BREW", "HEAD")
        for path in (
            POLLING,
            f"{POLLING}&sid=none",
            "/_nicegui_ws/socket.io/?EIO=3",
            "/_nicegui_ws/socket.io/?transport=odd&EIO=4",
            "/_nicegui_ws/socket.io/?EIO=4&transport=polling&j=x",
            "/%00",
            "/%ff%fe?%ff=%00",
            "/_nicegui/../../../etc/passwd",
            "/_nicegui/auto/static/%2e%2e/%2e%2e/etc/passwd",
            "/3d?show=" + "[" * 1000,
            "/topics?topic=%00&topic=" + "x" * 8000,
            "*",
            "/login?next=/%0d%0aX:%20y&next=//evil&token=%00&token=" + "x" * 1000,
            "/login?next=%2f%5cevil.com&token=%ff",
        )
    ]
    bodies = ("", "password=%00&password=%ff", "password=" + "x" * 9000, "\0" * 40, "&=&" * 9)
    for head in rng.sample(heads, 24):
        body = rng.choice(bodies)
        length = rng.choice((len(body), len(body), 0, 1 << 40, -1, "x"))
        cookie = rng.choice(("", "rosz_web=é\udcff", "a=" + "b" * 3000, "=;;=", 'x="\\777'))
        lines = [f"Content-Length: {length}", f"Cookie: {cookie}", "Connection: close"]
        data = request(host, head, *lines) + body.encode()
        answer = page.send(data, wait=length != 1 << 40)
        assert b" 500 " not in answer[:20], head
        assert not page.password or b" 200 " not in answer[:20], head
        damaged = bytearray(data)
        for _ in range(rng.randrange(1, 6)):
            damaged[rng.randrange(len(damaged))] = rng.randrange(256)
        page.send(bytes(damaged) + b"\r\n\r\n", wait=False)
    page.send(request(host, "GET /", *(f"X-{n}: {'y' * 1000}" for n in range(200))))
    page.check()


CLIENT = "the id of the client"


def frames(rng: random.Random) -> Iterator[str | bytes]:
    """Yield texts and bytes that are nearly messages of Socket.IO, or none at all."""
    event = {"id": 4, "client_id": CLIENT, "listener_id": "x", "args": [json.dumps(None)]}
    names = ("event", "handshake", "javascript_response", "ack", "log", "too_long_message", "x")
    values: tuple[Any, ...] = (None, [], {}, "x", -1, 1e300, 10**30, CLIENT, [[]], True)
    for _ in range(300):
        wrong = {**event, rng.choice(list(event)): rng.choice(values)}
        if rng.random() < 0.3:
            del wrong[rng.choice(list(wrong))]
        sent = wrong if rng.random() < 0.8 else rng.choice(values)
        text = "42" + json.dumps([rng.choice(names), sent])
        letters = list(text)
        for _ in range(rng.choice((0, 0, 1, 5))):
            letters[rng.randrange(len(letters))] = chr(rng.choice((0, 34, 44, 91, 92, 125, 0xD7FF)))
        yield "".join(letters)
    deep = {**event, "args": ["[" * 100_000]}
    yield "42" + json.dumps(["event", deep])
    yield from ("", "4", "5", "6", "1", "40/other,", "41", "42", "43", "44", "45", "451-", "4x")
    yield from ("42" + "[" * 100_000, '42["event",' + '{"a":' * 50_000, "42" + "9" * 10_000)
    yield from ('451-["event",{"_placeholder":true,"num":0}]', b"\x00" * 1000)
    yield from ('459999999-["event",{}]', '42999999999999999999["event",{}]', b"\xff" * 9)
    yield '42["event",' + json.dumps("y" * 900_000) + "]"


def test_frames_that_are_no_messages(page: Page) -> None:
    """Each may end its own connection; others go on."""
    rng = random.Random()
    seed = rng.randrange(1 << 32)
    print("seed", seed)
    rng.seed(seed)
    visitor = Visitor(page.address, "/topics", cookie=page.cookie)
    for frame in frames(rng):
        if isinstance(frame, str):
            sent: str | bytes = frame.replace(CLIENT, visitor._client)
        else:
            sent = frame
        try:
            visitor.link.send(sent)
        except ConnectionClosed:
            visitor.close()
            visitor = Visitor(page.address, "/topics", cookie=page.cookie)
    visitor.close()
    page.check()


def test_many_frames(page: Page) -> None:
    visitor = Visitor(page.address, "/graph", cookie=page.cookie)
    with suppress(ConnectionClosed):
        for number in range(5000):
            event = {"client_id": visitor._client, "id": number}
            visitor.link.send("42" + json.dumps(["event", event]))
    page.check()
    visitor.close()
