"""Service clients."""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
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
from rosz.node.core import NodeCore
from rosz.node.entity import Entity, Introspect
from rosz.node.incompatible import explain_incompatible
from rosz.qos import QoS
from rosz.session import Cancellation, Reply, clamp_timeout
from rosz.wire import Kind, Token, is_rosz_id, pack_attachment

if TYPE_CHECKING:
    from rosz.graph import View
    from rosz.message import Message
    from rosz.message import Service as ServiceType

_ATTEMPTS = 10
_PAUSE = 0.02
"""Seconds between attempts: the route to a server comes up some milliseconds after its token."""
_AT_ONCE = 0.01
"""Seconds within which a query that reaches nobody ends."""

_SAME = 0.001
"""Seconds by which a timeout may differ from that of the declared querier."""

_GRACE = 1.0
"""Seconds to wait for a server that the graph does not show yet."""

_ANY_NUMBER = 1 << 30
_TAKEN_AT_ONCE = "/_action/get_result"
"""The service whose requests wait elsewhere, until the goal has ended."""
_DEFAULT_DEPTH = 10
"""The number of requests that wait at a server of ROS 2, if its token does not tell."""


class Client(Entity):
    """Call a service; see `rosz.Node.client`. Any number of threads may call at once.

    A server of ROS 2 drops the oldest request when more of them wait than the depth of its QoS. So
    no more calls than that are on their way to one at any time; others wait for their turn.

    Attributes:
        introspect: Function called with each request that is sent, and each response received.
    """

    def __init__(
        self, node: NodeCore, name: str, service_type: type[ServiceType], qos: QoS, timeout: float
    ) -> None:
        super().__init__(
            node, Kind.CLIENT, name, service_type._type_name, service_type._type_hash, qos
        )
        self.service_type = service_type
        self.timeout: float = clamp_timeout(timeout)
        self._decode = node.context.decoder(service_type.Response)
        self._numbers = itertools.count(1)
        self._cancel = Cancellation()
        self._known: tuple[View | None, bool, int] = None, False, _ANY_NUMBER
        self._on_their_way = 0
        self._turn = threading.Condition()
        self.introspect: Introspect | None = None
        self._querier = self.keep(
            node.context.session.querier(self.key, timeout=self.timeout, target="all_complete")
        )
        self.announce()

    def __call__(self, *args: Any, timeout: float | None = None, **fields: Any) -> Any:
        """Call with a request, or with the values of its fields; see `call`."""
        request_type = self.service_type.Request
        if len(args) == 1 and not fields and isinstance(args[0], request_type):
            return self.call(args[0], timeout)
        try:
            request = request_type(*args, **fields)
        except TypeError as error:
            raise EncodeError(request_type._type, "", str(error)) from error
        return self.call(request, timeout)

    def call(self, request: Message, timeout: float | None = None) -> Any:
        """Send a request and wait for the response.

        Args:
            request: An instance of the service's request type.
            timeout: Time limit in seconds; the client's own when not given.

        Returns:
            The response, an instance of the service's response type.

        Raises:
            EncodeError: A field of the request has a value that does not fit.
            ServiceNotFound: No node serves the service.
            ServiceError: The server responded with an error, dropped the request, or ended before
                it responded. All servers get the request, and the first response counts.
            WaitTimeout: No response came in time.
            ClosedError: The client or its context was closed meanwhile.
            UsageError: The timeout is not a number.
        """
        limit = self.timeout if timeout is None else clamp_timeout(timeout)
        deadline = time.monotonic() + limit
        payload, number = self.service_type.Request._encode(request), next(self._numbers)
        if not self.served:
            self._find_server(limit)
        with self._taking_turns(deadline, limit):
            if self.introspect is not None:
                self.introspect("REQUEST_SENT", self.gid, number, request)
            for _ in range(_ATTEMPTS):
                began = time.monotonic()
                reply = self._attempt(payload, number, deadline, limit)
                if reply is not None:
                    response = self._response(reply, limit)
                    if self.introspect is not None:
                        self.introspect("RESPONSE_RECEIVED", self.gid, number, response)
                    return response
                # The query reached nobody: the route to a server may come a moment after its token.
                # A server that got the request and then ended may have done the work: it does not
                # get the request again.
                if time.monotonic() - began > _AT_ONCE or not self.served:
                    break
                time.sleep(_PAUSE)
        raise ServiceError(f"service [{self.name}]: {self._why_no_answer()}")

    @contextmanager
    def _taking_turns(self, deadline: float, limit: float) -> Iterator[None]:
        """Return a context for one call, which begins when the servers have room for it."""
        with self._turn:
            while self._on_their_way >= self._known[2]:
                left = deadline - time.monotonic()
                if left <= 0 or not self._turn.wait(left):
                    raise self._late(limit)
                self.check_open("call")
            self._on_their_way += 1
        try:
            yield
        finally:
            with self._turn:
                self._on_their_way -= 1
                self._turn.notify()

    def _why_no_answer(self) -> str:
        view = self.others.view()
        for server in view.servers(self.name):
            if self.matches(server) and not is_rosz_id(server.zid):
                return (
                    f"{server.node_name} dropped the request unanswered: it keeps the newest"
                    f" {_room(server)} that wait, and other clients have sent more; call again"
                )
        return "the server ended before it answered"

    def _attempt(self, payload: bytes, number: int, deadline: float, limit: float) -> Reply | None:
        """Send the request once; ``None`` if the query ended without a reply."""
        left = deadline - time.monotonic()
        if left <= 0:
            raise self._late(limit)
        self.check_open("call")
        attachment = pack_attachment(number, time.time_ns(), self.gid)
        if abs(self._querier.timeout - left) < _SAME:
            replies = self._querier.query(payload, attachment, self._cancel)
        else:
            replies = self.node.context.session.query(
                self.key,
                timeout=left,
                payload=payload,
                attachment=attachment,
                target="all_complete",
                cancel=self._cancel,
            )
        first = replies.receive()
        if first is None and self.closed:
            raise ClosedError(f"the call of '{self.name}' was cancelled: shutting down")
        return first

    def _response(self, reply: Reply, limit: float) -> Message:
        if not reply.ok:
            text = reply.payload.decode(errors="replace")
            if text == "Timeout":
                raise self._late(limit)
            raise ServiceError(f"service [{self.name}] responded with an error: {text}")
        try:
            response: Message = self._decode(reply.payload)
        except DecodeError as error:
            raise ServiceError(f"service [{self.name}] sent a damaged response: {error}") from error
        return response

    def _late(self, limit: float) -> WaitTimeout:
        servers = [token.zid for token in self.others.view().servers(self.name)]
        stopped = self.node.context.session.why_silent(*servers)
        hint = "the server is busy, stopped or out of reach"
        return WaitTimeout(
            f"answer of service '{self.name}'", limit, f"{hint}; {stopped}" if stopped else hint
        )

    @property
    def served(self) -> bool:
        """Whether a node serves the service with this type, as far as it is known."""
        # Each view is looked at once.
        view = self.others.view()
        seen, served, _ = self._known
        if seen is not view:
            servers = [*filter(self.matches, view.servers(self.name))]
            served = bool(servers)
            self._known = view, served, min(map(_room, servers), default=_ANY_NUMBER)
        return served

    def _find_server(self, limit: float) -> None:
        """Make sure that the service is served, waiting while the process is still joining."""
        self.check_open("call")
        context = self.node.context
        context.mesh.ready.wait(min(limit, _GRACE))
        if self.served:
            return
        view = self.others.refresh(min(limit, _GRACE))
        if not any(map(self.matches, view.servers(self.name))):
            why = self._why_not_served() or "; nobody serves that name"
            raise ServiceNotFound(f"service [{self.name}] is not available{why}")

    def _why_not_served(self) -> str:
        """Return the end of an error text, with its ``: `` or ``; ``; empty if nothing is known."""
        view = self.node.context.graph.refresh(_GRACE)
        others = view.servers(self.name)
        if others:
            return f": {explain_incompatible(self.token, others[0])}"
        return near_miss(self.name, view.services())

    def wait_for_service(self, timeout: float = 10.0) -> None:
        """Wait until a node serves the service with this type.

        Args:
            timeout: Time limit in seconds.

        Raises:
            WaitTimeout: No node did in time.
            ClosedError: The client is closed, or the context was shut down meanwhile.
            UsageError: The timeout is not a number.
        """
        self.check_open("wait")
        what = f"service '{self.name}' of type '{self.token.type_name}'"
        try:
            self.others.wait_for(
                lambda view: any(map(self.matches, view.servers(self.name))), timeout, what
            )
        except WaitTimeout as error:
            why = self._why_not_served()
            raise WaitTimeout(what, timeout, why[2:]) from error

    def _finish(self) -> None:
        self._cancel.cancel()
        with self._turn:
            self._turn.notify_all()


def _room(server: Token) -> int:
    """Return the number of requests that may wait at a server before it drops any."""
    if is_rosz_id(server.zid) or server.name.endswith(_TAKEN_AT_ONCE):
        return _ANY_NUMBER
    if server.qos is None:
        return _DEFAULT_DEPTH
    return _ANY_NUMBER if server.qos.history == "keep_all" else server.qos.depth
