"""The topics and services that a device announces, and its requests that need no announcement."""

from __future__ import annotations

import queue
import struct
import threading
from collections.abc import Callable
from typing import Any, Protocol

import msgspec

from rosz.errors import ClosedError, DecodeError, EncodeError, ParamError, RoszError, ServiceError
from rosz.message import Message, Service
from rosz.msgs.rosserial_msgs.msg import Log, TopicInfo
from rosz.msgs.rosserial_msgs.srv import RequestParam
from rosz.node import Client, Node, Publisher, Subscription
from rosz.programs.rosserial.packets import Packet
from rosz.worker import Worker

__all__ = ("Device", "TypeMismatch", "UnknownTopic")

_NANOSECONDS = 1_000_000_000
_RESPONSE_SECONDS = 30.0
_CALLS = 8
_ID_OF_REQUESTS = TopicInfo.ID_SUBSCRIBER
_ID_OF_RESPONSES = TopicInfo.ID_PUBLISHER


class TypeMismatch(RoszError):
    """The device has another definition of a type.

    Args:
        info: What the device has announced.
        expected: MD5 of the type here.
    """

    def __init__(self, info: TopicInfo, expected: str) -> None:
        super().__init__(
            f"the device's {info.message_type} has MD5 '{info.md5sum}', expected '{expected}':"
            " its definition of the type differs; build the device's program with libraries made"
            " from the definitions that are used here"
        )


class UnknownTopic(RoszError):
    """The device uses a topic ID that it has not announced.

    Args:
        topic: The ID.
    """

    def __init__(self, topic: int) -> None:
        super().__init__(f"the device sent a packet of topic {topic} before it announced that")


class _Closable(Protocol):
    def close(self) -> None: ...


class _Output(msgspec.Struct):
    """A topic that the device publishes."""

    info: TopicInfo
    publisher: Publisher[Any]


class _Input(msgspec.Struct):
    """A topic that the device subscribes to."""

    info: TopicInfo
    subscription: Subscription[Any] | None = None


class _Half(msgspec.Struct):
    """One way of a service: its ID, and the class of what goes there."""

    info: TopicInfo
    kind: type[Message]


class _Served:
    """A service of the device.

    It gets one request at a time, since a response does not say which request it belongs to.

    Args:
        send: Function that sends a message to the device.
    """

    def __init__(self, send: Callable[[TopicInfo, Message], None]) -> None:
        self._send = send
        self._lock = threading.Lock()
        self._responses: queue.SimpleQueue[Message | None] = queue.SimpleQueue()
        self.request: _Half | None = None
        self.response: _Half | None = None
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

    Args:
        node: The node that stands for the device.
        send: Function that sends a packet to the device.

    Attributes:
        callbacks: Functions that handle what comes from the device, by topic IDs. They come before
            those for the topics and services that it has announced.
    """

    def __init__(self, node: Node, send: Callable[[Packet], object]) -> None:
        self._node = node
        self._send_packet = send
        self._outputs: dict[int, _Output] = {}
        self._inputs: dict[str, _Input] = {}
        self._servers: dict[str, _Served] = {}
        self._clients: dict[str, Client] = {}
        self._responses: dict[str, TopicInfo] = {}
        self._parts: list[_Closable] = []
        self._calls: Worker[Callable[[], object]] = Worker("rosz-rosserial", threads=_CALLS)
        self._handlers: dict[int, Callable[[bytes], object]] = {}
        server, client = TopicInfo.ID_SERVICE_SERVER, TopicInfo.ID_SERVICE_CLIENT
        self.callbacks: dict[int, Callable[[bytes], object]] = {
            TopicInfo.ID_PUBLISHER: self._announced(self._publish),
            TopicInfo.ID_SUBSCRIBER: self._announced(self._subscribe),
            server + _ID_OF_RESPONSES: self._announced(self._serve_response),
            server + _ID_OF_REQUESTS: self._announced(self._serve_request),
            client + TopicInfo.ID_PUBLISHER: self._announced(self._call_request),
            client + TopicInfo.ID_SUBSCRIBER: self._announced(self._call_response),
            TopicInfo.ID_PARAMETER_REQUEST: self._send_parameter,
            TopicInfo.ID_LOG: self._log,
            TopicInfo.ID_TIME: self._send_time,
        }

    def receive(self, packet: Packet) -> None:
        """Handle a packet of the device.

        Raises:
            UnknownTopic: The device has not announced its topic.
        """
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
        return _checked(info, self._node.context.types.message(info.message_type))

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
        known = self._outputs.get(info.topic_id)
        if known is not None and known.info == info:
            return
        kind = self._message_class(info)
        if known is not None:
            known.publisher.close()
        publisher = self._keep(self._node.publisher(info.topic_name, kind))
        self._outputs[info.topic_id] = _Output(info, publisher)
        self._handlers[info.topic_id] = lambda data: publisher.publish(kind.from_ros1(data))
        self._node.log.info("Setup publisher on %s [%s]", info.topic_name, info.message_type)

    def _subscribe(self, info: TopicInfo) -> None:
        known = self._inputs.get(info.topic_name)
        kind = self._message_class(info)
        if known is not None and known.info.message_type == info.message_type:
            known.info = info  # the ID may be another one now
            return
        if known is not None and known.subscription is not None:
            known.subscription.close()
        entry = self._inputs[info.topic_name] = _Input(info)
        entry.subscription = self._keep(
            self._node.subscription(info.topic_name, kind, lambda m: self._send(entry.info, m))
        )
        self._node.log.info("Setup subscriber on %s [%s]", info.topic_name, info.message_type)

    def _serve_request(self, info: TopicInfo) -> None:
        service = self._node.context.types.service(info.message_type)
        served = self._servers.setdefault(info.topic_name, _Served(self._send))
        served.request = _Half(info, _checked(info, service.Request))
        self._serve(served, info.topic_name, service)

    def _serve_response(self, info: TopicInfo) -> None:
        service = self._node.context.types.service(info.message_type)
        served = self._servers.setdefault(info.topic_name, _Served(self._send))
        served.response = _Half(info, _checked(info, service.Response))
        self._handlers[info.topic_id] = served.receive
        self._serve(served, info.topic_name, service)

    def _serve(self, served: _Served, name: str, kind: type[Service]) -> None:
        """Offer a service of the device once both ways are announced."""
        if served.offered or served.request is None or served.response is None:
            return
        self._keep(self._node.service(name, kind, served.call))
        served.offered = True
        self._node.log.info("Setup service server on %s [%s]", name, kind._type)

    def _call_request(self, info: TopicInfo) -> None:
        service = self._node.context.types.service(info.message_type)
        request = _checked(info, service.Request)
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
        _checked(info, service.Response)
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
        kinds = {type(one) for one in values}
        if len(kinds) > 1 or not kinds <= {bool, int, float, str}:
            raise ParamError(
                f"parameter '{name}' is {value!r}; a device takes a number, a truth value, a text,"
                " or a list of one of these"
            )
        response = RequestParam.Response()
        if kinds <= {bool, int}:
            response.ints = [int(one) for one in values]
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


def _checked(info: TopicInfo, kind: type[Message]) -> type[Message]:
    """Return a class that has the MD5 which the device announced.

    Raises:
        TypeMismatch: It has another one.
    """
    if kind._md5sum != info.md5sum:
        raise TypeMismatch(info, kind._md5sum)
    return kind
