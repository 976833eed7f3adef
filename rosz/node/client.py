"""Service clients."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING, Any

from rosz.errors import (
    ClosedError,
    DecodeError,
    EncodeError,
    ServiceError,
    ServiceNotFound,
    WaitTimeout,
    near_miss,
)
from rosz.node.endpoint import Endpoint
from rosz.qos import QoS
from rosz.wire import Kind, pack

if TYPE_CHECKING:
    from rosz.message import Message
    from rosz.message import Service as ServiceType
    from rosz.node.node import Node
    from rosz.session import Reply

__all__ = ("Client",)

_ATTEMPTS = 3
_PAUSE = 0.02
_GRACE = 1.0


class _Call:
    """One call on its way; ``done`` is set by its answer, its end or the client's end."""

    def __init__(self) -> None:
        self.done = threading.Event()
        self.reply: Reply | None = None
        self.closed = False

    def take(self, reply: Reply) -> None:
        if self.reply is None:
            self.reply = reply
            self.done.set()

    def cancel(self) -> None:
        self.closed = True
        self.done.set()


class Client(Endpoint):
    """A caller of a service; see `rosz.Node.client`. Any number of threads may call at once."""

    def __init__(
        self, node: Node, name: str, service_type: type[ServiceType], qos: QoS, timeout: float
    ) -> None:
        super().__init__(
            node, Kind.CLIENT, name, service_type._type_name, service_type._type_hash, qos
        )
        self.service_type = service_type
        self.timeout = timeout
        self._sequence = 0
        self._lock = threading.Lock()
        self._calls: set[_Call] = set()
        self._announce()

    def __call__(self, *args: Any, timeout: float | None = None, **fields: Any) -> Any:
        """Call with a request, or with the values of its fields; see `call`."""
        request_type = self.service_type.Request
        if len(args) == 1 and not fields and isinstance(args[0], request_type):
            return self.call(args[0], timeout)
        try:
            request = request_type(*args, **fields)
        except TypeError as error:
            raise EncodeError(request_type._type_name, "", str(error)) from error
        return self.call(request, timeout)

    def call(self, request: Message, timeout: float | None = None) -> Any:
        """Send a request and wait for the response.

        Args:
            request: Of the service's request type.
            timeout: Seconds; the client's own when not given.

        Returns:
            The response, an instance of the service's response type.

        Raises:
            EncodeError: A field of the request has a value that does not fit.
            ServiceNotFound: Nobody serves it.
            ServiceError: The server answered with an error, or ended before it answered.
            WaitTimeout: There was no answer in time.
            ClosedError: The client or its context was closed meanwhile.
        """
        limit = self.timeout if timeout is None else timeout
        deadline = time.monotonic() + limit
        payload = self.service_type.Request._encode(request)
        self._find_server(min(limit, _GRACE))
        for attempt in range(_ATTEMPTS):
            reply = self._attempt(payload, deadline, limit)
            if reply is not None:
                return self._response(reply, limit)
            if not self._servers():
                break
            # Its token is here, but nobody was asked: the route is a moment behind the token.
            if attempt < _ATTEMPTS - 1:
                time.sleep(_PAUSE)
        raise ServiceError(f"service [{self.name}]: the server ended before it answered")

    def _attempt(self, payload: bytes, deadline: float, limit: float) -> Reply | None:
        """Ask once; ``None`` when the question ended without an answer."""
        left = deadline - time.monotonic()
        if left <= 0:
            raise self._late(limit)
        call = _Call()
        with self._lock:
            if self.closed:
                raise ClosedError(f"cannot call '{self.name}': the client is closed")
            self._calls.add(call)
            self._sequence += 1
            attachment = pack(self._sequence, time.time_ns(), self.gid)
        try:
            self.node.context.session.get_async(
                self.key,
                call.take,
                call.done.set,
                timeout=left,
                payload=payload,
                attachment=attachment,
                target="all_complete",
            )
            if not call.done.wait(left):
                raise self._late(limit)
        finally:
            with self._lock:
                self._calls.discard(call)
        if call.closed:
            raise ClosedError(f"the call of '{self.name}' was cancelled: shutting down")
        return call.reply

    def _response(self, reply: Reply, limit: float) -> Message:
        if not reply.ok:
            text = reply.payload.decode(errors="replace")
            if text == "Timeout":
                raise self._late(limit)
            raise ServiceError(f"service [{self.name}] responded with an error: {text}")
        try:
            response: Message = self.service_type.Response._decode(reply.payload)
        except DecodeError as error:
            raise ServiceError(f"service [{self.name}] answered with damage: {error}") from error
        return response

    def _late(self, limit: float) -> WaitTimeout:
        return WaitTimeout(
            f"answer of service '{self.name}'", limit, "the server is busy, stopped or out of reach"
        )

    def _servers(self) -> list[str]:
        """Return the nodes that serve this name with this type."""
        view = self.node.context.graph.view()
        return [
            token.node_name
            for token in view.servers(self.name)
            if token.type_name == self.token.type_name
        ]

    def _find_server(self, grace: float) -> None:
        """Make sure that somebody serves the name, waiting while the process is still joining."""
        if self._servers():
            return
        context = self.node.context
        if not context.settled.is_set():
            context.settled.wait(grace)
        if self._servers():
            return
        view = context.graph.refresh()
        if self._servers():
            return
        others = {token.type_name for token in view.servers(self.name)}
        if others:
            raise ServiceNotFound(
                f"service [{self.name}] is served with type '{', '.join(sorted(others))}',"
                f" expected '{self.token.type_name}'"
            )
        known = view.services()
        raise ServiceNotFound(
            f"service [{self.name}] is not available"
            f"{near_miss(self.name, known) or '; nobody serves that name'}"
        )

    def wait_for_service(self, timeout: float = 10.0) -> None:
        """Wait until somebody serves this name with this type.

        Args:
            timeout: Seconds.

        Raises:
            WaitTimeout: Nobody did in time.
        """
        self.node.context.graph.wait_for(
            lambda view: any(
                token.type_name == self.token.type_name for token in view.servers(self.name)
            ),
            timeout,
            f"service '{self.name}' of type '{self.token.type_name}'",
        )

    def _finish(self) -> None:
        with self._lock:
            calls = list(self._calls)
        for call in calls:
            call.cancel()
