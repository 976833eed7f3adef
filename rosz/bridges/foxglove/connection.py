"""One client: what it asks for is done in the order in which it comes."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import msgspec

from rosz.bridges.foxglove import protocol
from rosz.bridges.listener import pieces
from rosz.bridges.tasks import Task, Tasks
from rosz.bridges.websocket import Feed, Message, Outbox, build
from rosz.errors import RoszError, TypeNotFound, UsageError

if TYPE_CHECKING:
    from rosz.bridges.assets import Assets
    from rosz.bridges.foxglove.catalog import Catalog
    from rosz.bridges.foxglove.parameters import Parameters
    from rosz.bridges.foxglove.services import Services
    from rosz.bridges.gate import Gate
    from rosz.bridges.websocket import Topics
    from rosz.node import Node, Publisher
    from rosz.worker import Worker

__all__ = ("CAPABILITIES", "Connection", "Shared")

CAPABILITIES = (
    "clientPublish",
    "parameters",
    "parametersSubscribe",
    "services",
    "connectionGraph",
    "assets",
)
"""Features that a bridge may offer, beside the time."""

_CHANGES = frozenset({"clientPublish", "services"})
_DISTRIBUTION = "jazzy"
"""The ROS whose definitions and encoding channels have; clients choose their ways by it."""

_ENCODINGS = ("cdr", "json")
_SCHEMAS = frozenset({"ros1msg", "ros2msg"})
_CALLS = 32
"""Largest number of calls that a client waits for."""

_FILES = 1000
"""Largest number of files that a client waits for."""

_INFORMATION, _WARNING, _ERROR = 0, 1, 2


class Shared(msgspec.Struct, frozen=True):
    """The objects that all clients of a bridge share.

    Attributes:
        node: The node of the bridge.
        gate: Permissions of the clients.
        topics: Publishers and subscriptions.
        catalog: Topics and services of the network.
        parameters: Parameters of the network.
        services: Clients of services.
        assets: Files of packages.
        worker: Threads for what takes long: calls and files.
        session: Name of this run of the bridge.
        offered: Features that the bridge offers.
    """

    node: Node
    gate: Gate
    topics: Topics
    catalog: Catalog
    parameters: Parameters
    services: Services
    assets: Assets
    worker: Worker[Task]
    session: str
    offered: tuple[str, ...] = CAPABILITIES

    @property
    def capabilities(self) -> list[str]:
        """The features that clients have, in the words of the protocol."""
        time = ["time"] if self.node.clock.simulated else []
        refused = _CHANGES if self.gate.read_only else ()
        return [*(one for one in self.offered if one not in refused), *time]


class _Watched(Feed):
    """The messages that wait for one subscription of a client."""

    def __init__(self, subscription: int, channel: int) -> None:
        super().__init__()
        self.subscription = subscription
        self.channel = channel


class _Time(Feed):
    """The newest time that waits for a client."""

    def __init__(self) -> None:
        super().__init__()
        self.depth = 1


class Connection:
    """A client.

    Args:
        shared: Objects that the clients share.
        outbox: Outgoing queue of this client.
        name: Where it is, for the log.
        limit: Largest size of the calls that it waits for, in bytes.
    """

    def __init__(self, shared: Shared, outbox: Outbox, name: str, limit: int) -> None:
        self._shared = shared
        self._outbox = outbox
        self._name = name
        self._lock = threading.RLock()
        self._closed = False
        self._watched: dict[int, _Watched] = {}
        self._published: dict[int, tuple[str, Publisher[Any]]] = {}
        self._limit = limit
        self._tasks = Tasks(shared.worker, limit)
        self._files: deque[protocol.FetchAsset] = deque()
        self._file = b""
        self._time = _Time()
        self._handlers: dict[type[protocol.ClientMessage], tuple[str, Callable[[Any], None]]] = {
            protocol.Subscribe: ("", self._subscribe),
            protocol.Unsubscribe: ("", self._unsubscribe),
            protocol.Advertise: ("clientPublish", self._advertise),
            protocol.Unadvertise: ("clientPublish", self._unadvertise),
            protocol.Publish: ("clientPublish", self._publish),
            protocol.GetParameters: ("parameters", self._get_parameters),
            protocol.SetParameters: ("parameters", self._set_parameters),
            protocol.SubscribeParameterUpdates: ("parametersSubscribe", self._follow),
            protocol.UnsubscribeParameterUpdates: ("parametersSubscribe", self._unfollow),
            protocol.ServiceCall: ("services", self._call),
            protocol.SubscribeConnectionGraph: ("connectionGraph", self._watch_graph),
            protocol.UnsubscribeConnectionGraph: ("connectionGraph", self._unwatch_graph),
            protocol.FetchAsset: ("assets", self._fetch),
        }

    def open(self) -> None:
        """Greet the client, and tell it of what there is."""
        capabilities = self._shared.capabilities
        self.send(
            {
                "op": "serverInfo",
                "name": f"rosz {self._shared.node.name}",
                "capabilities": capabilities,
                "supportedEncodings": _ENCODINGS,
                "metadata": {"ROS_DISTRO": _DISTRIBUTION},
                "sessionId": self._shared.session,
            }
        )
        self._shared.catalog.join(self)
        if "time" in capabilities:
            from rosz.msgs.rosgraph_msgs.msg import Clock

            clock = self._shared.node.resolve("/clock")
            self._shared.topics.subscribe(clock, Clock, self._time, self._outbox.offer)

    def handle(self, data: str | bytes) -> None:
        """Do what a message says, and send an error if that fails."""
        name = "message"
        try:
            message = protocol.read(data)
            name = protocol.op_name(message)
            self._handler(message)(message)
        except RoszError as error:
            self.report(f"{name}: {error}")
        except Exception as error:  # noqa: BLE001  # the boundary to what clients send
            self._shared.node.log.report(f"'{name}' of a client failed", error)
            self.report(f"{name}: {error}")

    def _handler(self, message: protocol.ClientMessage) -> Callable[[Any], None]:
        capability, handler = self._handlers[type(message)]
        if capability and capability not in self._shared.capabilities:
            raise UsageError(f"this bridge does not offer '{capability}'")
        return handler

    def encode(self, message: Message, feed: Feed) -> bytes | Iterator[bytes | memoryview]:
        """Return a message of a topic as it is sent.

        Raises:
            DecodeError: A message of ``/clock`` does not contain a time.
        """
        if isinstance(feed, _Watched):
            return pieces(message.data, protocol.data_head(feed.subscription, message.received))
        from rosz.msgs.rosgraph_msgs.msg import Clock

        return protocol.time_frame(Clock.from_cdr(message.data).clock.to_nsec())

    def send(self, value: Mapping[str, Any]) -> None:
        """Send a message."""
        self._outbox.put(msgspec.json.encode(value, enc_hook=str))

    def report(self, text: str) -> None:
        """Send an error."""
        self._shared.node.log.debug("client %s: %s", self._name, text)
        self.send({"op": "status", "level": _ERROR, "message": text})

    def close(self) -> None:
        """End everything that the client has begun."""
        with self._lock:
            self._closed = True
            watched = list(self._watched.values())
            self._watched.clear()
        self._outbox.close()
        self._tasks.close()
        self._shared.catalog.leave(self)
        self._shared.parameters.unfollow(self)
        for feed in (self._time, *watched):
            self._shared.topics.unsubscribe(feed)
        for number in list(self._published):
            self._shared.topics.unadvertise((self, number))

    # Channels of the bridge.

    def _subscribe(self, message: protocol.Subscribe) -> None:
        for wanted in message.subscriptions:
            channel = self._shared.catalog.topic(wanted.channel_id)
            with self._lock:
                if wanted.id in self._watched:
                    raise UsageError(f"subscription {wanted.id} exists already")
                if any(one.channel == channel.id for one in self._watched.values()):
                    raise UsageError(f"channel {channel.id} is subscribed already")
                feed = self._watched[wanted.id] = _Watched(wanted.id, channel.id)
            self._shared.topics.subscribe(channel.name, channel.kind, feed, self._outbox.offer)
            with self._lock:
                ended = self._watched.get(wanted.id) is not feed  # by other threads
            if ended:
                self._shared.topics.unsubscribe(feed)

    def _unsubscribe(self, message: protocol.Unsubscribe) -> None:
        for number in message.subscription_ids:
            with self._lock:
                feed = self._watched.pop(number, None)
            if feed is None:
                raise UsageError(f"unknown subscription {number}")
            self._drop(feed)

    def drop_channels(self, channels: Iterable[int]) -> None:
        """End the subscriptions of channels that exist no longer."""
        gone = set(channels)
        with self._lock:
            numbers = [one for one, feed in self._watched.items() if feed.channel in gone]
            feeds = [self._watched.pop(number) for number in numbers]
        for feed in feeds:
            self._drop(feed)

    def _drop(self, feed: _Watched) -> None:
        self._shared.topics.unsubscribe(feed)
        self._outbox.drop(feed)

    # Channels of the client.

    def _advertise(self, message: protocol.Advertise) -> None:
        for channel in message.channels:
            if channel.id in self._published:
                raise UsageError(f"channel {channel.id} is advertised already")
            if channel.encoding not in _ENCODINGS:
                raise UsageError(
                    f"'{channel.topic}' has the encoding '{channel.encoding}': expected cdr or json"
                )
            topic = self._shared.node.resolve(channel.topic)
            self._shared.gate.check("publish", topic)
            cls = self._class_of(topic, channel)
            with self._lock:
                if not self._closed:
                    publisher = self._shared.topics.advertise(
                        topic, cls, latch=False, client=(self, channel.id)
                    )
                    self._published[channel.id] = channel.encoding, publisher

    def _class_of(self, topic: str, channel: protocol.ClientChannel) -> type[Any]:
        """Return the class of what a client publishes, by its own definition if need be."""
        try:
            return self._shared.topics.message_class(topic, channel.schema_name)
        except TypeNotFound:
            if not channel.schema or channel.schema_encoding not in _SCHEMAS:
                raise
        types = self._shared.node.context.types
        cls = types.message_from_text(channel.schema_name, channel.schema)
        self._shared.catalog.know(cls)
        return cls

    def _unadvertise(self, message: protocol.Unadvertise) -> None:
        for number in message.channel_ids:
            if self._published.pop(number, None) is None:
                raise UsageError(f"channel {number} is not advertised")
            self._shared.topics.unadvertise((self, number))

    def _publish(self, message: protocol.Publish) -> None:
        if message.channel not in self._published:
            raise UsageError(f"channel {message.channel} is not advertised")
        encoding, publisher = self._published[message.channel]
        cls = publisher.message_type
        if encoding == "cdr":
            cls.from_cdr(message.data)  # others get no bytes that are not a message
            publisher.publish_raw(message.data)
            return
        try:
            value = msgspec.json.decode(message.data)
        except (msgspec.MsgspecError, ValueError, RecursionError) as error:
            raise UsageError(f"a message for '{publisher.name}' is not JSON: {error}") from error
        publisher.publish(build(cls, value, self._shared.node.now()))

    # Parameters and connections.

    def _get_parameters(self, message: protocol.GetParameters) -> None:
        self._shared.parameters.get(self, message)

    def _set_parameters(self, message: protocol.SetParameters) -> None:
        self._shared.parameters.set(self, message)

    def _follow(self, message: protocol.SubscribeParameterUpdates) -> None:
        self._shared.parameters.follow(self, message.parameter_names)

    def _unfollow(self, message: protocol.UnsubscribeParameterUpdates) -> None:
        self._shared.parameters.unfollow(self, message.parameter_names)

    def _watch_graph(self, _message: protocol.SubscribeConnectionGraph) -> None:
        self._shared.catalog.watch(self)

    def _unwatch_graph(self, _message: protocol.UnsubscribeConnectionGraph) -> None:
        self._shared.catalog.unwatch(self)

    # Calls and files, on other threads.

    def _call(self, message: protocol.ServiceCall) -> None:
        size = len(message.data) + self._limit // _CALLS
        try:
            self._tasks.submit(partial(self._call_now, message), size)
        except UsageError as error:
            self._fail(message, str(error))

    def _call_now(self, message: protocol.ServiceCall) -> None:
        try:
            channel = self._shared.catalog.service(message.service)
            self._shared.gate.check("call", channel.name)
            if message.encoding != "cdr":
                raise UsageError(f"the request is '{message.encoding}': expected cdr")
            response = self._shared.services.call(channel, message.data)
            self._outbox.put(protocol.response_frame(message, response))
        except RoszError as error:
            self._fail(message, str(error))

    def _fail(self, message: protocol.ServiceCall, reason: str) -> None:
        failure = {"op": "serviceCallFailure", "serviceId": message.service}
        self.send({**failure, "callId": message.call, "message": reason})

    def _fetch(self, message: protocol.FetchAsset) -> None:
        with self._lock:
            if len(self._files) >= _FILES:
                raise UsageError(f"{_FILES} files wait, which is the limit")
            self._files.append(message)
            first = len(self._files) == 1
        if first:
            self._shared.worker.submit(partial(self._fetch_now, message))

    def _fetch_now(self, message: protocol.FetchAsset) -> None:
        try:
            data = self._shared.assets.read(message.uri)
            self._file = protocol.asset_frame(message.request_id, data)
        except RoszError as error:
            self._file = protocol.refusal_frame(message.request_id, str(error))
        self._outbox.put(self._file)

    def sent(self, answer: bytes) -> None:
        """Read the next file that the client fetches once the one before has been sent."""
        if answer is self._file:
            self._file = b""
            with self._lock:
                self._files.popleft()
                waiting = self._files[0] if self._files else None
            if waiting is not None:
                self._shared.worker.submit(partial(self._fetch_now, waiting))
