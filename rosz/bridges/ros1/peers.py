"""Calls of ROS 1's nodes and masters, connections to them, and whether they still listen."""

from __future__ import annotations

import http.client
import socket
from collections.abc import Callable
from contextlib import closing
from functools import partial
from typing import Any
from urllib.parse import urlsplit

import msgspec

from rosz.bridges.ros1.calls import MAX_BODY, decode_result, encode_call
from rosz.bridges.ros1.frames import MAX_HEADER, decode_header, encode_header
from rosz.errors import DecodeError, ServiceError, TransportError
from rosz.worker import Worker

TIMEOUT = 5.0
"""Seconds that another program gets for a connection, and for an answer."""

_PROBE_SECONDS = 3.0
_PROBE_TIMEOUT = 2.0

_SUCCESS = 1
_LENGTH = 4
_TRIPLE = 3


class Address(msgspec.Struct, frozen=True):
    """Where a program listens.

    Attributes:
        host: Host name or address.
        port: TCP port.
        path: Path of the URI; ``/`` when there is none.
    """

    host: str
    port: int
    path: str = "/"

    @classmethod
    def parse(cls, uri: str) -> Address:
        """Return the address in ``http://host:port/path`` or ``rosrpc://host:port``.

        Raises:
            DecodeError: It is not such a URI.
        """
        try:
            parts = urlsplit(uri)
            host, port = parts.hostname, parts.port
        except ValueError as error:
            raise DecodeError("URI", -1, f"'{uri:.200}': {error}") from error
        if parts.scheme not in {"http", "rosrpc"} or not host or not port:
            raise DecodeError("URI", -1, f"'{uri:.200}', expected 'http://host:port/'")
        return cls(host, port, parts.path or "/")

    def __str__(self) -> str:
        return f"{self.host}:{self.port}"


def connect(address: Address, timeout: float = TIMEOUT) -> socket.socket:
    """Return a socket that is connected to an address.

    Raises:
        TransportError: Nobody listens there, or the host is not known.
    """
    try:
        return socket.create_connection((address.host, address.port), timeout)
    except (OSError, UnicodeError) as error:
        raise TransportError(f"cannot connect to {address}: {_reason(error)}") from error


def connect_either(address: Address, uri: str) -> socket.socket:
    """Return a socket that is connected to an address of a node, or to its port at another host.

    Args:
        address: Address that the node names, which may be wrong beyond its machine.
        uri: URI of the node, whose host is the other one.

    Raises:
        TransportError: Nobody listens at either, or neither host is known.
    """
    try:
        return connect(address)
    except TransportError:
        registered = Address.parse(uri)
        if registered.host == address.host:
            raise
        return connect(Address(registered.host, address.port))


def is_listening(uri: str) -> bool:
    """Return whether a program listens at a URI, or its machine is too slow to tell."""
    address = Address.parse(uri)
    try:
        socket.create_connection((address.host, address.port), _PROBE_TIMEOUT).close()
    except TimeoutError:
        return True
    except (OSError, UnicodeError):
        return False
    return True


def _request(
    uri: str, method: str, args: tuple[Any, ...] | Callable[[str], tuple[Any, ...]], timeout: float
) -> Any:
    """Call a method of a program by XML-RPC, and return the result; errors as those of `call`."""
    address = Address.parse(uri)
    sock = connect(address, timeout)
    with sock:
        if callable(args):
            args = args(sock.getsockname()[0])
        request = encode_call(str(address), address.path, method, args)
        try:
            sock.sendall(request)
            with closing(http.client.HTTPResponse(sock, method="POST")) as response:
                response.begin()
                body = response.read(MAX_BODY)
        except (OSError, http.client.HTTPException) as error:
            raise TransportError(
                f"no answer of {address} to '{method}': {_reason(error)}"
            ) from error
    return decode_result(body)


def call(
    uri: str,
    method: str,
    args: tuple[Any, ...] | Callable[[str], tuple[Any, ...]],
    timeout: float = TIMEOUT,
) -> Any:
    """Call a method of a program, and return the value of its answer.

    Args:
        uri: URI of the program.
        method: Name of the method.
        args: Arguments, or a function that makes them of the address of this machine on the way
            to the program.
        timeout: Time limit in seconds of the connection, and of each step of the answer.

    Raises:
        TransportError: The program cannot be reached, or does not answer in time.
        ServiceError: The program says that the call has failed.
        DecodeError: The answer is not one of ROS 1.
        EncodeError: XML-RPC has no such value.
    """
    result = _request(uri, method, args, timeout)
    if not isinstance(result, list) or len(result) != _TRIPLE:
        raise DecodeError("XML-RPC result", -1, f"{result!r:.80}, expected code, text and value")
    code, text, value = result
    if code != _SUCCESS:
        raise ServiceError(f"{Address.parse(uri)} refuses '{method}': {text}")
    return value


def multicall(uri: str, calls: list[tuple[str, tuple[Any, ...]]]) -> list[Any]:
    """Call several methods of a master at once, and return their values; None for failed ones.

    Raises:
        TransportError: The master cannot be reached, or does not answer in time.
        DecodeError: The answer is not one of ROS 1.
    """
    if not calls:
        return []
    many = [{"methodName": method, "params": list(args)} for method, args in calls]
    results = _request(uri, "system.multicall", (many,), TIMEOUT)
    if not isinstance(results, list) or len(results) != len(calls):
        raise DecodeError("XML-RPC result", -1, f"expected a list of {len(calls)} results")
    return [_value(result) for result in results]


def _value(result: Any) -> Any:
    match result:
        case [[1, _, value]]:
            return value
    return None


def exchange_headers(sock: socket.socket, fields: dict[str, str]) -> dict[str, str]:
    """Send a connection header, and return that of the other end.

    Raises:
        TransportError: The other end has closed, or does not answer in time.
        ServiceError: The other end refuses the connection.
        DecodeError: The answer is not a header.
    """
    try:
        sock.sendall(encode_header(fields))
    except OSError as error:
        raise TransportError(f"cannot send a header: {_reason(error)}") from error
    size = int.from_bytes(receive(sock, _LENGTH), "little")
    if size > MAX_HEADER:
        raise DecodeError("TCPROS header", 0, f"{size} bytes, expected {MAX_HEADER} at most")
    answer = decode_header(receive(sock, size))
    if "error" in answer:
        raise ServiceError(f"refused: {answer['error']}")
    return answer


def receive(sock: socket.socket, size: int) -> bytes:
    """Receive a number of bytes.

    Raises:
        TransportError: The other end has closed, or is silent for longer than the socket's timeout.
    """
    data = bytearray()
    while len(data) < size:
        try:
            piece = sock.recv(min(size - len(data), 1 << 20))
        except OSError as error:
            raise TransportError(f"nothing more is received: {_reason(error)}") from error
        if not piece:
            raise TransportError("the other end has closed the connection")
        data += piece
    return bytes(data)


def _reason(error: Exception) -> str:
    if isinstance(error, TimeoutError):
        return "it does not answer in time"
    return getattr(error, "strerror", None) or str(error) or type(error).__name__


class Prober:
    """Checks every three seconds, and on request, whether nodes listen: killed ones do not say."""

    def __init__(
        self, requests: Worker[Callable[[], object]], timer: Worker[Callable[[], object]]
    ) -> None:
        self._requests = requests
        self._timer = timer
        self._nodes: Callable[[], dict[str, str]] = dict
        self._probed: Callable[[str, str, bool], object] = lambda *_: None
        self._checking: set[tuple[str, str]] = set()

    def start(
        self, nodes: Callable[[], dict[str, str]], probed: Callable[[str, str, bool], object]
    ) -> None:
        """Look at the nodes from now on.

        Args:
            nodes: Function that returns the URIs of the nodes by name.
            probed: Function called with a node, its URI and whether it listens there, on a thread
                for requests.
        """
        self._nodes, self._probed = nodes, probed
        self._timer.later(_PROBE_SECONDS, self._look)

    def check(self, node: str, uri: str) -> None:
        """Look at a node soon, as it may have ended; any thread may call it."""
        if (node, uri) not in self._checking:
            self._checking.add((node, uri))
            self._requests.submit(partial(self._check, node, uri))

    def _look(self) -> None:
        for node, uri in self._nodes().items():
            self.check(node, uri)
        self._timer.later(_PROBE_SECONDS, self._look)

    def _check(self, node: str, uri: str) -> None:
        try:
            self._probed(node, uri, is_listening(uri))
        finally:
            self._checking.discard((node, uri))
