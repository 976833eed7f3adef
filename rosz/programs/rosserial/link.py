"""The link to one device, on a serial line, a TCP connection, or a file object of a program."""

from __future__ import annotations

import select
import socket
import time
from contextlib import suppress
from typing import Any, Protocol

from rosz.errors import ClosedError, RoszError
from rosz.lifecycle import Lifecycle
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rosz.msgs.rosserial_msgs.msg import TopicInfo
from rosz.node import Node
from rosz.programs.rosserial.device import Device, UnknownTopic
from rosz.programs.rosserial.packets import Damage, Packet, PacketReader, pack
from rosz.worker import Worker

_REQUEST = Packet(TopicInfo.ID_PUBLISHER, b"")
_STOP = Packet(TopicInfo.ID_TX_STOP, b"")
# Packets that wait for the line, which is often slower than the topics that it carries.
_WAITING = 1000
_SILENCES = 3
_REQUEST_SECONDS = 1.0
_READ_SECONDS = 0.5
_WRITE_SECONDS = 10.0
_READ_SIZE = 4096


class MissingSerial(RoszError):
    """The distribution that opens serial ports is not installed."""


class DevicePort(Protocol):
    """A way to a device. Its methods raise OSError when the device is gone."""

    def read(self) -> bytes:
        """Return the bytes that have arrived; none if none arrive for half a second."""

    def write(self, data: bytes) -> None:
        """Send bytes."""

    def wake(self) -> None:
        """End a `read` of another thread."""

    def close(self) -> None:
        """Close the port; no other thread may read."""


class SocketPort:
    """A TCP connection."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        connection.settimeout(_WRITE_SECONDS)

    def read(self) -> bytes:
        """Return the bytes that have arrived; none if none arrive for half a second."""
        if not select.select([self._connection], [], [], _READ_SECONDS)[0]:
            return b""
        data = self._connection.recv(_READ_SIZE)
        if not data:
            raise ConnectionError("the connection was closed")
        return data

    def write(self, data: bytes) -> None:
        """Send bytes."""
        self._connection.sendall(data)

    def wake(self) -> None:
        """End a `read` of another thread."""
        with suppress(OSError):  # the other end may be gone
            self._connection.shutdown(socket.SHUT_RD)

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()


class FilePort:
    """An object with the methods of pyserial's ``Serial``, which the caller keeps open.

    Args:
        file: The object; its ``read`` returns after a time limit of its own.
    """

    def __init__(self, file: Any) -> None:
        self._file = file

    def read(self) -> bytes:
        """Return the bytes that have arrived; at most one if the object does not count them."""
        count = getattr(self._file, "in_waiting", None)
        if count is None:
            count = self._file.inWaiting() if hasattr(self._file, "inWaiting") else 1
        return bytes(self._file.read(max(1, count)))

    def write(self, data: bytes) -> None:
        """Send bytes."""
        self._file.write(data)

    def wake(self) -> None:
        """End a `read` of another thread, if the object can."""
        if hasattr(self._file, "cancel_read"):
            self._file.cancel_read()

    def close(self) -> None:
        """Leave the object open."""


class SerialPort(FilePort):
    """A serial line, which the port closes."""

    def close(self) -> None:
        """Close the line."""
        self._file.close()


def open_serial(path: str, baud: int, *, handshake: bool = False) -> SerialPort:
    """Open a serial line.

    Args:
        path: The device, such as ``/dev/ttyUSB0``, or a URL of pyserial.
        baud: Bits per second.
        handshake: Whether to use RTS/CTS and DSR/DTR.

    Raises:
        OSError: It cannot be opened.
        MissingSerial: pyserial is not installed.
    """
    try:
        import serial
    except ModuleNotFoundError as error:
        raise MissingSerial("pyserial is not installed; run: pip install 'rosz[serial]'") from error
    try:
        line = serial.serial_for_url(
            path,
            baud,
            timeout=_READ_SECONDS,
            write_timeout=_WRITE_SECONDS,
            rtscts=handshake,
            dsrdtr=handshake,
        )
    except ValueError as error:  # a rate that the line does not have
        raise OSError(str(error)) from error
    return SerialPort(line)


class Link:
    """A device on a port, and its topics and services on the network.

    Args:
        node: The node that stands for the device.
        port: The open port, which the link closes.
        timeout: A third of the seconds after which a silent device has lost sync.
        startup: Seconds that the device may need to start when its port is opened, as an Arduino
            does; its topics are requested then, or as soon as it sends a packet.
    """

    def __init__(
        self, node: Node, port: DevicePort, *, timeout: float = 5.0, startup: float = 2.0
    ) -> None:
        self._node = node
        self._port = port
        self._timeout = timeout
        self._request_due = time.monotonic() + startup
        self._requested = False
        self._heard = self._request_due
        self._last_sync = 0.0
        self._failure: OSError | None = None
        self._writer: Worker[bytes] = Worker("rosz-rosserial-write", self._write, capacity=_WAITING)
        self.device = Device(node, self.send)
        self._diagnostics = node.publisher("/diagnostics", DiagnosticArray)
        self._lifecycle = Lifecycle("the link to the device")
        node.keep(self)

    def run(self) -> None:
        """Exchange packets until the node ends.

        Raises:
            OSError: The device is gone.
        """
        reader = PacketReader()
        try:
            while not self._lifecycle.closing and not self._node.is_shutdown:
                data = self._port.read()
                if self._failure is not None:
                    raise self._failure
                for received in reader.feed(data) if data else reader.expire():
                    self._handle(received)
                self._keep_sync()
        except (OSError, ClosedError):
            if not self._lifecycle.closing and not self._node.is_shutdown:
                raise
        finally:
            self.close()
            self._port.close()

    def send(self, packet: Packet) -> None:
        """Send a packet to the device; it is dropped if too many wait.

        Raises:
            EncodeError: The packet is too long.
        """
        if not self._writer.offer(pack(packet)) and not self._writer.closed:
            self._node.log.warning(
                "dropped a packet for topic %d: the line is slower than what it has to carry",
                packet.topic,
                throttle=_REQUEST_SECONDS,
            )

    def request_topics(self) -> None:
        """Request the device to announce its topics and services."""
        self._requested = True
        self._request_due = time.monotonic() + _REQUEST_SECONDS
        self._node.log.info("Requesting topics...")
        self.send(_REQUEST)

    def request_stop(self) -> None:
        """Request the device to send nothing more."""
        self.send(_STOP)

    def close(self) -> None:
        """Request the device to stop, and end its topics and services."""
        self._lifecycle.close(self._end)

    def _end(self) -> None:
        if self._failure is None:
            self.request_stop()
        self._writer.close()
        self._port.wake()
        self.device.close()
        self._diagnostics.close()
        self._node.forget(self)

    def _write(self, data: bytes) -> None:
        if self._failure is not None:
            return
        try:
            self._port.write(data)
        except OSError as error:
            self._failure = error
            self._port.wake()

    def _handle(self, received: Packet | Damage) -> None:
        if isinstance(received, Damage):
            self._node.log.warning("damaged data from the device: %s", received.reason)
            return
        self._heard = time.monotonic()
        if not self._last_sync:
            self._request_due = self._heard
        self._last_sync = time.time()
        try:
            self.device.receive(received)
        except UnknownTopic as error:
            if self._requested:
                self._node.log.warning("%s; its topics are requested again", error)
                self._requested = False

    def _keep_sync(self) -> None:
        now = time.monotonic()
        if not self._requested and now >= self._request_due:
            self._heard = now
            self.request_topics()
        elif now - self._heard > self._timeout * _SILENCES:
            text = "no sync with device"
            if self._last_sync:
                reason = f"it has sent nothing for {self._timeout * _SILENCES:g} s"
            else:
                reason = "it sends no packets; check the cable, the baud rate and its program"
            self._node.log.error("%s: %s; its topics are requested again", text, reason)
            self._diagnose(text)
            self._heard = now
            self.request_topics()

    def _diagnose(self, text: str) -> None:
        last = time.ctime(self._last_sync) if self._last_sync else "never"
        status = DiagnosticStatus(
            level=DiagnosticStatus.ERROR,
            name="rosserial_python",
            message=text,
            values=[KeyValue(key="last sync", value=last)],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = Time.from_nsec(self._node.now())
        self._diagnostics.publish(message)
