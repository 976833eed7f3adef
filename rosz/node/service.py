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
from rosz.node.entity import Entity
from rosz.qos import QoS
from rosz.session import Query
from rosz.wire import Kind, pack_attachment, read_attachment
from rosz.worker import Worker

if TYPE_CHECKING:
    from rosz.message import Message
    from rosz.message import Service as ServiceType

__all__ = ("Service", "to_response")

_NO_GID = bytes(16)


class Service(Entity):
    """Serve a service; see `rosz.Node.service`.

    Each call is handled on one of a bounded number of threads. What the handler raises is logged
    here and arrives at the caller as `ServiceError`; a handler that raises `ServiceError` itself
    refuses a request on purpose, and nothing is logged.
    """

    def __init__(
        self,
        node: NodeCore,
        name: str,
        service_type: type[ServiceType],
        handler: Callable[[Any], Any],
        qos: QoS,
        threads: int,
    ) -> None:
        super().__init__(
            node, Kind.SERVICE, name, service_type._type_name, service_type._type_hash, qos
        )
        self.service_type = service_type
        self._handler = handler
        self._decode = node.context.decoder(service_type.Request)
        self._open(threads)
        self.announce()

    def _open(self, threads: int) -> None:
        """Receive requests from now on.

        Raises:
            UsageError: The number of threads is below 1.
        """
        if not isinstance(threads, int) or threads < 1:
            raise UsageError(f"threads is {threads!r}: expected 1 or more")
        queryable = self.keep(self.node.context.session.pull_queryable(self.key, complete=True))
        Worker(f"rosz-srv{self.name}", self.serve, receive=queryable.receive, threads=threads)

    def serve(self, query: Query) -> None:
        """Respond to a request, and close its query."""
        try:
            if self.closed:
                return
            attachment = query.attachment
            sequence, gid = 0, _NO_GID
            if attachment is not None:
                sequence, _, gid = read_attachment(attachment)
            request = self._decode(query.payload or b"")
            payload = self.respond(request, gid)
            query.reply(
                self.key, payload, attachment=pack_attachment(sequence, time.time_ns(), gid)
            )
        except ClosedError:
            return  # the session ends, and the client gets no response
        except TransportError as error:
            self.node.log.warning("cannot respond to a call of '%s': %s", self.name, error)
        except (ServiceError, DecodeError) as error:
            try:
                query.reply_error(str(error))
            except RoszError as unsent:
                self.node.log.warning("cannot respond to a call of '%s': %s", self.name, unsent)
        finally:
            query.close()

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
