"""Service servers."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rosz.errors import (
    DecodeError,
    EncodeError,
    RoszError,
    ServiceError,
    TransportError,
    UsageError,
)
from rosz.node.endpoint import Endpoint
from rosz.node.pool import Pool
from rosz.qos import QoS
from rosz.session import Query
from rosz.wire import Kind, pack, read

if TYPE_CHECKING:
    from rosz.message import Message
    from rosz.message import Service as ServiceType
    from rosz.node.node import Node

__all__ = ("Refusal", "Service", "to_response")

_NO_GID = bytes(16)


class Refusal(ServiceError):
    """What a handler raises to answer with an error that it has told the log about itself."""


class Service(Endpoint):
    """A server of a service; see `rosz.Node.service`.

    Every call gets a thread of a bounded pool. What the handler raises is logged here and arrives
    at the caller as `ServiceError`; a handler that raises `ServiceError` itself refuses a request
    on purpose, and nothing is logged.
    """

    def __init__(
        self,
        node: Node,
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
        self._open(threads)
        self.announce()

    def _open(self, threads: int) -> None:
        """Take questions in from now on.

        Raises:
            UsageError: That many threads would answer nobody.
        """
        if not isinstance(threads, int) or threads < 1:
            raise UsageError(f"threads is {threads!r}: expected 1 or more")
        questions = self.node.context.session.pull_queryable(self.key, complete=True)
        self._declared.append(questions)
        Pool(threads, f"rosz-srv{self.name}", questions.receive, self.serve)

    def serve(self, query: Query) -> None:
        """Answer a question, and close it."""
        try:
            if self.closed:
                return
            attachment = query.attachment
            sequence, gid = 0, _NO_GID
            if attachment is not None:
                sequence, _, gid = read(attachment)
            payload = self._answer(query.payload or b"", gid)
            query.reply(self.key, payload, attachment=pack(sequence, time.time_ns(), gid))
        except TransportError as error:
            self.node.log.warning("cannot answer a call of '%s': %s", self.name, error)
        except (ServiceError, DecodeError) as error:
            self._refuse(query, str(error))
        finally:
            query.close()

    def handle(self, request: Any, caller: bytes) -> Any:
        """Have the handler answer a request.

        Args:
            request: The request.
            caller: The gid of the client that sent it; zeros where it does not say.
        """
        del caller
        return self._handler(request)

    def _answer(self, request: bytes, caller: bytes) -> bytes:
        """Return the encoded response.

        Raises:
            DecodeError: The request is damaged.
            Refusal: The handler raised it.
            ServiceError: The handler raised something else, or returned what is no response.
        """
        types = self.service_type
        message = types.Request._decode(request)
        try:
            result = self.handle(message, caller)
        except Refusal:
            raise
        except ServiceError as error:  # a refusal, which is no fault of the handler
            raise ServiceError(f"service cannot process request: {error}") from error
        except BaseException as error:  # what it raises must not end a thread of the pool
            self.node.log.exception("handler of service '%s' failed", self.name)
            raise ServiceError(f"error processing request: {error}") from error
        try:
            return types.Response._encode(to_response(types.Response, result))
        except EncodeError as error:
            self.node.log.exception("handler of service '%s' returned no response", self.name)
            raise ServiceError(f"handler returned invalid value: {error}") from error

    def _refuse(self, query: Query, text: str) -> None:
        try:
            query.reply_error(text)
        except RoszError as error:
            self.node.log.warning("cannot answer a call of '%s': %s", self.name, error)


def to_response(response: type[Message], result: Any) -> Message:
    """Turn what a handler returned into a response, as rospy does.

    Args:
        response: Class of the response.
        result: A response, a list or tuple of all field values, a dictionary of some, ``None`` for
            a response without fields, or the value of a single field.

    Raises:
        EncodeError: It is none of these.
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
