"""Calls of ROS 1's nodes and masters, and connections to them."""

from __future__ import annotations

import http.client
import socket
from collections.abc import Callable
from contextlib import closing
from typing import Any
from urllib.parse import urlsplit

import msgspec

from rosz.bridges.ros1.calls import MAX_BODY, decode_result, encode_call
from rosz.bridges.ros1.frames import MAX_HEADER, decode_header, encode_header
from rosz.errors import DecodeError, ServiceError, TransportError

__all__ = (
    "TIMEOUT",
    "Address",
    "call",
    "connect",
    "exchange_headers",
    "is_listening",
    "multicall",
    "receive",
)

TIMEOUT = 5.0
"""Seconds that another program gets for a connection, and for an answer."""

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


def is_listening(uri: str, timeout: float = TIMEOUT) -> bool:
    """Return whether a program listens at a URI, or its machine is too slow to tell."""
    address = Address.parse(uri)
    try:
        socket.create_connection((address.host, address.port), timeout).close()
    except TimeoutError:
        return True
    except (OSError, UnicodeError):
        return False
    return True


def _request(
    uri: str,
    method: str,
    args: tuple[Any, ...] | Callable[[str], tuple[Any, ...]],
    timeout: float,
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


def multicall(
    uri: str, calls: list[tuple[str, tuple[Any, ...]]], timeout: float = TIMEOUT
) -> list[Any]:
    """Call several methods of a master at once, and return their values; None for what failed.

    Raises:
        TransportError: The master cannot be reached, or does not answer in time.
        DecodeError: The answer is not one of ROS 1.
    """
    if not calls:
        return []
    many = [{"methodName": method, "params": list(args)} for method, args in calls]
    results = _request(uri, "system.multicall", (many,), timeout)
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
