"""rosserial_python: clients of devices in scripts (ROS wiki, rosserial_python).

May import rospy's state and `rosz.programs.rosserial`.
"""

from __future__ import annotations

from typing import Any

from rosz.programs.rosserial import FilePort, Link, Packet, Port, TcpServer, open_serial
from rosz.ros1 import state

__all__ = ("RosSerialServer", "SerialClient")

_RETRY_SECONDS = 3.0


class SerialClient:
    """A device on a port.

    It needs ``rospy.init_node``, and waits until the port can be opened.

    Args:
        port: Path of a serial line, or an object with the methods of pyserial's ``Serial``.
        baud: Bits per second of the line.
        timeout: A third of the seconds after which a silent device has lost sync.
        fix_pyserial_for_test: Whether to use RTS/CTS and DSR/DTR.

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
        self._link: Link | None = None
        opened: Port | None = FilePort(port) if hasattr(port, "read") else None
        while opened is None and not node.is_shutdown:
            try:
                opened = open_serial(str(port), int(baud), handshake=fix_pyserial_for_test)
            except OSError as error:
                node.log.error("Error opening serial: %s", error)  # noqa: TRY400  # no defect
                node.context.wait_for_shutdown(_RETRY_SECONDS)
        if opened is not None:
            self._link = Link(node, opened, timeout=timeout)

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
        """Send a message to the device.

        Args:
            topic: ID of the topic.
            msg: The message in ROS 1's layout.
        """
        if self._link is not None:
            self._link.send(Packet(topic, msg))


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
        TcpServer(self._node, int(self.tcp_portnum)).listen()
