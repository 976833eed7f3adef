"""A node of ROS 1 that starts again and again: nothing of it stays with the bridge."""

from __future__ import annotations

import gc
import socket
import struct
import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from typing import IO, Any
from weakref import WeakSet
from xmlrpc.server import SimpleXMLRPCServer

import pytest
from network import TIMEOUT, eventually, repeats

from rosz.bridges.ros1.frames import decode_header, encode_header, frame
from rosz.bridges.ros1.published import PublishedTopic
from rosz.bridges.ros1.subscribed import SubscribedTopic
from rosz.msgs.std_msgs.msg import String
from rosz.msgs.std_srvs.srv import SetBool
from rosz.node import Node, Publisher, Service, Subscription
from rosz.session.session import Session

from .world import World

pytestmark = [pytest.mark.ros1, pytest.mark.system]

NAME = "/restarted"
_OTHERS = 8
"""Files that other things may have opened meanwhile."""

_KINDS = (Publisher, Subscription, Service, PublishedTopic, SubscribedTopic)


@pytest.fixture(scope="module")
def world() -> Iterator[World]:
    made = World()
    yield made
    made.close()


class RawNode:
    """A node of ROS 1 that costs little: it publishes, subscribes, and serves.

    Args:
        world: The world with its master.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._streams: list[socket.socket] = []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._api = _Api(self._listener.getsockname()[1])
        self._threads = [
            threading.Thread(target=self._api.serve_forever, args=(0.01,)),
            threading.Thread(target=self._serve),
        ]
        for thread in self._threads:
            thread.start()
        port = self._listener.getsockname()[1]
        uri = f"http://127.0.0.1:{self._api.server_address[1]}/"
        self._registered = (
            ("Publisher", "/from_raw", "std_msgs/String", uri),
            ("Subscriber", "/to_raw", "std_msgs/String", uri),
            ("Service", f"{NAME}/ask", f"rosrpc://127.0.0.1:{port}", uri),
        )
        for role, *words in self._registered:
            assert world.call(f"register{role}", NAME, *words)[0] == 1

    def hear(self) -> str:
        """Subscribe, and return the first message."""
        sock = socket.create_connection(("127.0.0.1", self._world.port), TIMEOUT)
        self._streams.append(sock)
        sock.sendall(encode_header({"topic": "/to_raw", "callerid": NAME, "md5sum": "*"}))
        with sock.makefile("rb") as stream:
            assert decode_header(_read(stream))["topic"] == "/to_raw"
            message: Any = String.from_ros1(_read(stream))
        text: str = message.data
        return text

    def _serve(self) -> None:
        """Answer the connections of the bridge."""
        with suppress(OSError):  # the listener is closed
            while True:
                sock, _ = self._listener.accept()
                self._streams.append(sock)
                with sock.makefile("rb") as stream:
                    header = decode_header(_read(stream))
                kind: Any = SetBool if "service" in header else String
                answer = {"callerid": NAME, "type": kind._type, "md5sum": kind._md5sum}
                sock.sendall(encode_header(answer))
                if kind is String:
                    sock.sendall(frame(String(data="from raw").to_ros1()))

    def close(self) -> None:
        """End politely."""
        for role, name, place, uri in self._registered:
            words = (name, place) if role == "Service" else (name, uri)
            assert self._world.call(f"unregister{role}", NAME, *words)[0] == 1
        self._api.shutdown()
        self._api.server_close()
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        for thread in self._threads:
            thread.join(TIMEOUT)
        for sock in self._streams:
            sock.close()


class _Api(SimpleXMLRPCServer):
    def __init__(self, port: int) -> None:
        super().__init__(("127.0.0.1", 0), logRequests=False)
        self._port = port

    def _dispatch(self, method: str, _params: Any) -> Any:
        return [1, "", ["TCPROS", "127.0.0.1", self._port] if method == "requestTopic" else 0]


def _read(stream: IO[bytes]) -> bytes:
    """Return the content of a frame."""
    (size,) = struct.unpack("<I", stream.read(4))
    return stream.read(size)


def _follow(monkeypatch: pytest.MonkeyPatch) -> WeakSet[Any]:
    """Return a set of the objects of the bridge that are made from now on, while they are kept."""
    kept: WeakSet[Any] = WeakSet()
    for kind in _KINDS:

        def begun(self: Any, *args: Any, begin: Any = kind.__init__, **options: Any) -> None:
            kept.add(self)
            begin(self, *args, **options)

        monkeypatch.setattr(kind, "__init__", begun)
    return kept


def test_a_restart_leaves_nothing(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    tokens: list[str] = []
    declare = Session.token

    def recorded(session: Session, key: str) -> Any:
        if NAME.strip("/") in key:
            tokens.append(key)
        return declare(session, key)

    monkeypatch.setattr(Session, "token", recorded)
    kept = _follow(monkeypatch)

    def counts() -> list[int]:
        gc.collect()
        files = len(list(Path("/proc/self/fd").iterdir()))
        names = (thread.name for thread in threading.enumerate())
        return [files - _OTHERS, sum("_raw" in name or NAME in name for name in names), len(kept)]

    with Node("neighbour", context=world.network.context()) as node:
        heard: SimpleQueue[Any] = SimpleQueue()
        node.subscription("/from_raw", String, heard.put)
        node.publisher("/to_raw", String, latch=True).publish("to raw")
        view = node.context.graph.view

        def restart() -> None:
            raw = RawNode(world)
            assert heard.get(timeout=TIMEOUT).data == "from raw"
            assert raw.hear() == "to raw"
            eventually(lambda: view().servers(f"{NAME}/ask"))
            raw.close()
            eventually(lambda: not any(one.node_name == NAME for one in view().entities()))

        for _ in range(2):  # what is kept for the next start is made
            restart()
        known, before = set(tokens), counts()
        before[0] += _OTHERS
        for _ in range(repeats(20, 500)):
            restart()
        eventually(lambda: all(map(int.__le__, counts(), before)), f"{counts()} like {before}")
        assert set(tokens) - known == set()  # Zenoh keeps memory for each key that a token ever had
