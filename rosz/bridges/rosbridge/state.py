"""The state of clients: the objects that all share, and those that all operations of one share."""

from __future__ import annotations

import itertools
import threading
from typing import Any, Generic, Literal, TypeAlias, TypeVar

import msgspec

from rosz.access import AccessPolicy
from rosz.actions import SEND, TopicGateway
from rosz.bridges.clients import ClientLimits, ClientTasks, ClientTopics, OutgoingQueue, Task
from rosz.bridges.rosbridge.encoded import EncodedMessage
from rosz.bridges.rosbridge.operations import Operation, SetLevel, fragments
from rosz.bridges.rosbridge.plain import Spelling
from rosz.bridges.rosbridge.rosapi import RosApi
from rosz.lifecycle import Closable
from rosz.node import Node
from rosz.worker import Worker

S = TypeVar("S", bound=Closable)

Level: TypeAlias = Literal["info", "warning", "error", "none"]
"""Level of status messages."""

_LEVELS = ("info", "warning", "error", "none")
_GOAL = "/goal"
_CALL_SIZE = 1000
"""Bytes that a call takes beside its operation."""


class RosbridgeLimits(ClientLimits, frozen=True, kw_only=True):
    """Limits on the number of clients and on their messages.

    Attributes:
        encoded: Largest size of encoded messages that are kept for several clients, in bytes.
        operation: Largest size of an operation that a client sends, in bytes.
        password: Largest size of an operation before the client is authenticated, in bytes.
        password_seconds: Time in which a client must authenticate, in seconds.
        fragment_size: Largest number of characters that are sent in one piece; None for no limit.
    """

    encoded: int = 64 << 20
    operation: int = 64 << 20
    password: int = 4096
    password_seconds: float = 10.0
    fragment_size: int | None = None


class Gateways:
    """Servers of ROS 2 that clients reach by actionlib's topics."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._lock = threading.Lock()
        self._gateways: dict[str, tuple[TopicGateway, set[object]]] = {}

    def want(self, topic: str, cls: type[Any], client: object) -> None:
        """Open a gateway for goals that a client publishes, if only ROS 2's protocol is served.

        Raises:
            RoszError: The definition of the action is not found.
        """
        name, kind = topic.removesuffix(_GOAL), cls._type
        if name == topic or not kind.endswith("ActionGoal"):
            return
        with self._lock:
            if name in self._gateways:
                self._gateways[name][1].add(client)
                return
            view = self._node.context.graph.refresh()
            if view.subscriptions(topic) or not view.servers(f"{name}/{SEND}"):
                return
            action = self._node.context.types.message(kind.removesuffix("Goal"))
            gateway = TopicGateway(self._node, name, action)
            if gateway.start():
                self._gateways[name] = gateway, {client}
            else:
                gateway.close()

    def leave(self, client: object) -> None:
        """Close the gateways that no other client needs."""
        with self._lock:
            for name, (gateway, clients) in list(self._gateways.items()):
                clients.discard(client)
                if not clients:
                    del self._gateways[name]
                    gateway.close()


class RosbridgeResources(msgspec.Struct, frozen=True):
    """The objects that all clients of a bridge share.

    Attributes:
        worker: Threads for calls and goals, which take long.
        spelling: Whose names of types and fields a client gets that has not shown its own.
        limits: The limits on a client.
    """

    node: Node
    policy: AccessPolicy
    topics: ClientTopics[EncodedMessage]
    gateways: Gateways
    rosapi: RosApi
    worker: Worker[Task]
    spelling: Spelling
    limits: RosbridgeLimits


class ClientState:
    """State that the operations of one client share.

    Attributes:
        spelling: Spelling in which the client wrote the last type.
        size: Bytes of the operation that is performed.
    """

    def __init__(
        self, shared: RosbridgeResources, queue: OutgoingQueue[EncodedMessage], name: str
    ) -> None:
        self.shared = shared
        self.queue = queue
        self.spelling: Spelling = shared.spelling
        self.size: int = 0
        self._name = name
        self._tasks = ClientTasks(shared.worker, shared.limits.operation, shared.limits)
        self._level: Level = "error"
        self._numbers = itertools.count(1)

    def send(self, value: dict[str, Any], *, fragment_size: float | None = None) -> None:
        """Send an operation."""
        text, size = msgspec.json.encode(value), fragment_size or self.shared.limits.fragment_size
        for part in fragments(text, size, next(self._numbers)):
            self.queue.put(part)

    def report(self, level: Level, text: str, number: str | int | None) -> None:
        """Send a status message, if the client wants those of the level."""
        if level == "error":
            self.shared.node.log.debug("client %s: %s", self._name, text)
        if _LEVELS.index(level) >= _LEVELS.index(self._level):
            status = {"op": "status", "level": level, "msg": text}
            self.send(status if number is None else {**status, "id": number})

    def set_level(self, operation: SetLevel) -> None:
        """Choose which status messages are sent."""
        self._level = operation.level

    def spelling_of(self, type_name: str | None) -> Spelling:
        """Return the spelling in which the client writes a type, or wrote the last one."""
        if type_name:
            self.spelling = "ros2" if type_name.count("/") > 1 else "ros1"
        return self.spelling

    def later(self, task: Task) -> None:
        """Perform a task that takes long on a thread of the bridge.

        Raises:
            UsageError: Operations of this client that have not ended are too large together.
        """
        self._tasks.submit(task, self.size + _CALL_SIZE)

    def close(self) -> None:
        """Forget everything that waits."""
        self.queue.close()
        self._tasks.close()


class Served(Generic[S]):
    """The services, or the actions, that one client serves, by name."""

    def __init__(self, state: ClientState) -> None:
        self._state = state
        self._node = state.shared.node
        self._lock = threading.Lock()
        self._servers: dict[str, S] = {}

    def _check(self, name: str) -> None:
        """Raise a RoszError if the client may not serve the name, or serves too many names."""
        self._state.shared.policy.check("serve", name)
        if name not in self._servers:
            self._state.shared.limits.check("services", len(self._servers))

    def _withdraw(self, operation: Operation, name: str) -> None:
        """Stop serving the name of an operation."""
        full_name = self._node.resolve(name)
        if not self._end_server(full_name):
            text = f"{operation.__struct_config__.tag}: '{full_name}' is not served"
            self._state.report("warning", text, operation.id)

    def _end_server(self, name: str) -> bool:
        """End a server; return whether there was one."""
        with self._lock:
            server = self._servers.pop(name, None)
        if server is not None:
            server.close()
        return server is not None
