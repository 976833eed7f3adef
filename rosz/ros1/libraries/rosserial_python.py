"""rosserial_python: clients of devices in scripts (ROS wiki, rosserial_python).

`rosz.programs.rosserial` exchanges the packets; here are the classes that scripts derive from.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import Any

from rosz.msgs.rosserial_msgs.msg import TopicInfo
from rosz.programs import rosserial
from rosz.ros1 import state
from rosz.ros1.client import rospy

_RETRY_SECONDS = 3.0
_PUBLISHER, _SUBSCRIBER = TopicInfo.ID_PUBLISHER, TopicInfo.ID_SUBSCRIBER
_SERVER, _CLIENT = TopicInfo.ID_SERVICE_SERVER, TopicInfo.ID_SERVICE_CLIENT


def load_pkg_module(package: str, directory: str) -> ModuleType:
    """Import ``msg`` or ``srv`` of a package, and return the package.

    Raises:
        ImportError: The package does not exist.
    """
    import_module(f"{package}.{directory}")
    return sys.modules[package]


def load_message(package: str, message: str) -> Any:
    """Return the class of a message.

    Raises:
        ImportError: The package does not exist.
        AttributeError: The package has no such message.
    """
    return getattr(load_pkg_module(package, "msg").msg, message)


def load_service(package: str, service: str) -> tuple[Any, Any, Any]:
    """Return the classes of a service, its request and its response; see `load_message`."""
    srv = load_pkg_module(package, "srv").srv
    names = service, f"{service}Request", f"{service}Response"
    whole, request, response = (getattr(srv, name) for name in names)
    return whole, request, response


def _message_of(info: Any) -> Any:
    """Return the class of a topic that a device has announced, or raise a TypeMismatch."""
    return rosserial.check_definition(info, load_message(*info.message_type.split("/")))


class Publisher:
    """Publishes the messages that a device sends.

    Args:
        topic_info: The announcement of the device, a ``rosserial_msgs/TopicInfo``.

    Raises:
        TypeMismatch: The device has another definition of the type.
    """

    def __init__(self, topic_info: Any) -> None:
        self.topic = topic_info.topic_name
        self.message = _message_of(topic_info)
        self.publisher = rospy.Publisher(self.topic, self.message, queue_size=10)

    def handlePacket(self, data: bytes) -> None:  # noqa: N802  # ROS 1's name
        """Publish a message of the device."""
        self.publisher.publish(self.message().deserialize(data))


class Subscriber:
    """Sends the messages of a topic to a device.

    Args:
        topic_info: As for `Publisher`, as are the errors.
        parent: The client, which has ``send``.
    """

    def __init__(self, topic_info: Any, parent: Any) -> None:
        self.topic = topic_info.topic_name
        self.id = topic_info.topic_id
        self.parent = parent
        self.message = _message_of(topic_info)
        self.subscriber = rospy.Subscriber(self.topic, self.message, self.callback)

    def callback(self, msg: Any) -> None:
        """Send a message to the device."""
        self.parent.send(self.id, msg.to_ros1())

    def unregister(self) -> None:
        """Unregister from the topic."""
        self.subscriber.unregister()


class ServiceServer:
    """Offers a service of a device.

    Args:
        topic_info: An announcement of the device, a ``rosserial_msgs/TopicInfo``.
        parent: The client, which has ``send``.

    Attributes:
        id: ID of the requests, which the user of the class sets.
    """

    def __init__(self, topic_info: Any, parent: Any) -> None:
        self.topic = topic_info.topic_name
        self.id = topic_info.topic_id
        self.parent = parent
        srv, self.mreq, self.mres = load_service(*topic_info.message_type.split("/"))
        self._service = rosserial.DeviceService(lambda _, req: parent.send(self.id, req.to_ros1()))
        self._service.request = rosserial.Half(topic_info, self.mreq)
        self._service.response = rosserial.Half(topic_info, self.mres)
        self.service = rospy.Service(self.topic, srv, self.callback)

    def callback(self, req: Any) -> Any:
        """Send a request to the device, and return its response.

        Raises:
            ServiceError: The device did not respond in time.
        """
        return self._service.call(req)

    def handlePacket(self, data: bytes) -> None:  # noqa: N802  # ROS 1's name
        """Take a response of the device."""
        self._service.receive(data)

    def unregister(self) -> None:
        """Offer the service no longer."""
        self.service.shutdown()


class ServiceClient:
    """Calls a service for a device; waits until there is a node that offers it.

    Args:
        topic_info: As for `ServiceServer`, as is ``parent``.

    Attributes:
        id: ID of the responses, which the user of the class sets.
    """

    def __init__(self, topic_info: Any, parent: Any) -> None:
        self.topic = topic_info.topic_name
        self.id = topic_info.topic_id
        self.parent = parent
        srv, self.mreq, self.mres = load_service(*topic_info.message_type.split("/"))
        rospy.wait_for_service(self.topic)
        self.proxy = rospy.ServiceProxy(self.topic, srv)

    def handlePacket(self, data: bytes) -> None:  # noqa: N802  # ROS 1's name
        """Call the service with a request of the device, and send the response."""
        self.parent.send(self.id, self.proxy(self.mreq().deserialize(data)).to_ros1())


def _handler(topic: int, text: str) -> Callable[[SerialClient, bytes], None]:
    """Return a method for packets of a topic, which derived classes may replace."""

    def handle(self: SerialClient, data: bytes) -> None:
        self._own[topic](data)

    handle.__doc__ = text
    return handle


class SerialClient:
    """A device on a port.

    It needs ``rospy.init_node``, and waits until the port can be opened. Derived classes may handle
    its announcements and requests themselves, in the methods with ``data``, its bytes.

    Args:
        port: Path of a serial line, or an object with the methods of pyserial's ``Serial``.
        baud: Bits per second of the line.
        timeout: A third of the seconds after which a silent device has lost sync.
        fix_pyserial_for_test: Whether to use RTS/CTS and DSR/DTR.

    Attributes:
        callbacks: Functions that handle packets of the device, by topic IDs.
        publishers: Publishers of derived classes, by topic IDs.
        subscribers: Subscribers of derived classes, by topics.
        services: Services of derived classes, by names.
        buffer_in: Size of the device's buffer for messages to it, the first that a derived class
            has set; -1 before.
        buffer_out: Size of its buffer for messages from it, likewise.

    Raises:
        ROSInitException: ``init_node`` has not been called.
        TypeError: There is no port.
    """

    def __init__(
        self,
        port: Any = None,
        baud: int = 57600,
        timeout: float = 5.0,
        fix_pyserial_for_test: bool = False,
    ) -> None:
        if port is None:
            raise TypeError("port is None; expected a path, such as '/dev/ttyUSB0', or an object")
        node = state.node()
        self.publishers: dict[int, Any] = {}
        self.subscribers: dict[str, Any] = {}
        self.services: dict[str, Any] = {}
        self.callbacks: dict[int, Callable[[bytes], object]] = {}
        self.buffer_in = self.buffer_out = -1
        self._link: rosserial.Link | None = None
        opened: rosserial.DevicePort | None = (
            rosserial.FilePort(port) if hasattr(port, "read") else None
        )
        while opened is None and not node.is_shutdown:
            try:
                opened = rosserial.open_serial(
                    str(port), int(baud), handshake=fix_pyserial_for_test
                )
            except OSError as error:
                node.log.error("Error opening serial: %s", error)  # noqa: TRY400  # no defect
                node.context.wait_for_shutdown(_RETRY_SECONDS)
        if opened is not None:
            self._link = rosserial.Link(node, opened, timeout=timeout)
            self.callbacks = self._link.device.callbacks
        self._own = self.callbacks.copy()
        self.callbacks |= {
            _PUBLISHER: self.setupPublisher,
            _SUBSCRIBER: self.setupSubscriber,
            _SERVER + _PUBLISHER: self.setupServiceServerPublisher,
            _SERVER + _SUBSCRIBER: self.setupServiceServerSubscriber,
            _CLIENT + _PUBLISHER: self.setupServiceClientPublisher,
            _CLIENT + _SUBSCRIBER: self.setupServiceClientSubscriber,
            TopicInfo.ID_PARAMETER_REQUEST: self.handleParameterRequest,
            TopicInfo.ID_LOG: self.handleLoggingRequest,
            TopicInfo.ID_TIME: self.handleTimeRequest,
        }

    def run(self) -> None:
        """Exchange messages with the device until the node is shut down.

        Raises:
            OSError: The device is gone.
        """
        if self._link is not None:
            self._link.run()

    def requestTopics(self) -> None:  # noqa: N802  # ROS 1's name
        """Request the device to announce its topics and services."""
        if self._link is not None:
            self._link.request_topics()

    def txStopRequest(self) -> None:  # noqa: N802  # ROS 1's name
        """Request the device to send nothing more."""
        if self._link is not None:
            self._link.request_stop()

    def send(self, topic: int, msg: bytes) -> None:
        """Send a message to the device; one that is longer than ``buffer_in`` is dropped.

        Args:
            topic: ID of the topic.
            msg: The message in ROS 1's layout.
        """
        if 0 < self.buffer_in < len(msg):
            text = "dropped a message of topic %d: it has %d bytes, the device's buffer %d"
            rospy.logerr(text, topic, len(msg), self.buffer_in)
        elif self._link is not None:
            self._link.send(rosserial.Packet(topic, msg))

    setupPublisher = _handler(_PUBLISHER, "Publish a topic that the device announces.")  # noqa: N815  # ROS 1's names
    setupSubscriber = _handler(_SUBSCRIBER, "Subscribe to a topic that the device announces.")  # noqa: N815
    setupServiceServerPublisher = _handler(  # noqa: N815
        _SERVER + _PUBLISHER, "Take the responses of a service of the device."
    )
    setupServiceServerSubscriber = _handler(  # noqa: N815
        _SERVER + _SUBSCRIBER, "Send the requests for a service of the device."
    )
    setupServiceClientPublisher = _handler(  # noqa: N815
        _CLIENT + _PUBLISHER, "Take the device's requests for a service."
    )
    setupServiceClientSubscriber = _handler(  # noqa: N815
        _CLIENT + _SUBSCRIBER, "Send the responses of a service to the device."
    )
    handleTimeRequest = _handler(TopicInfo.ID_TIME, "Send the time to the device.")  # noqa: N815
    handleParameterRequest = _handler(  # noqa: N815
        TopicInfo.ID_PARAMETER_REQUEST, "Send a parameter to the device."
    )
    handleLoggingRequest = _handler(TopicInfo.ID_LOG, "Log a line of the device.")  # noqa: N815

    def setPublishSize(self, size: int) -> None:  # noqa: N802  # ROS 1's name
        """Set ``buffer_out``, if it is not set yet."""
        if self.buffer_out < 0:
            self.buffer_out = size

    def setSubscribeSize(self, size: int) -> None:  # noqa: N802  # ROS 1's name
        """Set ``buffer_in``, if it is not set yet."""
        if self.buffer_in < 0:
            self.buffer_in = size


class RosSerialServer:
    """Devices that connect by TCP.

    Args:
        tcp_portnum: TCP port.
        fork_server: Of no effect: devices are served at the same time in any case.

    Raises:
        ROSInitException: ``init_node`` has not been called.
    """

    def __init__(self, tcp_portnum: int, fork_server: bool = False) -> None:
        self.tcp_portnum = tcp_portnum
        self.fork_server = fork_server
        self._node = state.node()

    def listen(self) -> None:
        """Serve the devices that connect, until the node is shut down.

        Raises:
            OSError: The port cannot be used.
        """
        rosserial.TcpServer(self._node, int(self.tcp_portnum)).listen()
