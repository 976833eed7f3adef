"""The program ``serial_node.py``: one device on a serial line, or any number of them by TCP."""

from __future__ import annotations

import select
import socket
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

from rosz.errors import ClosedError
from rosz.node import Node, serve_loggers
from rosz.programs.rosserial.link import DevicePort, Link, MissingSerial, SocketPort, open_serial
from rosz.remap import parse
from rosz.worker import Worker

_RETRY_SECONDS = 1.0
_ACCEPT_SECONDS = 0.5
_DEVICES = 64  # each keeps a thread as long as it is connected
_USAGE = "usage: serial_node.py [PORT|tcp [TCP_PORT]] [_port:=…] [_baud:=…] [_tcp_port:=…]"


class TcpServer:
    """Devices that connect by TCP, each served on a thread of its own.

    Args:
        node: The node that stands for all of them.
        port: TCP port; 0 for any free one.

    Attributes:
        port: TCP port.

    Raises:
        OSError: The port cannot be used.
    """

    def __init__(self, node: Node, port: int) -> None:
        self._node = node
        self._socket = socket.create_server(("", port))
        self.port: int = self._socket.getsockname()[1]

    def listen(self) -> None:
        """Serve the devices that connect, until the node ends."""
        self._node.log.info("Waiting for socket connections on port %d", self.port)
        workers = Worker[Any]("rosz-serial", threads=_DEVICES, capacity=_DEVICES, size=lambda _: 1)
        try:
            while not self._node.is_shutdown:
                if select.select([self._socket], [], [], _ACCEPT_SECONDS)[0]:
                    self._accept(workers)
        finally:
            self._socket.close()
            workers.close()

    def _accept(self, workers: Worker[Any]) -> None:
        try:
            connection, address = self._socket.accept()
        except OSError as error:  # the device has gone, or there are too many open files
            self._node.log.warning("cannot accept a connection: %s", error)
            self._node.context.wait_for_shutdown(_RETRY_SECONDS)
            return
        where = f"{address[0]}:{address[1]}"
        self._node.log.info("Established a socket connection from %s", where)
        if not workers.offer(lambda: self._serve(SocketPort(connection), where)):
            self._node.log.warning("refused %s: %d devices are connected", where, _DEVICES)
            connection.close()

    def _serve(self, port: DevicePort, where: str) -> None:
        try:
            Link(self._node, port, startup=0.0).run()
        except (OSError, ClosedError) as error:
            self._node.log.info("the device at %s is gone: %s", where, error)


def serve_line(node: Node, path: str, baud: int, *, handshake: bool, startup: float) -> None:
    """Serve the device on a serial line until the node ends, also after it was unplugged.

    ``startup`` are the seconds that the device needs to start when the line is opened.
    """
    reported = ""
    while not node.is_shutdown:
        try:
            port = open_serial(path, baud, handshake=handshake)
        except OSError as error:
            if str(error) != reported:
                reported = str(error)
                node.log.error("cannot open '%s': %s; trying again until it opens", path, error)  # noqa: TRY400  # no defect
        else:
            reported = ""
            node.log.info("Connected to %s at %d baud", path, baud)
            try:
                Link(node, port, startup=startup).run()
            except ClosedError:  # the node has ended since
                return
            except OSError as error:
                node.log.error("lost the device at '%s': %s; waiting for it", path, error)  # noqa: TRY400  # no defect
        node.context.wait_for_shutdown(_RETRY_SECONDS)


def main() -> None:
    """Serve a device, or a TCP port, until the node is shut down."""
    words = list(parse(sys.argv[1:]).rest)
    if len(words) > len(("port", "tcp_port")):
        sys.exit(_USAGE)
    with Node("serial_node") as node:
        serve_loggers(node)
        try:
            serve = _prepare(node, words)
        except (ValueError, TypeError) as error:
            sys.exit(f"serial_node: a parameter has a wrong value: {error}\n{_USAGE}")
        try:
            serve()
        except MissingSerial as error:
            sys.exit(f"serial_node: {error}")


def _prepare(node: Node, words: list[str]) -> Callable[[], None]:
    """Return the function that serves what the words and the parameters name."""
    get = node.params.get
    path = words[0] if words else str(get("~port", "/dev/ttyUSB0"))
    if path == "tcp":
        everywhere = get("/rosserial_embeddedlinux/tcp_port", 11411)
        port = int(words[1] if words[1:] else get("~tcp_port", everywhere))
        try:
            server = TcpServer(node, port)
        except (OSError, OverflowError) as error:
            sys.exit(f"serial_node: cannot listen at TCP port {port}: {error}")
        return server.listen
    handshake = bool(get("~fix_pyserial_for_test", False))
    startup = float(get("~startup", 2.0))
    baud = int(get("~baud", 57600))
    return partial(serve_line, node, path, baud, handshake=handshake, startup=startup)
