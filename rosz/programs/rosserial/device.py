"""The topics and services that a device announces, and its requests that need no announcement."""

from __future__ import annotations

import queue
import struct
import threading
from collections.abc import Callable
from functools import partial
from typing import Any

import msgspec

from rosz.errors import ClosedError, DecodeError, EncodeError, ParamError, RoszError, ServiceError
from rosz.lifecycle import Closable
from rosz.message import Message, Service
from rosz.msgs.rosserial_msgs.msg import Log, TopicInfo
from rosz.msgs.rosserial_msgs.srv import RequestParam
from rosz.node import Client, Node, Publisher, Subscription
from rosz.programs.rosserial.packets import Packet
from rosz.worker import Worker

_NANOSECONDS = 1_000_000_000
_RESPONSE_SECONDS = 30.0
# Calls of the device that wait at once; a call may take long, and must not stop the reading.
_CALLS = 8
_ID_OF_REQUESTS = TopicInfo.ID_SUBSCRIBER
_ID_OF_RESPONSES = TopicInfo.ID_PUBLISHER


class TypeMismatch(RoszError):
    """The device has announced another definition of a type than the MD5 of the one here."""

    def __init__(self, info: TopicInfo, expected: str) -> None:
        super().__init__(
            f"the device's {info.message_type} has MD5 '{info.md5sum}', expected '{expected}':"
            " its definition of the type differs; build the device's program with libraries made"
            " from the definitions that are used here"
        )


class UnknownTopic(RoszError):
    """The device uses a topic ID that it has not announced."""

    def __init__(self, topic: int) -> None:
        super().__init__(f"the device sent a packet of topic {topic} before it announced that")


def check_definition(info: TopicInfo, kind: type[Message]) -> type[Message]:
    """Return a class that has the MD5 which the device announced.

    Raises:
        TypeMismatch: It has another one.
    """
    if kind._md5sum != info.md5sum:
        raise TypeMismatch(info, kind._md5sum)
    return kind


class _SubscribedTopic(msgspec.Struct):
    """A topic that the device subscribes to."""

    info: TopicInfo
    subscription: Subscription[Any] | None = None


class Half(msgspec.Struct):
    """One direction of a service.

    Attributes:
        info: The announcement of the device, which has the topic ID.
        kind: Class of the messages in this direction.
    """

    info: TopicInfo
    kind: type[Message]


class DeviceService:
    """A service of the device.

    It gets one request at a time, since a response does not say which request it belongs to.

    Args:
        send: Function that sends a message to the device.

    Attributes:
        request: The direction of the requests; None until the device has announced it.
        response: That of the responses.
        offered: Whether the node offers the service.
    """

    def __init__(self, send: Callable[[TopicInfo, Any], None]) -> None:
        self._send = send
        self._lock = threading.Lock()
        self._responses: queue.SimpleQueue[Message | None] = queue.SimpleQueue()
        self.request: Half | None = None
        self.response: Half | None = None
        self.offered = False
        self._closed = False

    def call(self, request: Message) -> Message:
        """Send a request to the device, and return its response.

        Raises:
            ServiceError: The device did not respond in time, or is gone.
        """
        with self._lock:
            while not self._responses.empty():  # of a call that was given up
                self._responses.get()
            if self._closed or self.request is None:
                raise ServiceError("the device is disconnected")
            self._send(self.request.info, request)
            name = self.request.info.topic_name
            try:
                response = self._responses.get(timeout=_RESPONSE_SECONDS)
            except queue.Empty:
                text = f"the device did not respond to '{name}' within {_RESPONSE_SECONDS:g} s"
                raise ServiceError(text) from None
            if response is None:
                raise ServiceError(f"the device was disconnected during a call of '{name}'")
            return response

    def receive(self, payload: bytes) -> None:
        """Take a response of the device."""
        if self.response is not None:
            self._responses.put(self.response.kind.from_ros1(payload))

    def close(self) -> None:
        """End the call that waits, and those that wait for it."""
        self._closed = True
        self._responses.put(None)


class Device:
    """A device on the network of ROS.

    Attributes:
        callbacks: Functions that handle packets of the device, by topic IDs. They come before
            those for the topics and services that it has announced.
    """

    def __init__(self, node: Node, send: Callable[[Packet], object]) -> None:
        self._node = node
        self._send_packet = send
        self._outputs: dict[int, tuple[TopicInfo, Publisher[Any]]] = {}
        self._inputs: dict[str, _SubscribedTopic] = {}
        self._servers: dict[str, DeviceService] = {}
        self._clients: dict[str, Client] = {}
        self._responses: dict[str, TopicInfo] = {}
        self._parts: list[Closable] = []
        self._calls: Worker[Callable[[], object]] = Worker("rosz-rosserial", threads=_CALLS)
        self._handlers: dict[int, Callable[[bytes], object]] = {}
        server, client = TopicInfo.ID_SERVICE_SERVER, TopicInfo.ID_SERVICE_CLIENT
        self.callbacks: dict[int, Callable[[bytes], object]] = {
            TopicInfo.ID_PUBLISHER: self._announced(self._publish),
            TopicInfo.ID_SUBSCRIBER: self._announced(self._subscribe),
            server + _ID_OF_RESPONSES: self._announced(partial(self._note_service, response=True)),
            server + _ID_OF_REQUESTS: self._announced(partial(self._note_service, response=False)),
            client + TopicInfo.ID_PUBLISHER: self._announced(self._call_request),
            client + TopicInfo.ID_SUBSCRIBER: self._announced(self._call_response),
            TopicInfo.ID_PARAMETER_REQUEST: self._send_parameter,
            TopicInfo.ID_LOG: self._log,
            TopicInfo.ID_TIME: self._send_time,
        }

    def receive(self, packet: Packet) -> None:
        """Handle a packet of the device; raise `UnknownTopic` if its topic is not announced."""
        handler = self.callbacks.get(packet.topic) or self._handlers.get(packet.topic)
        if handler is None:
            raise UnknownTopic(packet.topic)
        try:
            handler(packet.payload)
        except DecodeError as error:
            self._node.log.warning("dropped a packet of topic %d: %s", packet.topic, error)
        except (EncodeError, ParamError) as error:
            self._node.log.error("cannot send to the device: %s", error)  # noqa: TRY400  # no defect

    def close(self) -> None:
        """End the device's topics and services."""
        for served in self._servers.values():
            served.close()
        for part in reversed(self._parts):
            part.close()
        self._calls.close()

    def _announced(self, handle: Callable[[TopicInfo], object]) -> Callable[[bytes], None]:
        def received(payload: bytes) -> None:
            info = TopicInfo.from_ros1(payload)
            try:
                handle(info)
            except ClosedError:
                raise
            except RoszError as error:
                name, kind = info.topic_name, info.message_type
                self._node.log.error("cannot set up '%s' [%s]: %s", name, kind, error)  # noqa: TRY400  # no defect

        return received

    def _message_class(self, info: TopicInfo) -> type[Message]:
        return check_definition(info, self._node.context.types.message(info.message_type))

    def _send(self, info: TopicInfo, message: Message) -> None:
        payload = message.to_ros1()
        if 0 < info.buffer_size < len(payload):
            self._node.log.error(
                "dropped a message of '%s': it has %d bytes, the device's buffer %d",
                info.topic_name,
                len(payload),
                info.buffer_size,
            )
            return
        self._send_packet(Packet(info.topic_id, payload))

    def _publish(self, info: TopicInfo) -> None:
        earlier, publisher = self._outputs.get(info.topic_id, (None, None))
        if earlier == info:
            return
        kind = self._message_class(info)
        if publisher is not None:
            publisher.close()
        made = self._keep(self._node.publisher(info.topic_name, kind))
        self._outputs[info.topic_id] = info, made
        self._handlers[info.topic_id] = lambda data: made.publish(kind.from_ros1(data))
        self._node.log.info("Setup publisher on %s [%s]", info.topic_name, info.message_type)

    def _subscribe(self, info: TopicInfo) -> None:
        before = self._inputs.get(info.topic_name)
        kind = self._message_class(info)
        if before is not None and before.info.message_type == info.message_type:
            before.info = info  # the ID may be another one now
            return
        if before is not None and before.subscription is not None:
            before.subscription.close()
        entry = self._inputs[info.topic_name] = _SubscribedTopic(info)
        entry.subscription = self._keep(
            self._node.subscription(info.topic_name, kind, lambda m: self._send(entry.info, m))
        )
        self._node.log.info("Setup subscriber on %s [%s]", info.topic_name, info.message_type)

    def _note_service(self, info: TopicInfo, *, response: bool) -> None:
        """Note one direction of a service of the device."""
        service = self._node.context.types.service(info.message_type)
        served = self._servers.setdefault(info.topic_name, DeviceService(self._send))
        half = Half(info, check_definition(info, service.Response if response else service.Request))
        if response:
            served.response = half
            self._handlers[info.topic_id] = served.receive
        else:
            served.request = half
        self._serve(served, info.topic_name, service)

    def _serve(self, served: DeviceService, name: str, kind: type[Service]) -> None:
        """Offer a service of the device once both ways are announced."""
        if served.offered or served.request is None or served.response is None:
            return
        self._keep(self._node.service(name, kind, served.call))
        served.offered = True
        self._node.log.info("Setup service server on %s [%s]", name, kind._type)

    def _call_request(self, info: TopicInfo) -> None:
        service = self._node.context.types.service(info.message_type)
        request = check_definition(info, service.Request)
        client = self._clients.get(info.topic_name)
        if client is None or client.service_type is not service:
            client = self._keep(self._node.client(info.topic_name, service))
            self._clients[info.topic_name] = client
            self._node.log.info("Setup service client on %s [%s]", info.topic_name, service._type)
        calling = client

        def received(data: bytes) -> None:
            message = request.from_ros1(data)
            self._calls.submit(lambda: self._call(calling, info.topic_name, message))

        self._handlers[info.topic_id] = received

    def _call_response(self, info: TopicInfo) -> None:
        service = self._node.context.types.service(info.message_type)
        check_definition(info, service.Response)
        self._responses[info.topic_name] = info

    def _call(self, client: Client, name: str, request: Message) -> None:
        try:
            response = client.call(request)
            info = self._responses.get(name)
            if info is not None:
                self._send(info, response)
        except ClosedError:
            return
        except RoszError as error:
            self._node.log.error("the device's call of '%s' failed: %s", client.name, error)  # noqa: TRY400  # no defect

    def _send_time(self, _payload: bytes) -> None:
        now = struct.pack("<II", *divmod(self._node.now(), _NANOSECONDS))
        self._send_packet(Packet(TopicInfo.ID_TIME, now))

    def _send_parameter(self, payload: bytes) -> None:
        name = RequestParam.Request.from_ros1(payload).name
        value = self._node.params.get(name, None)
        if value is None:
            raise ParamError(f"parameter '{name}' is not set")
        values = value if isinstance(value, list) else [value]
        kinds = {type(element) for element in values}
        if len(kinds) > 1 or not kinds <= {bool, int, float, str}:
            raise ParamError(
                f"parameter '{name}' is {value!r}; a device takes a number, a truth value, a text,"
                " or a list of one of these"
            )
        response = RequestParam.Response()
        if kinds <= {bool, int}:
            response.ints = [int(element) for element in values]
        elif kinds == {float}:
            response.floats = values
        else:
            response.strings = values
        self._send_packet(Packet(TopicInfo.ID_PARAMETER_REQUEST, response.to_ros1()))

    def _log(self, payload: bytes) -> None:
        line = Log.from_ros1(payload)
        log = self._node.log
        levels = {
            Log.ROSDEBUG: log.debug,
            Log.INFO: log.info,
            Log.WARN: log.warning,
            Log.ERROR: log.error,
            Log.FATAL: log.critical,
        }
        levels.get(line.level, log.info)("%s", line.msg)

    def _keep(self, part: Any) -> Any:
        self._parts.append(part)
        return part
