"""XML-RPC over HTTP as bytes: calls between ROS 1's master, its nodes and this bridge.

Only requests of ROS 1's programs are understood: POST with a Content-length. Documents with a type
declaration are refused, because entities can make small documents huge; so is deep nesting.
"""

from __future__ import annotations

import xmlrpc.client
from collections.abc import Iterator
from typing import Any
from xml.parsers import expat

import msgspec

from rosz.errors import DecodeError, EncodeError

MAX_HEAD = 16 << 10
"""Largest size of the head of an HTTP request in bytes."""

MAX_BODY = 64 << 20
"""Largest size of an XML document in bytes."""

_MAX_DEPTH = 400
"""Elements within elements: an array within an array is three."""

_CALL = "XML-RPC call"
_RESULT = "XML-RPC result"
_END = b"\r\n\r\n"
_FAULT = 1
_FOREIGN = (
    xmlrpc.client.Error,
    expat.ExpatError,
    ArithmeticError,
    LookupError,
    TypeError,
    ValueError,
    AttributeError,
)
"""Errors of the standard library for documents that are not XML-RPC."""


class RpcCall(msgspec.Struct, frozen=True):
    """A call that was received.

    Attributes:
        keep_alive: Whether the caller keeps the connection for further calls.
        size: Size of its document in bytes.
    """

    path: str
    method: str
    args: tuple[Any, ...]
    keep_alive: bool = True
    size: int = 0


class CallReader:
    """Cuts a stream of HTTP requests into calls."""

    def __init__(self) -> None:
        self._data = bytearray()
        self._head: tuple[str, int, bool] | None = None

    @property
    def is_idle(self) -> bool:
        """Whether nothing of the next call has been received."""
        return self._head is None and not self._data

    @property
    def size(self) -> int:
        """Number of bytes that have been received of the next call."""
        return len(self._data)

    def feed(self, data: bytes | memoryview) -> Iterator[RpcCall]:
        """Yield the calls that are complete with more bytes of the stream.

        Raises:
            DecodeError: The bytes are not such a call.
        """
        self._data += data
        while True:
            if self._head is None:
                end = self._data.find(_END, 0, MAX_HEAD)
                if end < 0:
                    if len(self._data) >= MAX_HEAD:
                        raise DecodeError(_CALL, 0, f"no end of its head in {MAX_HEAD} bytes")
                    return
                self._head = _read_head(bytes(self._data[:end]))
                del self._data[: end + len(_END)]
            path, size, keep_alive = self._head
            if len(self._data) < size:
                return
            body = bytes(self._data[:size])
            del self._data[:size]
            self._head = None
            args, method = _loads(body, _CALL)
            if method is None:
                raise DecodeError(_CALL, -1, "no methodName")
            yield RpcCall(path, method, args, keep_alive, size)


def _read_head(head: bytes) -> tuple[str, int, bool]:
    """Return the path, the size of the body, and whether the connection is kept."""
    first, *lines = head.decode("latin-1").split("\r\n")
    words = first.split(" ")
    if len(words) != 3 or words[0] != "POST":  # noqa: PLR2004  # method, path, version
        raise DecodeError(_CALL, 0, f"'{first:.40}', expected 'POST path HTTP/1.1'")
    fields = {}
    for line in lines:
        name, _, value = line.partition(":")
        fields[name.strip().lower()] = value.strip()
    size = fields.get("content-length", "")
    if not (size.isascii() and size.isdigit()) or int(size[:12]) > MAX_BODY:
        raise DecodeError(
            _CALL, 0, f"Content-length is '{size:.20}', expected a number up to {MAX_BODY}"
        )
    connection = fields.get("connection", "").lower()
    kept = connection == "keep-alive" if words[2] == "HTTP/1.0" else connection != "close"
    return words[1], int(size), kept


def _loads(body: bytes, what: str) -> tuple[tuple[Any, ...], str | None]:
    """Return the values of a document, and the name of the method.

    Raises:
        DecodeError: It is not XML-RPC.
        xmlrpc.client.Fault: It is a fault.
    """
    target = xmlrpc.client.Unmarshaller(use_builtin_types=True)
    parser = expat.ParserCreate()
    parser.buffer_text = True
    depth = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > _MAX_DEPTH:
            raise DecodeError(what, parser.CurrentByteIndex, "values are nested too deeply")
        target.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        target.end(tag)

    def refuse(*_: object) -> None:
        raise DecodeError(what, parser.CurrentByteIndex, "a document type is not allowed")

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = target.data
    parser.StartDoctypeDeclHandler = refuse
    target.xml("", None)  # expat has decoded the text
    try:
        parser.Parse(body, True)  # the end of the document
        return target.close(), target.getmethodname()
    except (DecodeError, xmlrpc.client.Fault):
        raise
    except _FOREIGN as error:
        raise DecodeError(
            what, parser.CurrentByteIndex, f"{error}" or type(error).__name__
        ) from error


def encode_call(host: str, path: str, method: str, args: tuple[Any, ...]) -> bytes:
    """Return a call with its HTTP head.

    Raises:
        EncodeError: XML-RPC has no such value, such as an integer beyond 32 bits.
    """
    body = _dumps(args, methodname=method)
    head = (
        f"POST {path} HTTP/1.1\r\nHost: {host}\r\nUser-Agent: rosz\r\nContent-Type: text/xml\r\n"
        f"Content-Length: {len(body)}\r\n\r\n"
    )
    return head.encode() + body


def decode_result(body: bytes) -> Any:
    """Return the value of a result.

    Raises:
        DecodeError: The document is not a result, or it is a fault.
    """
    try:
        values, _ = _loads(body, _RESULT)
    except xmlrpc.client.Fault as error:
        raise DecodeError(_RESULT, -1, f"fault: {error.faultString}") from error
    if len(values) != 1:
        raise DecodeError(_RESULT, -1, f"{len(values)} values, expected 1")
    return values[0]


def encode_result(value: Any, *, keep_alive: bool = True) -> bytes:
    """Return a result with its HTTP head.

    Raises:
        EncodeError: XML-RPC has no such value, such as an integer beyond 32 bits.
    """
    return _respond(_dumps((value,), methodresponse=True), keep_alive=keep_alive)


def encode_fault(text: str, *, keep_alive: bool = True) -> bytes:
    """Return a fault with its HTTP head."""
    return _respond(
        _dumps(xmlrpc.client.Fault(_FAULT, text), methodresponse=True), keep_alive=keep_alive
    )


def encode_refusal(text: str) -> bytes:
    """Return the response to a request that is not a call; the connection is closed after it."""
    body = f"{text}\n".encode()
    head = f"HTTP/1.1 400 Bad Request\r\nContent-type: text/plain\r\nContent-length: {len(body)}"
    return f"{head}\r\nConnection: close\r\n\r\n".encode() + body


def _respond(body: bytes, *, keep_alive: bool) -> bytes:
    # roscpp looks for exactly this spelling of the fields.
    head = f"HTTP/1.1 200 OK\r\nContent-type: text/xml\r\nContent-length: {len(body)}\r\n"
    last = "" if keep_alive else "Connection: close\r\n"
    return f"{head}{last}\r\n".encode() + body


def _dumps(values: tuple[Any, ...] | xmlrpc.client.Fault, **options: Any) -> bytes:
    try:
        return xmlrpc.client.dumps(values, **options).encode()
    except (TypeError, OverflowError, ValueError) as error:
        raise EncodeError("XML-RPC", "", str(error)) from error
