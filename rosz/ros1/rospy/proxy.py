"""Callers of services, and waiting for services and messages."""

from __future__ import annotations

import threading
import time
from typing import Any

from rosz.errors import (
    ClosedError,
    EncodeError,
    ServiceError,
    ServiceNotFound,
    WaitTimeout,
)
from rosz.node import Client
from rosz.qos import SERVICES
from rosz.ros1.rospy.exceptions import (
    ROSException,
    ROSInterruptException,
)
from rosz.ros1.rospy.msg import args_kwds_to_message, in_words_of_genpy
from rosz.ros1.rospy.names import resolve_name
from rosz.ros1.rospy.service import ServiceEnd, ServiceException
from rosz.ros1.rospy.state import context, helper
from rosz.ros1.rospy.state import is_shutdown as ended
from rosz.session import clamp_timeout
from rosz.time import DurationValue

__all__ = ("ServiceProxy", "wait_for_message", "wait_for_service")

_FOREVER = 30 * 86400.0
"""Seconds that a call may take: rospy knows no limit, and the end of server or node ends it."""

_SLICE = 0.5
_REFUSED = "responded with an error: "
_MISMATCH = "is not available: "
_ENDED = "rospy shutdown"


class ServiceProxy(ServiceEnd):
    """A caller of a service; call it like a function.

    Args:
        name: Name of the service.
        service_class: Its class.
        persistent: Accepted; a call needs no new connection here anyway.
        headers: Accepted; connections here have no headers of their own.

    Raises:
        ValueError: The name is none.
        AttributeError: The class is none of a service.
    """

    def __init__(
        self,
        name: str,
        service_class: type[Any],
        persistent: bool = False,
        headers: dict[str, str] | None = None,
    ) -> None:
        super().__init__(name, service_class)
        self.persistent = persistent
        self._headers = headers
        self._lock = threading.Lock()
        self._client: Client | None = None

    def __call__(self, *args: Any, **kwds: Any) -> Any:
        """Call with a request, or with the values of its fields; see `call`."""
        return self.call(*args, **kwds)

    def call(self, *args: Any, **kwds: Any) -> Any:
        """Send a request and wait for the response.

        Args:
            args: A request, or the values of all its fields.
            kwds: Values of some of its fields by name.

        Raises:
            ServiceException: Nobody serves it, or the server answered with an error.
            EncodeError: A field of the request has a value that does not fit.
            TypeError: The arguments are no request.
        """
        request = args_kwds_to_message(self.request_class, args, kwds)
        if ended():
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
                # Python 3's rospy shows the bytes that came; programs compare with that.
                text = f"service [{name}] {_REFUSED}{text.encode()!r}"
            raise ServiceException(text or str(error)) from error
        except ClosedError as error:
            raise ServiceException(f"service [{name}] returned no response") from error

    def _connected(self) -> Client:
        with self._lock:
            client = self._client
            if client is None or client.closed:
                node = helper()
                client = Client(node, self.resolved_name, self.service_class, SERVICES, _FOREVER)
                self._client = node.keep(client)
            return client

    def wait_for_service(self, timeout: float | DurationValue | None = None) -> None:
        """Wait until somebody serves it; see `wait_for_service`."""
        wait_for_service(self.resolved_name, timeout)

    def close(self) -> None:
        """Let go of the connection; another call makes a new one."""
        with self._lock:
            client, self._client = self._client, None
        if client is not None:
            client.close()


def wait_for_service(service: str, timeout: float | DurationValue | None = None) -> None:
    """Wait until somebody serves a service.

    Args:
        service: Its name.
        timeout: Seconds; forever when not given.

    Raises:
        ROSException: Nobody did in time.
        ValueError: The time is 0.
        UsageError: The time is no number.
        ROSInterruptException: The node was shut down meanwhile.
    """
    if timeout == 0:
        raise ValueError("timeout must be non-zero")
    name = resolve_name(service)
    _check_running()
    deadline = _deadline(timeout)
    while (left := deadline - time.monotonic()) > 0:
        try:
            context().graph.wait_for_service(name, min(left, _SLICE))
        except WaitTimeout:
            continue
        except ClosedError as error:
            raise ROSInterruptException(_ENDED) from error
        return
    raise ROSException(f"timeout exceeded while waiting for service {name}")


def wait_for_message(
    topic: str, topic_type: type[Any], timeout: float | DurationValue | None = None
) -> Any:
    """Return the next message of a topic.

    Args:
        topic: Its name.
        topic_type: Class of its messages.
        timeout: Seconds; forever when not given.

    Raises:
        ROSException: None came in time.
        UsageError: The time is no number.
        ROSInterruptException: The node was shut down meanwhile.
    """
    from rosz.ros1.rospy.topics import Subscriber

    _check_running()
    context()
    found: list[Any] = []
    arrived = threading.Event()

    def take(message: Any) -> None:
        found.append(message)
        arrived.set()

    deadline = _deadline(timeout)
    subscriber = Subscriber(topic, topic_type, take)
    try:
        while not arrived.wait(min(max(deadline - time.monotonic(), 0.0), _SLICE)):
            _check_running()
            if time.monotonic() >= deadline:
                raise ROSException(f"timeout exceeded while waiting for message on topic {topic}")
    finally:
        subscriber.unregister()
    return found[0]


def _deadline(timeout: float | DurationValue | None) -> float:
    if timeout is None:
        return time.monotonic() + _FOREVER
    seconds = timeout.to_sec() if isinstance(timeout, DurationValue) else timeout
    return time.monotonic() + clamp_timeout(seconds)


def _check_running() -> None:
    from rosz.ros1.rospy.core import is_shutdown

    if is_shutdown():
        raise ROSInterruptException(_ENDED)
