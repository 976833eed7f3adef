"""Services: ROS 1's nodes serve the network, and the network serves ROS 1's programs."""

from __future__ import annotations

import socket
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from struct import Struct
from typing import Any

from rosz.bridges.ros1.frames import MAX_FRAME, FrameReader, encode_header, frame
from rosz.bridges.ros1.peers import Address, connect_either, exchange_headers, receive
from rosz.bridges.ros1.registry import ANY_TYPE, RegistryEntry
from rosz.bridges.ros1.server import Incoming
from rosz.bridges.ros1.shared import BridgeResources
from rosz.bridges.ros1.sockets import Handler, log
from rosz.errors import (
    ClosedError,
    DecodeError,
    RoszError,
    ServiceError,
    ServiceNotFound,
    TransportError,
)
from rosz.node import BridgedNode, Client, Service
from rosz.qos import SERVICES
from rosz.wire import Kind

_LENGTH = Struct("<I")
_OK = b"\1"
_FAILED = b"\0"
_REFUSED = "service cannot process request: "
"""Beginning of the text of an error, as in rospy."""

_KEPT = 1 << 20
"""Bytes that a connection keeps for its next request."""

_THREADS = 16
_RETRY = 1.0
_MOST_RETRIES = 5
_TIMEOUT = 24 * 3600.0
"""Seconds for a call of a service: ROS 1 has no limit, and a server that ends answers at once."""


class ProvidedService:
    """A service that a node of ROS 1 provides."""

    def __init__(self, shared: BridgeResources, node: BridgedNode, entry: RegistryEntry) -> None:
        self.entry = entry
        self._shared = shared
        self._node = node
        self._service: Service | None = None
        self._type: Any = None
        self._closed = False
        self._tries = 0
        self._sockets: set[socket.socket] = set()
        self._probe_soon()

    def update(self) -> None:
        """Do nothing: a service does not depend on the network."""

    def close(self) -> None:
        """Take the service from the network; calls that are running fail."""
        self._closed = True
        for sock in list(self._sockets):
            with suppress(OSError):
                sock.shutdown(socket.SHUT_RDWR)
        if self._service is not None:
            self._service.close()

    def _probe_soon(self) -> None:
        if not self._closed and not self._shared.requests.offer(self._probe):
            self._shared.changes.later(_RETRY, self._probe_soon)

    def _probe(self) -> None:
        """Ask the provider for the type; runs on a thread for requests."""
        changes = self._shared.changes
        try:
            with self._connect() as sock:
                header = exchange_headers(sock, {**self._fields(ANY_TYPE), "probe": "1"})
            name = header.get("type", "")
            cls = self._shared.context.types.service(name)
            if header.get("md5sum", cls._md5sum) != cls._md5sum:
                raise DecodeError(
                    name, -1, f"its md5 is {header['md5sum']} there, and {cls._md5sum} here"
                )
        except TransportError as error:
            self._tries += 1
            if self._tries < _MOST_RETRIES:
                changes.later(_RETRY, self._probe_soon)
                return
            changes.submit(partial(self._report, error))
        except RoszError as error:
            changes.submit(partial(self._report, error))
        else:
            changes.submit(partial(self._declare, cls))

    def _report(self, error: RoszError) -> None:
        if not self._closed:
            log.warning(
                "service '%s' of node '%s' stays in ROS 1: %.300s",
                self.entry.name,
                self.entry.node,
                error,
            )

    def _declare(self, cls: Any) -> None:
        self._type = cls
        if not self._closed:
            identity = self._shared.identity(self.entry.node, Kind.SERVICE, self.entry.name)
            with suppress(ClosedError):
                self._service = self._node.keep(
                    Service(
                        self._node,
                        self._shared.here(self.entry.name),
                        cls,
                        self._call,
                        SERVICES,
                        _THREADS,
                        number=identity.number,
                        rare=True,  # each node of ROS 1 has two for its log
                    )
                )

    def _connect(self) -> socket.socket:
        return connect_either(Address.parse(self.entry.service_uri), self.entry.uri)

    def _fields(self, md5sum: str) -> dict[str, str]:
        return {"callerid": self._shared.name, "service": self.entry.name, "md5sum": md5sum}

    def _call(self, request: Any) -> Any:
        """Call the provider; runs on a thread of the service."""
        cls = self._type
        try:
            with self._connect() as sock:
                exchange_headers(sock, self._fields(cls._md5sum))
                self._sockets.add(sock)
                try:
                    sock.settimeout(None)
                    sock.sendall(frame(request.to_ros1()))
                    ok = receive(sock, 1)
                    (size,) = _LENGTH.unpack(receive(sock, _LENGTH.size))
                    if size > MAX_FRAME:
                        raise ServiceError(f"a response of {size} bytes")
                    data = receive(sock, size)
                finally:
                    self._sockets.discard(sock)
        except (OSError, RoszError) as error:
            self._shared.prober.check(self.entry.node, self.entry.uri)
            raise ServiceError(f"node '{self.entry.node}' of ROS 1: {error}") from error
        if ok != _OK:
            raise ServiceError(data.decode(errors="replace").removeprefix(_REFUSED))
        return cls.Response.from_ros1(data)


class Clients:
    """Clients of services on the network, one for each service that ROS 1's programs call."""

    def __init__(self, node: BridgedNode, shared: BridgeResources) -> None:
        self._node = node
        self._shared = shared
        self._clients: dict[str, Client] = {}

    def find(self, service: str) -> Client:
        """Return the client of a service.

        Raises:
            RoszError: Nobody serves it, or its type is not known; the text says so.
        """
        servers = self._shared.entities(Kind.SERVICE, name=service)
        if not servers:
            raise ServiceNotFound(f"nobody on the network serves '{service}'")
        token = servers[0]
        before = self._clients.get(service)
        if before is not None and before.matches(token):
            return before
        cls = self._shared.context.types.service(token.type_name)
        client = self._node.keep(Client(self._node, service, cls, SERVICES, _TIMEOUT))
        self._clients[service] = client
        if before is not None:
            before.close()
        return client

    def update(self, service: str) -> None:
        """Close the client of a service that nobody serves any more."""
        if service in self._clients and not self._shared.entities(Kind.SERVICE, name=service):
            self._clients.pop(service).close()


class ServiceConnection(Handler):
    """A connection on which a program of ROS 1 calls a service of the network.

    Args:
        persistent: Whether more than one call may come.
        submit: Function that runs a task on a thread that may wait; returns whether it will.
    """

    def __init__(
        self,
        shared: BridgeResources,
        incoming: Incoming,
        client: Client,
        *,
        persistent: bool,
        submit: Callable[[Callable[[], object]], bool],
    ) -> None:
        self._shared = shared
        self._incoming = incoming
        self._stream = incoming.stream
        self._client = client
        self._persistent = persistent
        self._submit = submit
        self._reader = FrameReader(MAX_FRAME)

    def open(self, *, probe: bool) -> None:
        """Answer the header, and take calls unless it was a probe."""
        cls: Any = self._client.service_type
        fields = {
            "callerid": self._shared.name,
            "md5sum": cls._md5sum,
            "type": cls._type,
            "request_type": cls.Request._type,
            "response_type": cls.Response._type,
            "service": self._client.name,
        }
        self._stream.send([encode_header(fields)])
        if probe:
            self._stream.end()
        else:
            self._shared.loop.call(self._follow)

    def space(self) -> memoryview:
        """Return where the next bytes belong."""
        return self._reader.space()

    def received(self, count: int) -> None:
        """Call the service with each request that is complete."""
        for request in self._reader.take(count):
            data = bytes(request)
            self._incoming.hold(0)
            self._incoming.server.hold(len(data))
            if not self._submit(partial(self._call, data)):
                self._incoming.server.hold(-len(data))
                self._answer(_FAILED, b"the bridge is busy")
        self._incoming.hold(self._reader.pending)
        if not self._reader.pending and self._reader.size > _KEPT:
            self._reader = FrameReader(MAX_FRAME)

    def _follow(self) -> None:
        if not self._stream.is_closed:
            self._stream.handler = self
            self._stream.pause(reading=True)

    def _call(self, data: bytes) -> None:
        cls = self._client.service_type
        try:
            response = self._client.call(cls.Request.from_ros1(data))
            ok, answer = _OK, response.to_ros1()
        except RoszError as error:
            # The program adds the name of the service itself.
            text = str(error).removeprefix(
                f"service [{self._client.name}] responded with an error: "
            )
            ok, answer = _FAILED, text.encode()
        finally:
            self._incoming.server.hold(-len(data))
        self._answer(ok, answer)

    def _answer(self, ok: bytes, data: bytes) -> None:
        self._stream.send((ok + _LENGTH.pack(len(data)), data))
        if not self._persistent:
            self._stream.end()
