"""One client of a bridge, whose messages are handled in their order."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import Any

import msgspec

from rosz.access import AccessPolicy
from rosz.bridges import clients
from rosz.bridges.assets import Assets
from rosz.bridges.foxglove import protocol
from rosz.bridges.foxglove.catalog import AdvertisedChannel, NetworkCatalog
from rosz.bridges.foxglove.parameters import ClientParameters
from rosz.errors import RoszError, TypeNotFound, UsageError
from rosz.msgs.rosgraph_msgs.msg import Clock
from rosz.node import Client, Node, Publisher
from rosz.worker import Worker

CAPABILITIES = (
    "clientPublish",
    "parameters",
    "parametersSubscribe",
    "services",
    "connectionGraph",
    "assets",
)
"""Features that a bridge may offer; ``time`` is added if the time is simulated."""

# Features that a read-only policy withholds; parameters can still be read.
_CHANGES = frozenset({"clientPublish", "services"})
_DISTRIBUTION = "jazzy"
"""ROS distribution that definitions and encodings of channels follow; clients adapt to it."""

_ENCODINGS = ("cdr", "json")
_SCHEMAS = frozenset({"ros1msg", "ros2msg"})
_CALLS = 32
"""Largest number of calls of a client that wait for a response."""

_FILES = 1000
"""Largest number of files of a client that wait to be sent."""

_ERROR = 2
"""Level of status messages about errors."""


class FoxgloveLimits(clients.ClientLimits, frozen=True, kw_only=True):
    """Limits on the number of clients and on their messages.

    Attributes:
        message: Largest size of a message that a client sends, in bytes.
    """

    message: int = 64 << 20


class FoxgloveResources(msgspec.Struct, frozen=True):
    """The objects that all clients of a bridge share.

    Attributes:
        worker: Threads for calls and files, which may take long.
        session: Identification of this run of the bridge.
        limits: The limits on a client.
        offered: Features that the bridge offers.
    """

    node: Node
    policy: AccessPolicy
    topics: clients.ClientTopics[clients.TopicMessage]
    catalog: NetworkCatalog
    parameters: ClientParameters
    services: CalledServices
    assets: Assets
    worker: Worker[clients.Task]
    session: str
    limits: FoxgloveLimits
    offered: tuple[str, ...] = CAPABILITIES

    @property
    def capabilities(self) -> list[str]:
        """The features that clients may use, in the terms of the protocol."""
        time = ["time"] if self.node.clock.simulated else []
        withheld = _CHANGES if self.policy.read_only else ()
        return [*(feature for feature in self.offered if feature not in withheld), *time]


class _ChannelQueue(clients.TopicQueue[clients.TopicMessage]):
    """The messages that wait for one subscription of a client."""

    def __init__(self, subscription: int, channel: int) -> None:
        super().__init__()
        self.subscription = subscription
        self.channel = channel


class FoxgloveClient:
    """A client."""

    def __init__(
        self,
        shared: FoxgloveResources,
        queue: clients.OutgoingQueue[clients.TopicMessage],
        name: str,
    ) -> None:
        self._shared = shared
        self._queue = queue
        self._name = name
        self._lock = threading.RLock()
        self._closed = False
        self._watched: dict[int, _ChannelQueue] = {}
        self._published: dict[int, tuple[str, Publisher[Any]]] = {}
        self._tasks = clients.ClientTasks(shared.worker, shared.limits.message, shared.limits)
        self._files: deque[protocol.FetchAsset] = deque()
        self._file = b""
        self._time: clients.TopicQueue[clients.TopicMessage] = clients.TopicQueue(depth=1)
        parameters, catalog = partial(shared.parameters.handle, self), shared.catalog
        self._handlers: dict[type[protocol.ClientMessage], tuple[str, Callable[[Any], None]]] = {
            protocol.SubscribeChannels: ("", self._subscribe),
            protocol.UnsubscribeChannels: ("", self._unsubscribe),
            protocol.AdvertiseChannels: ("clientPublish", self._advertise),
            protocol.UnadvertiseChannels: ("clientPublish", self._unadvertise),
            protocol.PublishedData: ("clientPublish", self._publish),
            protocol.GetParameters: ("parameters", parameters),
            protocol.SetParameters: ("parameters", parameters),
            protocol.SubscribeParameterUpdates: ("parametersSubscribe", parameters),
            protocol.UnsubscribeParameterUpdates: ("parametersSubscribe", parameters),
            protocol.ServiceCall: ("services", self._call),
            protocol.SubscribeConnectionGraph: ("connectionGraph", lambda _: catalog.watch(self)),
            protocol.UnsubscribeConnectionGraph: (
                "connectionGraph",
                lambda _: catalog.unwatch(self),
            ),
            protocol.FetchAsset: ("assets", self._fetch),
        }

    def open(self) -> None:
        """Send the client the server information and the catalog."""
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
            clock = self._shared.node.resolve("/clock")
            self._shared.topics.subscribe(clock, Clock, self._time, self._queue.offer)

    def handle(self, data: str | bytes) -> None:
        """Handle a message; if that fails, send an error to the client."""
        name = "message"
        try:
            message = protocol.read(data)
            name = str(message.__struct_config__.tag)
            self._handler(message)(message)
        except RoszError as error:
            self.report(f"{name}: {error}")
        except Exception as error:  # noqa: BLE001  # the boundary to messages of clients
            self._shared.node.log.report(f"'{name}' of a client failed", error)
            self.report(f"{name}: {error}")

    def _handler(self, message: protocol.ClientMessage) -> Callable[[Any], None]:
        capability, handler = self._handlers[type(message)]
        if capability and capability not in self._shared.capabilities:
            raise UsageError(f"this bridge does not offer '{capability}'")
        return handler

    def encode(
        self, message: clients.TopicMessage, queue: clients.TopicQueue[clients.TopicMessage]
    ) -> bytes | Iterator[bytes | memoryview]:
        """Return a message of a topic as the bytes to send.

        Raises:
            DecodeError: A message of ``/clock`` does not contain a time.
        """
        if isinstance(queue, _ChannelQueue):
            return clients.pieces(
                message.data, protocol.data_head(queue.subscription, message.received)
            )
        return protocol.time_frame(Clock.from_cdr(message.data).clock.to_nsec())

    def send(self, value: Mapping[str, Any]) -> None:
        """Send a message."""
        self._queue.put(msgspec.json.encode(value, enc_hook=str))

    def report(self, text: str) -> None:
        """Send an error."""
        self._shared.node.log.debug("client %s: %s", self._name, text)
        self.send({"op": "status", "level": _ERROR, "message": text})

    def close(self) -> None:
        """End the subscriptions, publishers, calls and requests of the client."""
        with self._lock:
            self._closed = True
            watched = list(self._watched.values())
            self._watched.clear()
        self._queue.close()
        self._tasks.close()
        self._shared.catalog.leave(self)
        self._shared.parameters.leave(self)
        for queue in (self._time, *watched):
            self._shared.topics.unsubscribe(queue)
        for number in list(self._published):
            self._shared.topics.unadvertise((self, number))

    # Channels of the bridge, which the client subscribes to.

    def _subscribe(self, message: protocol.SubscribeChannels) -> None:
        for wanted in message.subscriptions:
            channel = self._shared.catalog.topic(wanted.channel_id)
            with self._lock:
                if wanted.id in self._watched:
                    raise UsageError(f"subscription {wanted.id} exists already")
                if any(queue.channel == channel.id for queue in self._watched.values()):
                    raise UsageError(f"channel {channel.id} is subscribed already")
                self._shared.limits.check("subscriptions", len(self._watched))
                queue = self._watched[wanted.id] = _ChannelQueue(wanted.id, channel.id)
            self._shared.topics.subscribe(channel.name, channel.kind, queue, self._queue.offer)
            with self._lock:
                # Another thread may have closed the client or dropped the channel.
                ended = self._watched.get(wanted.id) is not queue
            if ended:
                self._shared.topics.unsubscribe(queue)

    def _unsubscribe(self, message: protocol.UnsubscribeChannels) -> None:
        for number in message.subscription_ids:
            with self._lock:
                queue = self._watched.pop(number, None)
            if queue is None:
                raise UsageError(f"unknown subscription {number}")
            self._drop(queue)

    def drop_channels(self, channels: Iterable[int]) -> None:
        """End the subscriptions of channels that no longer exist."""
        gone = set(channels)
        with self._lock:
            numbers = [number for number, queue in self._watched.items() if queue.channel in gone]
            queues = [self._watched.pop(number) for number in numbers]
        for queue in queues:
            self._drop(queue)

    def _drop(self, queue: _ChannelQueue) -> None:
        self._shared.topics.unsubscribe(queue)
        self._queue.drop(queue)

    # Channels of the client, which publish to the network.

    def _advertise(self, message: protocol.AdvertiseChannels) -> None:
        for channel in message.channels:
            if channel.id in self._published:
                raise UsageError(f"channel {channel.id} is advertised already")
            if channel.encoding not in _ENCODINGS:
                raise UsageError(
                    f"'{channel.topic}' has the encoding '{channel.encoding}': expected cdr or json"
                )
            self._shared.limits.check("advertisements", len(self._published))
            topic = self._shared.node.resolve(channel.topic)
            self._shared.policy.check("publish", topic)
            cls = self._class_of(topic, channel)
            with self._lock:
                if not self._closed:
                    publisher = self._shared.topics.advertise(
                        topic, cls, latch=False, client=(self, channel.id)
                    )
                    self._published[channel.id] = channel.encoding, publisher

    def _class_of(self, topic: str, channel: protocol.ClientChannel) -> type[Any]:
        """Return the class of a channel of the client; an unknown type needs a definition."""
        try:
            return self._shared.topics.message_class(topic, channel.schema_name)
        except TypeNotFound:
            if not channel.schema or channel.schema_encoding not in _SCHEMAS:
                raise
        types = self._shared.node.context.types
        cls = types.message_from_text(channel.schema_name, channel.schema)
        self._shared.catalog.know(cls)
        return cls

    def _unadvertise(self, message: protocol.UnadvertiseChannels) -> None:
        for number in message.channel_ids:
            if self._published.pop(number, None) is None:
                raise UsageError(f"channel {number} is not advertised")
            self._shared.topics.unadvertise((self, number))

    def _publish(self, message: protocol.PublishedData) -> None:
        if message.channel not in self._published:
            raise UsageError(f"channel {message.channel} is not advertised")
        encoding, publisher = self._published[message.channel]
        cls = publisher.message_type
        if encoding == "cdr":
            cls.from_cdr(message.data)  # raises an error if the bytes are not a message
            publisher.publish_raw(message.data)
            return
        try:
            value = msgspec.json.decode(message.data)
        except (msgspec.MsgspecError, ValueError, RecursionError) as error:
            raise UsageError(f"a message for '{publisher.name}' is not JSON: {error}") from error
        publisher.publish(clients.build(cls, value, self._shared.node.now()))

    # Calls and files, which are handled on other threads.

    def _call(self, message: protocol.ServiceCall) -> None:
        size = len(message.data) + self._shared.limits.message // _CALLS
        try:
            self._tasks.submit(partial(self._call_now, message), size)
        except UsageError as error:
            self._fail(message, str(error))

    def _call_now(self, message: protocol.ServiceCall) -> None:
        try:
            channel = self._shared.catalog.service(message.service)
            self._shared.policy.check("call", channel.name)
            if message.encoding != "cdr":
                raise UsageError(f"the request is '{message.encoding}': expected cdr")
            response = self._shared.services.call(channel, message.data)
            self._queue.put(protocol.response_frame(message, response))
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
        self._queue.put(self._file)

    def sent(self, answer: bytes) -> None:
        """Note that an answer was sent; if it was a file, start to read the next one."""
        if answer is self._file:
            self._file = b""
            with self._lock:
                self._files.popleft()
                waiting = self._files[0] if self._files else None
            if waiting is not None:
                self._shared.worker.submit(partial(self._fetch_now, waiting))


class CalledServices:
    """The services that clients of the bridge call; they share one client for each service."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._lock = threading.Lock()
        self._clients: dict[str, tuple[AdvertisedChannel, Client]] = {}

    def call(self, channel: AdvertisedChannel, request: bytes) -> bytes:
        """Call a service; the request and the returned response are CDR.

        Raises:
            RoszError: The bytes are not a request, or the service is missing or failed.
        """
        kind = channel.kind
        response = self._client(channel).call(kind.Request.from_cdr(request))
        data: bytes = response.to_cdr()
        return data

    def _client(self, channel: AdvertisedChannel) -> Client:
        """Return the client of a service; make a new one if the type has changed."""
        with self._lock:
            before = self._clients.get(channel.name)
            if before is not None and before[0] == channel:
                return before[1]
            client = self._node.client(channel.name, channel.kind)
            self._clients[channel.name] = channel, client
        if before is not None:
            before[1].close()
        return client

    def close(self) -> None:
        """Close the clients of all services."""
        with self._lock:
            called = list(self._clients.values())
            self._clients.clear()
        for _, client in called:
            client.close()
