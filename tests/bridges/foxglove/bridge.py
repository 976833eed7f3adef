"""A bridge of a test, and a client that speaks the protocol by hand."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from network import TIMEOUT, Network
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from rosz.bridges.foxglove import FoxgloveBridge
from rosz.node import Node

__all__ = ("Bridge", "Client", "bridge_on", "package_in")

SUBPROTOCOLS = [Subprotocol("foxglove.websocket.v1")]


class Bridge:
    """A bridge on the network of a test."""

    def __init__(self, network: Network, node: Node, server: FoxgloveBridge) -> None:
        self.network = network
        self.node = node
        self.server = server

    def wait_for_subscription(self, topic: str) -> None:
        """Wait until the bridge knows a subscription of a topic: it publishes to no other."""
        self.node.context.graph.wait_for_subscribers(topic, 1, TIMEOUT)

    @contextmanager
    def client(self, path: str = "", **options: Any) -> Iterator[Client]:
        """Connect."""
        url = f"ws://127.0.0.1:{self.server.port}/{path}"
        given = {"open_timeout": TIMEOUT, "max_size": None, "subprotocols": SUBPROTOCOLS, **options}
        with connect(url, **given) as connection:
            yield Client(connection)


class Client:
    """A client that sends and receives messages.

    Attributes:
        channels: Channels by topic.
        services: Services by name.
        waiting: Messages that were received while the client waited for others.
    """

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection
        self.channels: dict[str, Any] = {}
        self.services: dict[str, Any] = {}
        self.waiting: list[Any] = []

    def send(self, op: str, **members: Any) -> None:
        self.connection.send(json.dumps({"op": op, **members}))

    def send_binary(self, form: str, *values: Any, data: bytes = b"") -> None:
        self.connection.send(struct.pack(f"<{form}", *values) + data)

    def _receive(self) -> Any:
        got = self.connection.recv(timeout=TIMEOUT)
        if isinstance(got, bytes):
            return got
        value = json.loads(got)
        for channel in value.get("channels", ()):
            self.channels[channel["topic"]] = channel
        for service in value.get("services", ()):
            self.services[service["name"]] = service
        return value

    def wait(self, condition: Callable[[Any], Any]) -> Any:
        """Return the next message that meets a condition; others wait for their turn."""
        for number, one in enumerate(self.waiting):
            if condition(one):
                return self.waiting.pop(number)
        while not condition(got := self._receive()):
            self.waiting.append(got)
        return got

    def wait_op(self, op: str) -> Any:
        """Return the next JSON message of a kind."""
        return self.wait(lambda one: isinstance(one, dict) and one["op"] == op)

    def wait_status(self) -> str:
        """Return the text of the next status."""
        text: str = self.wait_op("status")["message"]
        return text

    def wait_data(self) -> tuple[int, int, bytes]:
        """Return the subscription, the time and the data of the next message of a topic."""
        frame = self.wait(lambda one: isinstance(one, bytes) and one[0] == 1)
        number, stamp = struct.unpack_from("<IQ", frame, 1)
        return number, stamp, frame[13:]

    def channel(self, topic: str) -> Any:
        """Return the channel of a topic, when it exists."""
        while topic not in self.channels:
            self.waiting.append(self._receive())
        return self.channels[topic]

    def service(self, name: str) -> Any:
        """Return a service, when it exists."""
        while name not in self.services:
            self.waiting.append(self._receive())
        return self.services[name]

    def subscribe(self, topic: str, number: int = 1) -> None:
        """Subscribe to a topic, when it exists."""
        channel = self.channel(topic)["id"]
        self.send("subscribe", subscriptions=[{"id": number, "channelId": channel}])

    def sync(self) -> None:
        """Wait until all that was sent before has been done."""
        self.send("getParameters", parameterNames=["/none"], id="sync")
        self.wait(lambda one: isinstance(one, dict) and one.get("id") == "sync")


@contextmanager
def bridge_on(network: Network, *roots: Path, **options: Any) -> Iterator[Bridge]:
    """Open a bridge at any port.

    Args:
        network: The network of the test.
        roots: Folders with packages.
        options: Options of the bridge.
    """
    node = network.node("bridge", context=network.context(package_roots=roots))
    with FoxgloveBridge(node, port=0, **options) as server:
        yield Bridge(network, node, server)


def package_in(folder: Path) -> Path:
    """Make a package with files, beside a file that clients must not fetch."""
    package = folder / "packages" / "arm"
    (package / "meshes").mkdir(parents=True)
    (package / "package.xml").write_text(
        "<package format='2'><name>arm</name><version>1.0.0</version><description>x</description>"
        "<maintainer email='a@b.c'>x</maintainer><license>x</license></package>"
    )
    (package / "meshes" / "base link.stl").write_bytes(b"solid")
    (package / "secret.txt").write_text("secret")
    (folder / "packages" / "other.stl").write_text("secret")
    return package.parent
