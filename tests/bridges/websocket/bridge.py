"""A bridge of a test, and a client that speaks the protocol by hand."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from network import TIMEOUT, Network, eventually
from websockets.sync.client import ClientConnection, connect

from rosz.actions import ActionlibServer, SimpleActionServer
from rosz.bridges.rosbridge import WebsocketBridge
from rosz.msgs.actionlib.action import Test
from rosz.node import Node

__all__ = ("Bridge", "Client", "Doubling", "bridge_on")


class Bridge:
    """A bridge on the network of a test."""

    def __init__(self, network: Network, node: Node, server: WebsocketBridge) -> None:
        self.network = network
        self.node = node
        self.server = server

    def wait_for_service(self, name: str) -> None:
        """Wait until the bridge knows a server of a service."""
        self.node.context.graph.wait_for_service(name, TIMEOUT)

    def wait_for_subscription(self, topic: str) -> None:
        """Wait until the bridge knows a subscription of a topic: it publishes to no other."""
        self.node.context.graph.wait_for_subscribers(topic, 1, TIMEOUT)

    @contextmanager
    def client(self, path: str = "", **options: Any) -> Iterator[Client]:
        """Connect."""
        url = f"ws://127.0.0.1:{self.server.port}/{path}"
        with connect(url, open_timeout=TIMEOUT, max_size=None, **options) as connection:
            yield Client(connection)


class Client:
    """A client that sends and receives operations."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection

    def send(self, op: str, **members: Any) -> None:
        self.connection.send(json.dumps({"op": op, **members}))

    def receive(self) -> Any:
        """Return the next operation, or the bytes of a binary one."""
        got = self.connection.recv(timeout=TIMEOUT)
        return json.loads(got) if isinstance(got, str) else got

    def receive_op(self, op: str) -> Any:
        """Return the next operation of a kind; others before it are passed over."""
        while True:
            got = self.receive()
            if isinstance(got, dict) and got["op"] == op:
                return got

    def sync(self) -> None:
        """Wait until all that was sent before has been done."""
        self.send("call_service", service="/rosapi/get_time", id="sync")
        while self.receive().get("id") != "sync":
            pass


@contextmanager
def bridge_on(network: Network, **options: Any) -> Iterator[Bridge]:
    """Open a bridge at any port."""
    node = network.node("bridge")
    with WebsocketBridge(node, 0, **options) as server:
        yield Bridge(network, node, server)


class Doubling:
    """Servers that double positive numbers, and give feedback about others until they are canceled.

    ``/native`` is one of ROS 2, ``/classic`` one of ROS 1.
    """

    def __init__(self, node: Node) -> None:
        node.action_server("native", Test, self._execute_native)
        action = node.context.types.message("actionlib/TestAction")
        self._classic = SimpleActionServer(ActionlibServer(node, "classic", action), self._execute)
        self._classic.start()

    def _execute_native(self, goal: Any) -> None:
        if goal.request.goal >= 0:
            goal.succeed(Test.Result(2 * goal.request.goal))
            return
        while not goal.wait_for_cancel(0.05):
            goal.feedback(Test.Feedback(7))
        goal.canceled(Test.Result(5))

    def _execute(self, goal: Any) -> None:
        def look() -> bool:
            self._classic.publish_feedback(Test.Feedback(7))
            return self._classic.is_preempt_requested()

        if goal.goal >= 0:
            self._classic.set_succeeded(Test.Result(2 * goal.goal))
            return
        eventually(look, "the request to end")
        self._classic.set_preempted(Test.Result(5))
