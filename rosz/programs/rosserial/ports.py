"""Ports to a device: a serial line, a TCP connection, or a file object of a program."""

from __future__ import annotations

import select
import socket
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Protocol

from rosz.errors import RoszError

if TYPE_CHECKING:
    import serial

__all__ = ("FilePort", "MissingSerial", "Port", "SerialPort", "SocketPort", "open_serial")

_READ_SECONDS = 0.5
_WRITE_SECONDS = 10.0
_READ_SIZE = 4096


class MissingSerial(RoszError):
    """The distribution that opens serial ports is not installed."""


class Port(Protocol):
    """A way to a device. Its methods raise OSError when the device is gone."""

    def read(self) -> bytes:
        """Return the bytes that have arrived; none if none arrive for half a second."""

    def write(self, data: bytes) -> None:
        """Send bytes."""

    def wake(self) -> None:
        """End a `read` of another thread."""

    def close(self) -> None:
        """Close the port; no other thread may read."""


class SerialPort:
    """A serial line.

    Args:
        line: The open line.
    """

    def __init__(self, line: serial.Serial) -> None:
        self._line = line

    def read(self) -> bytes:
        """Return the bytes that have arrived; none if none arrive for half a second."""
        return bytes(self._line.read(max(1, self._line.in_waiting)))

    def write(self, data: bytes) -> None:
        """Send bytes."""
        self._line.write(data)

    def wake(self) -> None:
        """End a `read` of another thread."""
        self._line.cancel_read()

    def close(self) -> None:
        """Close the line."""
        self._line.close()


class SocketPort:
    """A TCP connection.

    Args:
        connection: The connection.
    """

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
