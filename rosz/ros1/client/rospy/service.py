"""rospy.service: services and their callers (ROS wiki, rospy/Overview/Services)."""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from rosz.errors import ClosedError, EncodeError, ServiceError, ServiceNotFound, WaitTimeout
from rosz.node import Client, Node
from rosz.node import Service as NodeService
from rosz.qos import SERVICES
from rosz.ros1.client.rospy.core import (
    NO_LIMIT,
    SHUT_DOWN,
    SLICE,
    check_running,
    deadline_of,
    get_node_uri,
    is_shutdown,
)
from rosz.ros1.client.rospy.msg import args_kwds_to_message, encode, in_words_of_genpy
from rosz.ros1.client.rospy.names import resolve_name, resolve_name_without_node_name
from rosz.ros1.exceptions import ROSException, ROSInterruptException
from rosz.ros1.state import context, has_node, state, unnamed_node, when_ready
from rosz.ros1.state import is_shutdown as node_is_shutdown
from rosz.time import DurationValue
from rosz.wire import Kind, format_token, gid

__all__ = ("Service", "ServiceException", "ServiceProxy", "wait_for_service")

# rospy handles each request on a thread of its own, so that handlers may wait for each other.
_THREADS = 1000
_BUFF_SIZE = 65536
_REFUSED = "responded with an error: "
_MISMATCH = "is not available: "

ErrorHandler = Callable[[BaseException, Any, Any, Any], object]


class ServiceException(Exception):
    """A service call failed."""

    __module__ = "rospy.service"


class _ServiceBase:
    """Base class of services and their callers."""

    def __init__(self, name: str, service_class: type[Any]) -> None:
        if not name or not isinstance(name, str):
            raise ValueError("service name is not a non-empty string")
        if not hasattr(service_class, "_request_class"):
            raise AttributeError(
                f"service_class must be the class of a service, got {service_class!r}; it has no"
                " attribute '_request_class'"
            )
        resolve = resolve_name if has_node() else resolve_name_without_node_name
        self.resolved_name = resolve(name)
        self.service_class = service_class
        self.request_class: type[Any] = service_class._request_class
        self.response_class: type[Any] = service_class._response_class


class _Server(NodeService):
    """A server of the node that responds as rospy does."""

    def __init__(self, node: Node, service: Service) -> None:
        self._service = service
        name, kind = service.resolved_name, service.service_class
        super().__init__(node, name, kind, service.handler, SERVICES, _THREADS)

    def respond(self, request: Any, caller: bytes) -> bytes:
        """Return the encoded response to a request; see `rosz.node.Service.respond`."""
        service = self._service
        state.local.delivery = (request, service, caller)
        try:
            response = service.handler(request)
            return encode(convert_return_to_response(response, service.response_class))
        except ServiceException as error:
            raise ServiceError(f"service cannot process request: {error}") from error
        except BaseException as error:  # it must not end the thread
            if service.error_handler is not None:
                service.error_handler(error, type(error), error, error.__traceback__)
            else:
                trace = traceback.format_exception(error)
                self.node.log.error(  # noqa: TRY400  # the text is rospy's
                    "Error processing request: %s\n%s", error, trace
                )
            raise ServiceError(f"error processing request: {error}") from error


def convert_return_to_response(response: Any, response_class: type[Any]) -> Any:
    """Return the response for the value that the handler of a service returned.

    Args:
        response: A response; a list or tuple of all its fields; a dictionary of some of them; or
            the value of its only field.
        response_class: Message class.

    Raises:
        ServiceException: The value does not make a response.
    """
    if isinstance(response, response_class):
        return response
    if response is None:
        raise ServiceException("service handler returned None")
    args, fields, fault = [response], {}, "returned invalid value"
    if isinstance(response, dict):
        args, fields = [], response
    elif isinstance(response, list | tuple):
        args, fault = list(response), "returned wrong number of values"
    try:
        return args_kwds_to_message(response_class, args, fields)
    except (AttributeError, TypeError) as error:
        raise ServiceException(f"handler {fault}: {error}") from error


class Service(_ServiceBase):
    """A service of this node.

    Args:
        name: Name of the service.
        service_class: Class of the service.
        handler: Function of a request that returns a response; or a list, tuple or dictionary of
            its fields; or the value of its only field.
        buff_size: Ignored; there is no such buffer.
        error_handler: Function to call, instead of logging, with an error of the handler: the
            exception, its class, its value and its traceback.

    Raises:
        ValueError: The name is invalid.
        AttributeError: The class is not that of a service.
        ServiceException: This process has a service of this name already.
    """

    def __init__(
        self,
        name: str,
        service_class: type[Any],
        handler: Callable[[Any], Any],
        buff_size: int = _BUFF_SIZE,
        error_handler: ErrorHandler | None = None,
    ) -> None:
        super().__init__(name, service_class)
        self.handler = handler
        self.buff_size = buff_size
        self.error_handler = error_handler
        self._shut_down = threading.Event()
        self._service: _Server | None = None
        with state.lock:
            if self.resolved_name in state.services:
                raise ServiceException(f"service [{self.resolved_name}] already registered")
            state.services[self.resolved_name] = self
        when_ready(self._open)

    @property
    def uri(self) -> str | None:
        """The URI of the node, as ``lookupService`` gives it; None before ``init_node``."""
        return get_node_uri()

    def _open(self, node: Node) -> None:
        if not self._shut_down.is_set():
            self._service = node.keep(_Server(node, self))

    def connection_header(self, caller: bytes, timeout: float = 0.0) -> dict[str, str]:
        """Return the connection header of a request of a client's GID, in the terms of rospy.

        A request may precede the client's token, which is waited for up to ``timeout`` seconds.
        """
        name = self._name_of(caller)
        service = self._service
        if not name and timeout and service is not None:
            with suppress(WaitTimeout, ClosedError):
                service.others.wait_for(
                    lambda _: bool(self._name_of(caller)), timeout, "the caller"
                )
            name = self._name_of(caller)
        return {
            "callerid": name,
            "md5sum": self.service_class._md5sum,
            "service": self.resolved_name,
            "type": self.service_class._type,
        }

    def _name_of(self, caller: bytes) -> str:
        """Return the name of the node of a client; empty while it is unknown."""
        if self._service is None:
            return ""
        clients = self._service.others.view().clients(self.resolved_name)
        names = (token.node_name for token in clients if gid(format_token(token)) == caller)
        return next(names, "")

    def shutdown(self, reason: str = "") -> None:
        """Shut the service down; again is not an error.

        Args:
            reason: Ignored.
        """
        del reason
        self._shut_down.set()
        with state.lock:
            if state.services.get(self.resolved_name) is self:
                del state.services[self.resolved_name]
        if self._service is not None:
            self._service.close()

    def spin(self) -> None:
        """Wait until the service or the node is shut down."""
        while not is_shutdown() and not self._shut_down.wait(SLICE):
            pass


class ServiceProxy(_ServiceBase):
    """A caller of a service, which is called like a function; errors are those of `Service`.

    Args:
        name: As for `Service`, as is ``service_class``.
        persistent: Ignored; a call never makes a new connection.
        headers: Ignored; connections do not have headers of their own.
    """

    def __init__(
        self,
        name: str,
        service_class: type[Any],
        persistent: bool = False,
        headers: dict[str, str] | None = None,  # noqa: ARG002  # rospy's signature
    ) -> None:
        super().__init__(name, service_class)
        self.persistent = persistent
        self._lock = threading.Lock()
        self._client: Client | None = None

    def __call__(self, *args: Any, **kwds: Any) -> Any:
        """Call the service; see `call`."""
        return self.call(*args, **kwds)

    def call(self, *args: Any, **kwds: Any) -> Any:
        """Send a request and wait for the response.

        Args:
            args: A request, or the values of all its fields.
            kwds: Values of some of its fields by name.

        Raises:
            ServiceException: No node serves it, or the server responded with an error.
            EncodeError: A value does not fit its field in the request.
            TypeError: The arguments do not make a request.
        """
        request = args_kwds_to_message(self.request_class, args, kwds)
        if node_is_shutdown():
            raise ServiceException(f"service [{self.resolved_name}] unavailable")
        name = self.resolved_name
        try:
            return self._connected().call(request)
        except EncodeError as error:
            raise in_words_of_genpy(request, error) from error
        except ServiceNotFound as error:
            _, other, why = str(error).partition(_MISMATCH)
            text = (
                f"unable to connect to service: {why}" if other else f"service [{name}] unavailable"
            )
            raise ServiceException(text) from error
        except ServiceError as error:
            _, refused, text = str(error).partition(_REFUSED)
            if refused:
                # As in rospy under Python 3, which shows the bytes; programs compare with it.
                text = f"service [{name}] {_REFUSED}{text.encode()!r}"
            raise ServiceException(text or str(error)) from error
        except ClosedError as error:
            raise ServiceException(f"service [{name}] returned no response") from error

    def _connected(self) -> Client:
        with self._lock:
            client = self._client
            if client is None or client.closed:
                node = unnamed_node()
                client = Client(node, self.resolved_name, self.service_class, SERVICES, NO_LIMIT)
                self._client = node.keep(client)
            return client

    def wait_for_service(self, timeout: float | DurationValue | None = None) -> None:
        """Wait until a node serves it; see `wait_for_service`."""
        wait_for_service(self.resolved_name, timeout)

    def close(self) -> None:
        """Close the connection; another call opens a new one."""
        with self._lock:
            client, self._client = self._client, None
        if client is not None:
            client.close()


def wait_for_service(service: str, timeout: float | DurationValue | None = None) -> None:
    """Wait until a node serves a service.

    Args:
        service: Name of the service.
        timeout: Time limit in seconds; no limit when not given.

    Raises:
        ROSException: No node served it in time.
        ValueError: The timeout is 0.
        UsageError: The timeout is not a number.
        ROSInterruptException: The node was shut down.
    """
    if timeout == 0:
        raise ValueError("timeout must be non-zero")
    name = resolve_name(service)
    check_running()
    deadline = deadline_of(timeout)
    try:
        with context().graph.follow_entities(Kind.SERVICE, name) as servers:
            while (left := deadline - time.monotonic()) > 0:
                with suppress(WaitTimeout):
                    servers.wait_for(lambda view: bool(view.servers(name)), min(left, SLICE), name)
                    return
    except ClosedError as error:
        raise ROSInterruptException(SHUT_DOWN) from error
    raise ROSException(f"timeout exceeded while waiting for service {name}")
