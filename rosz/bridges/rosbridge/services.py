"""Services: clients call those of the network, and serve some themselves."""

from __future__ import annotations

import itertools
import threading
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout
from functools import partial
from typing import Any

from rosz.bridges.clients import build
from rosz.bridges.rosbridge import operations as ops
from rosz.bridges.rosbridge.plain import Spelling, converter
from rosz.bridges.rosbridge.state import ClientState, Served
from rosz.errors import NotFoundError, RoszError, ServiceError, UsageError, near_miss
from rosz.node import Client, Service
from rosz.node.ros2 import request_type

_ANSWER_SECONDS = 60.0
"""Seconds that a client has to answer a call of a service that it serves."""


class ServiceCalls:
    """The services that one client calls."""

    def __init__(self, state: ClientState) -> None:
        self._state = state
        self._shared = state.shared
        self._node = state.shared.node
        self._lock = threading.Lock()
        self._clients: dict[str, Client] = {}

    def call(self, operation: ops.CallServiceOperation) -> None:
        """Call a service, soon."""
        spelling = self._state.spelling_of(operation.type)
        name = self._node.resolve(operation.service)
        try:
            self._state.later(partial(self._call, name, operation, spelling))
        except UsageError as error:
            self._respond(operation, str(error), done=False)

    def _call(self, name: str, operation: ops.CallServiceOperation, spelling: Spelling) -> None:
        shared = self._shared
        try:
            if shared.rosapi.has(name):
                values = shared.rosapi.call(name, operation.args, shared.policy, spelling)
            else:
                shared.policy.check("call", name)
                client = self._client(name)
                kind, now = client.service_type.Request, self._node.now()
                response = client.call(build(kind, operation.args or None, now), operation.timeout)
                values = converter(type(response), spelling)(response)
        except RoszError as error:
            self._respond(operation, str(error), done=False)
        else:
            self._respond(operation, values, done=True)

    def _client(self, name: str) -> Client:
        """Return the client of a service."""
        with self._lock:
            client = self._clients.get(name)
        if client is not None and client.served:
            return client
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

    def _respond(self, operation: ops.CallServiceOperation, values: Any, *, done: bool) -> None:
        response: dict[str, Any] = {"op": "service_response", "service": operation.service}
        if operation.id is not None:
            response["id"] = operation.id
        response |= {"values": values, "result": done}
        self._state.send(response, fragment_size=operation.fragment_size)

    def close(self) -> None:
        """End all clients of services."""
        with self._lock:
            clients = list(self._clients.values())
            self._clients.clear()
        for client in clients:
            client.close()


class ServedServices(Served[Service]):
    """The services that one client serves."""

    def __init__(self, state: ClientState) -> None:
        super().__init__(state)
        self._numbers = itertools.count(1)
        self._pending: dict[str, Future[ops.ServiceResponse]] = {}

    def advertise(self, operation: ops.AdvertiseService) -> None:
        """Serve a service with the answers of the client.

        Raises:
            RoszError: The client may not, or the type does not exist.
        """
        spelling = self._state.spelling_of(operation.type)
        name = self._node.resolve(operation.service)
        self._check(name)
        kind = self._node.context.types.service(operation.type)

        def handle(request: Any) -> Any:
            return self._query(name, operation.type, kind, request, spelling)

        self._end_server(name)
        service = self._node.service(name, kind, handle)
        with self._lock:
            self._servers[name] = service

    def _query(self, name: str, type_name: str, kind: Any, request: Any, spelling: Spelling) -> Any:
        number = f"service_request:{name}:{next(self._numbers)}"
        pending: Future[ops.ServiceResponse] = Future()
        with self._lock:
            self._pending[number] = pending
        try:
            args = converter(kind.Request, spelling)(request)
            call = {"op": "call_service", "id": number, "service": name, "type": type_name}
            self._state.send({**call, "args": args})
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

    def respond(self, response: ops.ServiceResponse) -> None:
        """Take the answer of the client to a call.

        Raises:
            UsageError: Nobody waits for it.
        """
        with self._lock:
            pending = self._pending.pop(str(response.id), None)
        if pending is None:
            raise UsageError(f"service_response: no call with the id '{response.id}' waits")
        pending.set_result(response)

    def unadvertise(self, operation: ops.UnadvertiseService) -> None:
        """Serve a service no longer."""
        self._withdraw(operation, operation.service)

    def close(self) -> None:
        """End all services; those who wait for answers learn it."""
        with self._lock:
            services, pending = list(self._servers.values()), list(self._pending.values())
            self._servers.clear()
            self._pending.clear()
        for answer in pending:
            answer.set_exception(ServiceError("the client that serves it has left"))
        for service in services:
            service.close()
