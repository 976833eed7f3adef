"""Service servers."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rosz.errors import (
    ClosedError,
    DecodeError,
    EncodeError,
    RoszError,
    ServiceError,
    TransportError,
    UsageError,
)
from rosz.node.core import NodeCore
from rosz.node.entity import Entity, Introspect
from rosz.qos import QoS
from rosz.session import Query
from rosz.wire import Kind, pack_attachment, read_attachment
from rosz.worker import Worker

if TYPE_CHECKING:
    from rosz.message import Message
    from rosz.message import Service as ServiceType

_NO_GID = bytes(16)


class Service(Entity):
    """Serve a service; see `rosz.Node.service`.

    Each call is handled on one of a bounded number of threads. What the handler raises is logged
    here and arrives at the caller as `ServiceError`; a handler that raises `ServiceError` itself
    refuses a request on purpose, and nothing is logged.

    A ``number`` is that of the server within the session; by default one that was never used. Calls
    of a ``rare`` server may wait a moment; it has no thread before the first call.

    Attributes:
        introspect: Function called with each request that is received, and each response sent.
    """

    def __init__(
        self,
        node: NodeCore,
        name: str,
        service_type: type[ServiceType],
        handler: Callable[[Any], Any],
        qos: QoS,
        threads: int,
        *,
        number: int | None = None,
        rare: bool = False,
    ) -> None:
        type_name, type_hash = service_type._type_name, service_type._type_hash
        super().__init__(node, Kind.SERVICE, name, type_name, type_hash, qos, number=number)
        self.service_type = service_type
        self._handler = handler
        self._decode = node.context.decoder(service_type.Request)
        self._rare = rare
        self.introspect: Introspect | None = None
        self._open(threads)
        self.announce()

    def _open(self, threads: int) -> None:
        """Receive requests from now on."""
        if not isinstance(threads, int) or threads < 1:
            raise UsageError(f"threads is {threads!r}: expected 1 or more")
        name, session = f"rosz-srv{self.name}", self.node.context.session
        if self._rare:
            worker = self.keep(Worker[Query](name, self.serve, threads=threads))
            self.keep(session.queryable(self.key, worker.submit, complete=True))
        else:
            queryable = self.keep(session.pull_queryable(self.key, complete=True))
            Worker(name, self.serve, receive=queryable.receive, threads=threads)

    def serve(self, query: Query) -> None:
        """Respond to a request, and close its query."""
        call = self._read(query)
        if call is None:
            return
        if self.introspect is not None:
            self.introspect("REQUEST_RECEIVED", call.caller, call.sequence, call.request)
        try:
            payload = self.respond(call.request, call.caller)
        except ServiceError as error:
            call.refuse(str(error))
        else:
            call.answer(payload)
            if self.introspect is not None:
                response = self.service_type.Response._decode(payload)
                self.introspect("RESPONSE_SENT", call.caller, call.sequence, response)

    def _read(self, query: Query) -> Call | None:
        """Return the call of a query; None if that is not one, which the caller learns."""
        if self.closed:
            query.close()
            return None
        try:
            return Call(self, query, self._decode(query.payload or b""))
        except DecodeError as error:
            _refuse(self, query, str(error))
            return None

    def respond(self, request: Any, caller: bytes) -> bytes:
        """Return the encoded response to a request.

        Args:
            request: The request.
            caller: GID of the client that sent it; zeros if the client does not tell.

        Raises:
            ServiceError: The handler failed, or did not return a response.
        """
        del caller
        try:
            result = self._handler(request)
        except ServiceError as error:  # a refusal on purpose
            raise ServiceError(f"service cannot process request: {error}") from error
        except BaseException as error:  # it must not end the thread
            self.node.log.exception("handler of service '%s' failed", self.name)
            raise ServiceError(f"error processing request: {error}") from error
        try:
            response = to_response(self.service_type.Response, result)
            return response._encode(response)
        except EncodeError as error:
            self.node.log.exception("handler of service '%s' returned no response", self.name)
            raise ServiceError(f"handler returned invalid value: {error}") from error


class Call:
    """A request that has not been answered yet.

    Args:
        service: Service that received it.
        query: Query that carried it.
        request: The request.

    Attributes:
        request: The request.
        caller: GID of the client; zeros if the client does not tell.
        sequence: Number of the request, which the client gave it.

    Raises:
        DecodeError: The attachment is damaged.
    """

    __slots__ = ("_query", "_service", "caller", "request", "sequence")

    def __init__(self, service: Service, query: Query, request: Any) -> None:
        self._service = service
        self._query = query
        self.sequence: int = 0
        self.caller: bytes = _NO_GID
        self.request: Any = request
        attachment = query.attachment
        if attachment is not None:
            self.sequence, _, self.caller = read_attachment(attachment)

    def answer(self, payload: bytes) -> None:
        """Send the encoded response."""
        attachment = pack_attachment(self.sequence, time.time_ns(), self.caller)
        with self._query as query:
            try:
                query.reply(self._service.key, payload, attachment=attachment)
            except ClosedError:
                return  # the session ends, and the client gets no response
            except TransportError as error:
                _warn(self._service, error)

    def refuse(self, text: str) -> None:
        """Send an error instead of a response."""
        _refuse(self._service, self._query, text)


def _refuse(service: Service, query: Query, text: str) -> None:
    """Send an error as the only reply to a query."""
    with query:
        try:
            query.reply_error(text)
        except RoszError as error:
            _warn(service, error)


def _warn(service: Service, error: RoszError) -> None:
    service.node.log.warning("cannot respond to a call of '%s': %s", service.name, error)


class CallService(Service):
    """A service whose handler gets each `Call`, and may answer it later, on any thread."""

    def serve(self, query: Query) -> None:
        """Hand a call to the handler."""
        call = self._read(query)
        if call is None:
            return
        try:
            self._handler(call)
        except ServiceError as error:
            call.refuse(str(error))


def to_response(response: type[Message], result: Any) -> Message:
    """Return the response that the result of a handler means, as rospy does.

    Args:
        response: Class of the response.
        result: A response, a list or tuple of all field values, a dictionary of some, ``None`` for
            a response without fields, or the value of a single field.

    Raises:
        EncodeError: The result is none of these.
    """
    if isinstance(result, response):
        return result
    fields = response.__struct_fields__
    try:
        if isinstance(result, dict):
            return response(**result)
        if isinstance(result, list | tuple):
            if len(result) == len(fields):
                return response(*result)
        elif len(fields) == 1:
            return response(result)
        elif result is None and not fields:
            return response()
    except TypeError as error:
        raise EncodeError(response._type, "", str(error)) from error
    raise EncodeError(
        response._type,
        "",
        f"got {type(result).__name__} {result!r:.80}, expected a response, or values for"
        f" {', '.join(fields) or 'no fields'}",
    )
