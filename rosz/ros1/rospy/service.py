"""Services by rospy's names (ROS wiki, rospy/Overview/Services)."""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable
from typing import Any

from rosz.node import Node
from rosz.node import Service as NodeService
from rosz.node.service import Refusal
from rosz.qos import SERVICES
from rosz.ros1.rospy.absent import attribute
from rosz.ros1.rospy.msg import args_kwds_to_message, encode
from rosz.ros1.rospy.names import resolve_name, resolve_name_without_node_name
from rosz.ros1.rospy.state import has_node, state, when_ready
from rosz.wire import format_token, gid

__all__ = ("Service", "ServiceException")

_THREADS = 1000
_BUFF_SIZE = 65536
_CALLER_SHOWS_BY = 1.0
"""Seconds in which the graph gets to know a client whose first request overtook the news of it."""
_LOOK_AGAIN = 0.01

ErrorHandler = Callable[[BaseException, Any, Any, Any], object]


class ServiceException(Exception):
    """A service call that failed."""

    __module__ = "rospy.service"


class ServiceEnd:
    """What services and their callers have in common.

    Args:
        name: Name of the service.
        service_class: Its class.

    Attributes:
        resolved_name: The global name.
        request_class: Class of its requests.
        response_class: Class of its responses.

    Raises:
        ValueError: The name is none.
        AttributeError: The class is none of a service.
    """

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
    """A server that tells who calls.

    Args:
        node: Its node.
        service: Whom it tells.
    """

    def __init__(self, node: Node, service: Service) -> None:
        self._service = service
        name, kind = service.resolved_name, service.service_class
        super().__init__(node, name, kind, service.handler, SERVICES, _THREADS)

    def handle(self, request: Any, caller: bytes) -> Any:
        """Have a request answered."""
        return self._service.answer(request, caller)


class Service(ServiceEnd):
    """A service of this node.

    Args:
        name: Name of the service.
        service_class: Its class.
        handler: Gets a request, and returns a response, or what makes one: a list, tuple or
            dictionary of its fields, or the value of its only one.
        buff_size: Accepted; no buffer has to be large enough for a request here.
        error_handler: Told instead of the log of what the handler raises: exception, class, value
            and traceback.

    Raises:
        ValueError: The name is none.
        AttributeError: The class is none of a service.
        ServiceException: This process has a service of that name.
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
        self._over = threading.Event()
        self._service: _Server | None = None
        with state.lock:
            if self.resolved_name in state.services:
                raise ServiceException(f"service [{self.resolved_name}] already registered")
            state.services[self.resolved_name] = self
        when_ready(self._open)

    def _open(self, node: Node) -> None:
        if not self._over.is_set():
            self._service = node.keep(_Server(node, self))

    def connection_header(self, caller: bytes) -> dict[str, str]:
        """Return what rospy calls the header of the connection that a request came on.

        Args:
            caller: Gid of the client.
        """
        deadline = time.monotonic() + _CALLER_SHOWS_BY
        while not (name := self._name_of(caller)) and time.monotonic() < deadline:
            time.sleep(_LOOK_AGAIN)
        return {
            "callerid": name,
            "md5sum": self.service_class._md5sum,
            "service": self.resolved_name,
            "type": self.service_class._type,
        }

    def _name_of(self, caller: bytes) -> str:
        """Return the name of the node that a client belongs to; empty while it is not known."""
        if self._service is None:
            return ""
        known = self._service.node.context.graph.view().clients(self.resolved_name)
        names = (token.node_name for token in known if gid(format_token(token)) == caller)
        return next(names, "")

    def answer(self, request: Any, caller: bytes) -> Any:
        """Return the response to a request.

        Args:
            request: The request.
            caller: Gid of the client.

        Raises:
            Refusal: There is none; the text is for the caller.
        """
        state.local.delivery = (request, self, caller)
        try:
            response = self._response(self.handler(request))
            encode(response)
        except ServiceException as error:
            raise Refusal(f"service cannot process request: {error}") from error
        except Exception as error:
            self._tell(error)
            raise Refusal(f"error processing request: {error}") from error
        return response

    def _response(self, value: Any) -> Any:
        kind = self.response_class
        if isinstance(value, kind):
            return value
        if value is None:
            raise ServiceException("service handler returned None")
        if isinstance(value, dict):
            args, fields, fault = [], value, "returned invalid value"
        elif isinstance(value, list | tuple):
            args, fields, fault = list(value), {}, "returned wrong number of values"
        else:
            args, fields, fault = [value], {}, "returned invalid value"
        try:
            return args_kwds_to_message(kind, args, fields)
        except (AttributeError, TypeError) as error:
            raise ServiceException(f"handler {fault}: {error}") from error

    def _tell(self, error: Exception) -> None:
        if self.error_handler is not None:
            self.error_handler(error, type(error), error, error.__traceback__)
        elif state.node is not None:
            trace = traceback.format_exception(error)
            state.node.log.error("Error processing request: %s\n%s", error, trace)

    def shutdown(self, reason: str = "") -> None:
        """End the service; again is no error.

        Args:
            reason: Why, for the log.
        """
        del reason
        self._over.set()
        with state.lock:
            if state.services.get(self.resolved_name) is self:
                del state.services[self.resolved_name]
        if self._service is not None:
            self._service.close()

    def spin(self) -> None:
        """Wait until the service or the node ends."""
        from rosz.ros1.rospy.core import is_shutdown

        while not is_shutdown() and not self._over.wait(0.5):
            pass


__getattr__ = attribute(__name__)
