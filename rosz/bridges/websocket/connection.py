"""One client: what it asks for is done in the order in which it comes."""

from __future__ import annotations

import hmac
import itertools
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import msgspec

from rosz.bridges.logs import is_log, to_ros2_log
from rosz.bridges.tasks import Task, Tasks
from rosz.bridges.websocket import operations as ops
from rosz.bridges.websocket.actions import Gateways, SentGoals, ServedActions
from rosz.bridges.websocket.messages import build_from_json
from rosz.bridges.websocket.outbox import Feed, Outbox
from rosz.bridges.websocket.plain import Spelling
from rosz.bridges.websocket.services import Calls, ServedServices
from rosz.errors import RoszError, UsageError
from rosz.msgs.rosgraph_msgs.msg import Log

if TYPE_CHECKING:
    from rosz.bridges.gate import Gate
    from rosz.bridges.websocket.rosapi import RosApi
    from rosz.bridges.websocket.topics import Topics
    from rosz.node import Node, Publisher
    from rosz.worker import Worker

__all__ = ("Connection", "Shared")

_LEVELS = ("info", "warning", "error", "none")
_MAC_SECONDS = 5
_NO_PASSWORD = "the password is missing or wrong"  # noqa: S105  # what a client is told
_CALL_SIZE = 1000
"""Bytes that a call takes beside its operation."""


class Shared(msgspec.Struct, frozen=True):
    """The objects that all clients of a bridge share.

    Attributes:
        node: The node of the bridge.
        gate: Permissions of the clients.
        topics: Publishers and subscriptions.
        gateways: Servers of ROS 2 by actionlib's topics.
        rosapi: The services about the system.
        worker: Threads for what takes long: calls and goals.
        spelling: Whose names of types and fields a client gets that has not shown its own.
        password: Password of the clients; empty if they need none.
    """

    node: Node
    gate: Gate
    topics: Topics
    gateways: Gateways
    rosapi: RosApi
    worker: Worker[Task]
    spelling: Spelling = "ros1"
    password: str = ""


class Connection:
    """A client.

    Args:
        shared: Objects that the clients share.
        outbox: Outgoing queue of this client.
        name: Where it is, for the log.
        refuse: Function that ends the connection with a reason.
        trusted: Whether it has shown to know the password.
        limit: Largest size of an operation in parts, and of the calls that have not ended.
        fragment_size: Largest number of characters of an answer that does not go in parts.
    """

    def __init__(
        self,
        shared: Shared,
        outbox: Outbox,
        name: str,
        refuse: Callable[[str], object],
        *,
        trusted: bool,
        limit: int,
        fragment_size: int | None = None,
    ) -> None:
        self.trusted: bool = trusted
        self._shared = shared
        self._outbox = outbox
        self._name = name
        self._refuse = refuse
        self._tasks = Tasks(shared.worker, limit)
        self._fragment_size = fragment_size
        self._parts = ops.Fragments(limit)
        self._size = 0
        self._spelling = shared.spelling
        self._level = "error"
        self._numbers = itertools.count(1)
        self._lock = threading.RLock()
        self._closed = False
        self._feeds: dict[str, Feed] = {}
        self._publishers: dict[str, Publisher[Any]] = {}
        self._advertisements: dict[str, set[str]] = {}
        self._calls = Calls(shared.node)
        self._services = ServedServices(shared.node, self.send)
        self._goals = SentGoals(shared.node, self.send)
        self._actions = ServedActions(shared.node, self.send)
        self._handlers: dict[type[ops.Operation], Callable[[Any], None]] = {
            ops.Advertise: self._advertise,
            ops.Unadvertise: self._unadvertise,
            ops.Publish: self._publish,
            ops.Subscribe: self._subscribe,
            ops.Unsubscribe: self._unsubscribe,
            ops.CallService: self._call_service,
            ops.AdvertiseService: self._advertise_service,
            ops.UnadvertiseService: self._unadvertise_service,
            ops.ServiceResponse: self._services.respond,
            ops.SendActionGoal: self._send_goal,
            ops.CancelActionGoal: self._cancel_goal,
            ops.AdvertiseAction: self._advertise_action,
            ops.UnadvertiseAction: self._unadvertise_action,
            ops.ActionFeedback: self._actions.feedback,
            ops.ActionResult: self._actions.end,
            ops.SetLevel: self._set_level,
        }

    def handle(self, text: str | bytes) -> None:
        """Perform an operation, and send a status message if it fails."""
        try:
            operation = self._read(text)
        except UsageError as error:
            if self.trusted:
                self._status("error", str(error), None)
            else:
                self._refuse(_NO_PASSWORD)
            return
        if operation is None:
            return
        if not self.trusted:
            self._authenticate(operation)
            return
        handler = self._handlers.get(type(operation))
        if handler is None:  # a client that authenticates where no password is needed
            return
        try:
            handler(operation)
        except RoszError as error:
            self._status("error", f"{_name(operation)}: {error}", operation.id)
        except Exception as error:  # noqa: BLE001  # the boundary to what clients send
            self._shared.node.log.report(
                f"operation '{_name(operation)}' of a client failed", error
            )
            self._status("error", f"{_name(operation)}: {error}", operation.id)
        else:
            self._status("info", f"{_name(operation)}: done", operation.id)

    def _read(self, text: str | bytes) -> ops.Operation | None:
        """Return the operation in a text, or of which it brings the last part; else None.

        Only a client that has shown to know the password may send parts.
        """
        operation = ops.read_text(text)
        while isinstance(operation, ops.Fragment) and self.trusted:
            whole = self._parts.add(operation)
            if whole is None:
                return None
            text, operation = whole, ops.read_text(whole)
        self._size = len(text)
        return operation

    def _later(self, task: Task) -> None:
        """Perform what takes long on a thread of the bridge.

        Raises:
            UsageError: Operations of this client that have not ended are too large together.
        """
        self._tasks.submit(task, self._size + _CALL_SIZE)

    def send(self, value: dict[str, Any], *, fragment_size: float | None = None) -> None:
        """Send an operation."""
        text, size = msgspec.json.encode(value), fragment_size or self._fragment_size
        for part in ops.fragments(text, size, next(self._numbers)):
            self._outbox.put(part)

    def close(self) -> None:
        """End everything that the client has begun."""
        with self._lock:
            self._closed = True
            feeds = list(self._feeds.values())
            self._feeds.clear()
        self._outbox.close()
        self._tasks.close()
        for feed in feeds:
            self._shared.topics.unsubscribe(feed)
        self._shared.topics.unadvertise(self)
        self._shared.gateways.leave(self)
        for part in (self._services, self._actions, self._calls, self._goals):
            part.close()

    # Used by all operations.

    def _authenticate(self, operation: ops.Operation) -> None:
        """Accept a client that proves to know the password, as ROS 1's rosauth defines it."""
        if isinstance(operation, ops.Authenticate):
            now = time.time()
            recent = abs(now - operation.t) <= _MAC_SECONDS and now < operation.end
            wanted = operation.expected_mac(self._shared.password)
            if recent and hmac.compare_digest(wanted, operation.mac.lower()):
                self.trusted = True
                return
        self._refuse(_NO_PASSWORD)

    def _status(self, level: str, text: str, number: str | int | None) -> None:
        if level == "error":
            self._shared.node.log.debug("client %s: %s", self._name, text)
        if _LEVELS.index(level) >= _LEVELS.index(self._level):
            status = {"op": "status", "level": level, "msg": text}
            self.send(status if number is None else {**status, "id": number})

    def _set_level(self, operation: ops.SetLevel) -> None:
        self._level = operation.level

    def _see(self, type_name: str | None) -> Spelling:
        """Return the spelling in which a client writes a type, or wrote the last one."""
        if type_name:
            self._spelling = "ros2" if type_name.count("/") > 1 else "ros1"
        return self._spelling

    # Topics.

    def _advertise(self, operation: ops.Advertise) -> None:
        self._see(operation.type)
        topic = self._shared.node.resolve(operation.topic)
        self._shared.gate.check("publish", topic)
        cls = self._shared.topics.message_class(topic, operation.type)
        topics = self._shared.topics
        with self._lock:
            if not self._closed:
                self._advertisements.setdefault(topic, set()).add(str(operation.id))
                self._publishers[topic] = topics.advertise(
                    topic, cls, latch=operation.latch, client=self
                )
        self._shared.gateways.want(topic, cls, self)

    def _unadvertise(self, operation: ops.Unadvertise) -> None:
        topic = self._shared.node.resolve(operation.topic)
        others = self._advertisements.get(topic, set())
        if operation.id is not None and others - {str(operation.id)}:
            others.discard(str(operation.id))
            return
        self._advertisements.pop(topic, None)
        self._publishers.pop(topic, None)
        if not self._shared.topics.unadvertise(self, topic):
            self._status("warning", f"unadvertise: '{topic}' is not advertised", operation.id)

    def _publish(self, operation: ops.Publish) -> None:
        topic = self._shared.node.resolve(operation.topic)
        if topic not in self._publishers:
            type_name = operation.type or self._shared.topics.type_of(topic)
            made = ops.Advertise(topic=topic, type=type_name, latch=operation.latch)
            spelling = self._spelling
            self._advertise(made)
            self._spelling = spelling if not operation.type else self._spelling
        publisher = self._publishers[topic]
        self._shared.gateways.want(topic, publisher.message_type, self)
        now = self._shared.node.now()
        if self._spelling == "ros1" and is_log(topic, publisher.message_type):
            log = build_from_json(Log, operation.msg, self._spelling, now)
            publisher.publish(to_ros2_log(log))
            return
        cls = publisher.message_type
        publisher.publish(build_from_json(cls, operation.msg, self._spelling, now))

    def _subscribe(self, operation: ops.Subscribe) -> None:
        spelling = self._see(operation.type)
        topic = self._shared.node.resolve(operation.topic)
        self._shared.gate.check("subscribe", topic)
        topics = self._shared.topics
        cls = topics.message_class(topic, operation.type) if operation.type else None
        feed = self._feeds.get(topic) or Feed()
        feed.adapt({**feed.requests, str(operation.id): operation}, spelling)
        topics.subscribe(topic, cls, feed, self._outbox.offer)
        with self._lock:
            if not self._closed:
                self._feeds[topic] = feed
                return
        topics.unsubscribe(feed)

    def _unsubscribe(self, operation: ops.Unsubscribe) -> None:
        topic = self._shared.node.resolve(operation.topic)
        number = None if operation.id is None else str(operation.id)
        feed = self._feeds.get(topic)
        if feed is None or (number is not None and number not in feed.requests):
            self._status("warning", f"unsubscribe: '{topic}' is not subscribed", operation.id)
            return
        others = {key: one for key, one in feed.requests.items() if number not in (None, key)}
        if others:
            feed.adapt(others, feed.form[1])
            return
        with self._lock:
            self._feeds.pop(topic, None)
        self._shared.topics.unsubscribe(feed)
        self._outbox.drop(feed)

    # Services.

    def _call_service(self, operation: ops.CallService) -> None:
        spelling = self._see(operation.type)
        name = self._shared.node.resolve(operation.service)
        try:
            self._later(partial(self._call, name, operation, spelling))
        except UsageError as error:
            self._respond(operation, str(error), done=False)

    def _call(self, name: str, operation: ops.CallService, spelling: Spelling) -> None:
        try:
            if self._shared.rosapi.has(name):
                values = self._shared.rosapi.call(name, operation.args, self._shared.gate, spelling)
            else:
                self._shared.gate.check("call", name)
                values = self._calls.call(name, operation, spelling)
        except RoszError as error:
            self._respond(operation, str(error), done=False)
        else:
            self._respond(operation, values, done=True)

    def _respond(self, operation: ops.CallService, values: Any, *, done: bool) -> None:
        response: dict[str, Any] = {"op": "service_response", "service": operation.service}
        if operation.id is not None:
            response["id"] = operation.id
        self.send(
            {**response, "values": values, "result": done}, fragment_size=operation.fragment_size
        )

    def _advertise_service(self, operation: ops.AdvertiseService) -> None:
        spelling = self._see(operation.type)
        name = self._shared.node.resolve(operation.service)
        self._shared.gate.check("serve", name)
        self._services.advertise(name, operation, spelling)

    def _unadvertise_service(self, operation: ops.UnadvertiseService) -> None:
        name = self._shared.node.resolve(operation.service)
        if not self._services.unadvertise(name):
            self._status("warning", f"unadvertise_service: '{name}' is not served", operation.id)

    # Actions.

    def _send_goal(self, operation: ops.SendActionGoal) -> None:
        spelling = self._see(operation.action_type)
        name = self._shared.node.resolve(operation.action)
        self._goals.announce(operation)
        try:
            self._later(partial(self._send_goal_now, name, operation, spelling))
        except UsageError as error:
            self._fail_goal(operation, error)

    def _send_goal_now(self, name: str, operation: ops.SendActionGoal, spelling: Spelling) -> None:
        try:
            self._shared.gate.check("call", name)
            self._goals.send(name, operation, spelling)
        except RoszError as error:
            self._fail_goal(operation, error)

    def _fail_goal(self, operation: ops.SendActionGoal, error: RoszError) -> None:
        self._goals.forget(operation)
        result = {"op": "action_result", "id": operation.id, "action": operation.action}
        self.send({**result, "values": str(error), "status": 0, "result": False})

    def _cancel_goal(self, operation: ops.CancelActionGoal) -> None:
        self._later(partial(self._cancel_goal_now, operation))

    def _cancel_goal_now(self, operation: ops.CancelActionGoal) -> None:
        try:
            self._goals.cancel(operation)
        except RoszError as error:
            self._status("error", f"cancel_action_goal: {error}", operation.id)

    def _advertise_action(self, operation: ops.AdvertiseAction) -> None:
        spelling = self._see(operation.type)
        name = self._shared.node.resolve(operation.action)
        self._shared.gate.check("serve", name)
        self._actions.advertise(name, operation, spelling)

    def _unadvertise_action(self, operation: ops.UnadvertiseAction) -> None:
        name = self._shared.node.resolve(operation.action)
        if not self._actions.unadvertise(name):
            self._status("warning", f"unadvertise_action: '{name}' is not served", operation.id)


def _name(operation: ops.Operation) -> str:
    return str(operation.__struct_config__.tag)
