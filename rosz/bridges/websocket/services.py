"""Services: clients call those of the network, and serve some themselves."""

from __future__ import annotations

import itertools
import threading
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout
from typing import TYPE_CHECKING, Any

from rosz.bridges.websocket.messages import build
from rosz.bridges.websocket.operations import AdvertiseService, CallService, ServiceResponse
from rosz.bridges.websocket.plain import Plain, Spelling, converter
from rosz.errors import NotFoundError, ServiceError, UsageError, WaitTimeout, near_miss
from rosz.node.type_description import request_type

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosz.node import Client, Node, Service
    from rosz.wire import Token

__all__ = ("Calls", "ServedServices")

_SERVER_SECONDS = 1.0
"""Seconds that a call waits for a server, as in rosbridge_suite."""
_ANSWER_SECONDS = 60.0


class Calls:
    """The services that one client calls.

    Args:
        node: Node that calls them.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._lock = threading.Lock()
        self._clients: dict[str, Client] = {}

    def call(self, name: str, operation: CallService, spelling: Spelling) -> Plain:
        """Call a service, and return the response as plain values.

        Args:
            name: Full name of the service.
            operation: The operation of the client.
            spelling: Whose names the fields of the response have.

        Raises:
            RoszError: The service is not there or failed, or the arguments do not fit.
        """
        client = self._client(name)
        request = build(client.service_type.Request, operation.args or None, self._node.now())
        response = client.call(request, operation.timeout)
        return converter(type(response), spelling)(response)

    def _client(self, name: str) -> Client:
        with self._lock:
            known = self._clients.get(name)
        if known is not None and known.served:
            return known
        view = self._node.context.graph.refresh()
        servers = view.servers(name)
        if not servers:
            raise NotFoundError(
                f"service '{name}' does not exist{near_miss(name, view.services())}"
            )
        client = self._node.client(name, request_type(self._node, servers[0]))
        with self._lock:
            before = self._clients.pop(name, None)
            self._clients[name] = client
        if before is not None:
            before.close()
        return client

    def _server(self, name: str) -> Token:
        graph = self._node.context.graph
        view = graph.refresh()
        if not view.servers(name):
            try:
                view = graph.wait_for_service(name, _SERVER_SECONDS)
            except WaitTimeout as error:
                near = near_miss(name, view.services())
                raise NotFoundError(f"service '{name}' does not exist{near}") from error
        return view.servers(name)[0]

    def close(self) -> None:
        """End all clients of services."""
        with self._lock:
            clients = list(self._clients.values())
            self._clients.clear()
        for client in clients:
            client.close()


class ServedServices:
    """The services that one client serves.

    Args:
        node: Node that has them.
        send: Function that sends an operation to the client.
    """

    def __init__(self, node: Node, send: Callable[[dict[str, Any]], object]) -> None:
        self._node = node
        self._send = send
        self._numbers = itertools.count(1)
        self._lock = threading.Lock()
        self._services: dict[str, Service] = {}
        self._pending: dict[str, Future[ServiceResponse]] = {}

    def advertise(self, name: str, operation: AdvertiseService, spelling: Spelling) -> None:
        """Serve a service with the answers of the client.

        Raises:
            RoszError: The type does not exist.
        """
        kind = self._node.context.types.service(operation.type)

        def handle(request: Any) -> Any:
            return self._query(name, operation.type, kind, request, spelling)

        self.unadvertise(name)
        service = self._node.service(name, kind, handle)
        with self._lock:
            self._services[name] = service

    def _query(self, name: str, type_name: str, kind: Any, request: Any, spelling: Spelling) -> Any:
        number = f"service_request:{name}:{next(self._numbers)}"
        pending: Future[ServiceResponse] = Future()
        with self._lock:
            self._pending[number] = pending
        try:
            args = converter(kind.Request, spelling)(request)
            call = {"op": "call_service", "id": number, "service": name, "type": type_name}
            self._send({**call, "args": args})
            answer = pending.result(_ANSWER_SECONDS)
        except FutureTimeout:
            raise ServiceError(
                f"the client that serves '{name}' has not answered within {_ANSWER_SECONDS:g} s"
            ) from None
        finally:
            with self._lock:
                self._pending.pop(number, None)
        # rosbridge_suite passes on the values of a response whatever its result is.
        if not answer.result and not isinstance(answer.values, dict | list):
            raise ServiceError(str(answer.values or "the service failed"))
        return build(kind.Response, answer.values or None, self._node.now())

    def respond(self, response: ServiceResponse) -> None:
        """Take the answer of the client to a call.

        Raises:
            UsageError: Nobody waits for it.
        """
        with self._lock:
            pending = self._pending.pop(str(response.id), None)
        if pending is None:
            raise UsageError(f"service_response: no call with the id '{response.id}' waits")
        pending.set_result(response)

    def unadvertise(self, name: str) -> bool:
        """Serve a service no longer; return whether the client served it."""
        with self._lock:
            service = self._services.pop(name, None)
        if service is not None:
            service.close()
        return service is not None

    def close(self) -> None:
        """End all services; those who wait for answers learn it."""
        with self._lock:
            services, pending = list(self._services.values()), list(self._pending.values())
            self._services.clear()
            self._pending.clear()
        for one in pending:
            one.set_exception(ServiceError("the client that serves it has left"))
        for service in services:
            service.close()
