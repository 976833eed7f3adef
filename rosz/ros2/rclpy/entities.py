"""rclpy.publisher, .subscription, .service, .client and .timer: the entities of a node."""

from __future__ import annotations

import inspect
import threading
from collections import deque
from collections.abc import Callable
from enum import IntEnum
from typing import Any

from rosz.errors import ServiceError, WaitTimeout
from rosz.message import Message
from rosz.message import Service as ServiceType
from rosz.msgs.service_msgs.msg import ServiceEventInfo
from rosz.node import Client as RoszClient
from rosz.node import Clock as RoszClock
from rosz.node import MessageInfo
from rosz.node import Node as RoszNode
from rosz.node import Publisher as RoszPublisher
from rosz.node import Service as RoszService
from rosz.node import Subscription as RoszSubscription
from rosz.node import Timer as RoszTimer
from rosz.node.ros2 import event_class
from rosz.qos import QoS
from rosz.ros2.rclpy.events import EventHandler, SubscriptionEventCallbacks, handlers_of
from rosz.ros2.rclpy.executors import CallbackGroup, Future, completed, in_background
from rosz.ros2.rclpy.qos import QoSProfile, to_qos
from rosz.ros2.rclpy.time import Clock
from rosz.session import LONGEST_WAIT

_CHECK_PERIOD = 0.5
"""Seconds after which a waiting service call checks whether the node has ended."""


class Publisher:
    """Publish messages on a topic; made by ``Node.create_publisher``."""

    def __init__(
        self, publisher: RoszPublisher[Any], qos_profile: Any, events: dict[str, EventHandler]
    ) -> None:
        self._publisher = publisher
        self.msg_type: type[Any] = publisher.message_type
        self.qos_profile: Any = qos_profile
        self.event_handlers: list[EventHandler] = list(events.values())

    def publish(self, msg: Any) -> None:
        """Publish a message, or the bytes of an encoded one.

        Raises:
            EncodeError: A field has a value that does not fit.
            ClosedError: The publisher is destroyed, or its context is shut down.
        """
        if isinstance(msg, bytes):
            self._publisher.publish_raw(msg)
        else:
            self._publisher.publish(msg)

    @property
    def topic(self) -> str:
        """Full name of the topic."""
        return self._publisher.name

    topic_name = topic

    def get_subscription_count(self) -> int:
        """Return the number of subscriptions that receive the messages."""
        return len(self._publisher.subscribers())

    def wait_for_all_acked(self, timeout: Any = None) -> bool:  # noqa: ARG002  # rclpy's
        """Return True: subscriptions of Zenoh do not acknowledge, as with rmw_zenoh."""
        return True

    def assert_liveliness(self) -> None:
        """Do nothing: the liveliness of a process is that of its session."""

    def destroy(self) -> None:
        """Close the publisher."""
        self._publisher.close()


class Subscription:
    """Receive messages of a topic; made by ``Node.create_subscription``.

    Messages wait in a queue of the profile's depth until an executor spins; when it is full, a new
    message replaces the oldest one.
    """

    def __init__(
        self,
        node: RoszNode,
        topic: str,
        msg_type: type[Message],
        callback: Callable[..., Any],
        qos: QoS,
        *,
        raw: bool,
        group: CallbackGroup,
        wake: Callable[[], None],
    ) -> None:
        self.msg_type: type[Any] = msg_type
        self.callback: Callable[..., Any] = callback
        self.callback_group: CallbackGroup = group
        self._wake = wake
        depth = None if qos.history == "keep_all" else max(qos.depth, 1)
        self._queue: deque[Any] = deque(maxlen=depth)
        self._with_info = _takes_info(callback)
        self._lost: EventHandler | None = None
        self._subscription: RoszSubscription[Any] = node.subscription(
            topic, msg_type, self._receive, qos=qos, raw=raw, with_info=True
        )
        self.event_handlers: list[EventHandler] = []

    def follow(self, callbacks: SubscriptionEventCallbacks | None) -> None:
        """Call functions for the events of the subscription.

        Raises:
            UnsupportedEventTypeError: There is no such event.
        """
        handlers = handlers_of(self._subscription, callbacks, self.callback_group, self._wake)
        self._lost = handlers.get("message_lost")
        self.event_handlers = list(handlers.values())

    def _receive(self, message: Any, info: MessageInfo) -> None:
        if info.lost and self._lost is not None:
            self._lost.count(info.lost)
        self._queue.append((message, info))
        self._wake()

    def take(self) -> Callable[[], Any] | None:
        """Return a function that handles the oldest message; None if there is none."""
        try:
            message, info = self._queue.popleft()
        except IndexError:
            return None
        if self._with_info:
            return lambda: self.callback(message, _ros2_info(info))
        return lambda: self.callback(message)

    @property
    def topic_name(self) -> str:
        """Full name of the topic."""
        return self._subscription.name

    def get_publisher_count(self) -> int:
        """Return the number of publishers that the subscription receives from."""
        return len(self._subscription.publishers())

    def destroy(self) -> None:
        """Close the subscription."""
        self._subscription.close()
        self._queue.clear()


def _takes_info(callback: Callable[..., Any]) -> bool:
    """Return whether a callback takes a message and its info, and not the message alone."""
    try:
        signature = inspect.signature(callback)
    except ValueError:  # a function of C
        return False
    try:
        signature.bind(None)
    except TypeError:
        return True
    return False


def _ros2_info(info: MessageInfo) -> dict[str, Any]:
    """Return the info of a message with rclpy's keys; times are in nanoseconds."""
    return {
        "source_timestamp": info.source_time,
        "received_timestamp": info.reception_time,
        "publication_sequence_number": info.sequence,
        "reception_sequence_number": None,
    }


class ServiceIntrospectionState(IntEnum):
    """The content of the events of a service: no events, only the metadata, or the messages too."""

    OFF = 0
    METADATA = 1
    CONTENTS = 2


class ServiceEvents:
    """The events of a service that one of its ends publishes, on its topic ``_service_event``."""

    def __init__(self, node: RoszNode, end: RoszService | RoszClient) -> None:
        self._node = node
        self._end = end
        self._publisher: RoszPublisher[Any] | None = None

    def configure_introspection(
        self,
        clock: Clock,
        service_event_qos_profile: QoSProfile | int,
        introspection_state: ServiceIntrospectionState,
    ) -> None:
        """Begin or end publishing the events of the service that this end sees.

        Args:
            clock: Clock for the times of the events.
            service_event_qos_profile: Profile of the publisher, or depth of its queue.
            introspection_state: The content of the events.
        """
        self._end.introspect = None
        if self._publisher is not None:
            self._publisher.close()
            self._publisher = None
        if introspection_state == ServiceIntrospectionState.OFF:
            return
        event = event_class(self._node.context.types, self._end.service_type._type_name)
        topic, qos = f"{self._end.name}/_service_event", to_qos(service_event_qos_profile)
        self._publisher = publisher = self._node.publisher(topic, event, qos=qos)

        def publish(name: str, gid: bytes, number: int, message: Any) -> None:
            stamp = clock.now().to_msg()
            info = ServiceEventInfo(getattr(ServiceEventInfo, name), stamp, gid, number)
            given = [message] if introspection_state == ServiceIntrospectionState.CONTENTS else []
            publisher.publish(event(info, **{name.partition("_")[0].lower(): given}))

        self._end.introspect = publish

    @property
    def srv_name(self) -> str:
        """Full name of the service."""
        return self._end.name

    service_name = srv_name

    def destroy(self) -> None:
        """Close this end of the service."""
        self._end.close()
        if self._publisher is not None:
            self._publisher.close()


class _Call:
    """A service call that waits for an executor."""

    def __init__(self, request: Any) -> None:
        self.request = request
        self.finished = threading.Event()
        self.response: Any = None
        self.error: BaseException | None = None


class Service(ServiceEvents):
    """Serve a service; made by ``Node.create_service``."""

    def __init__(
        self,
        node: RoszNode,
        srv_name: str,
        srv_type: type[ServiceType],
        callback: Callable[[Any, Any], Any],
        *,
        group: CallbackGroup,
        wake: Callable[[], None],
    ) -> None:
        self.srv_type: type[Any] = srv_type
        self.callback: Callable[[Any, Any], Any] = callback
        self.callback_group: CallbackGroup = group
        self._wake = wake
        self._calls: deque[_Call] = deque()
        self._service = node.service(srv_name, srv_type, self._serve)
        super().__init__(node, self._service)

    def _serve(self, request: Any) -> Any:
        """Queue a call for the executor, and wait for the response."""
        call = _Call(request)
        self._calls.append(call)
        self._wake()
        while not call.finished.wait(_CHECK_PERIOD):
            if self._service.closed or self._node.is_shutdown:
                raise ServiceError("the server ended before it answered")
        if call.error is not None:
            raise ServiceError(f"{type(call.error).__name__}: {call.error}") from call.error
        return call.response

    def take(self) -> Callable[[], Any] | None:
        """Return a function that responds to the oldest call; None if there is none."""
        try:
            call = self._calls.popleft()
        except IndexError:
            return None
        return lambda: self._respond(call)

    async def _respond(self, call: _Call) -> None:
        try:
            call.response = await completed(self.callback(call.request, self.srv_type.Response()))
        except BaseException as error:
            call.error = error
            raise
        finally:
            call.finished.set()


class Client(ServiceEvents):
    """Call a service; made by ``Node.create_client``."""

    def __init__(
        self,
        node: RoszNode,
        srv_name: str,
        srv_type: type[ServiceType],
        *,
        call_soon: Callable[[Callable[[], object]], None],
    ) -> None:
        self.srv_type: type[Any] = srv_type
        self._client = node.client(srv_name, srv_type, timeout=LONGEST_WAIT)
        super().__init__(node, self._client)
        self._call_soon = call_soon

    def call(self, request: Any, timeout_sec: float | None = None) -> Any:
        """Call the service, and wait for the response.

        A callback must not call a service whose server is spun by the same executor.

        Args:
            request: Instance of the request type of the service.
            timeout_sec: Time limit in seconds; none when not given.

        Raises:
            ServiceError: No node serves the service, or the server responded with an error.
            WaitTimeout: No response came in time.
        """
        return self._client.call(request, timeout_sec)

    def call_async(self, request: Any) -> Future:
        """Call the service without waiting; a call waits for a server that is not there yet.

        Args:
            request: Instance of the request type of the service.

        Returns:
            A future that is done, while the node is spun, when the response has come.
        """

        def call() -> Any:
            self._client.wait_for_service(LONGEST_WAIT)
            return self._client.call(request)

        return in_background(f"rosz-call{self.srv_name}", call, self._call_soon)

    def remove_pending_request(self, future: Future) -> None:
        """Cancel a call; a response that comes later is ignored."""
        future.cancel()

    def service_is_ready(self) -> bool:
        """Return whether a node serves the service."""
        return self._client.served

    def wait_for_service(self, timeout_sec: float | None = None) -> bool:
        """Wait until a node serves the service; return whether one does.

        Args:
            timeout_sec: Time limit in seconds; none when not given.
        """
        try:
            self._client.wait_for_service(LONGEST_WAIT if timeout_sec is None else timeout_sec)
        except WaitTimeout:
            return False
        return True


class Timer:
    """Call a function periodically; made by ``Node.create_timer``.

    Periods that pass while no executor spins are skipped: one call follows, not many.
    """

    def __init__(
        self,
        period_ns: int,
        callback: Callable[[], Any] | None,
        source: RoszClock,
        *,
        clock: Clock,
        group: CallbackGroup,
        wake: Callable[[], None],
        report: Callable[[str, BaseException], None],
        autostart: bool = True,
    ) -> None:
        self.callback: Callable[[], Any] | None = callback
        self.callback_group: CallbackGroup = group
        self.clock: Clock = clock
        self._source = source.branch()
        self._period = period_ns
        self._wake = wake
        self._report = report
        self._due = False
        self._last = self._source.steady()
        self._timer: RoszTimer | None = None
        if autostart:
            self.reset()

    @property
    def timer_period_ns(self) -> int:
        """Period in nanoseconds."""
        return self._period

    @timer_period_ns.setter
    def timer_period_ns(self, value: int) -> None:
        self._period = int(value)
        if self._timer is not None:
            self.reset()

    def reset(self) -> None:
        """Start the period anew; this also restarts a cancelled timer."""
        self.cancel()
        self._last = self._source.steady()
        self._timer = RoszTimer(
            self._period, lambda _: self._tick(), self._source, on_error=self._report, reset=True
        )

    def cancel(self) -> None:
        """Stop the timer until `reset`."""
        self._due = False
        if self._timer is not None:
            self._timer.close()
            self._timer = None

    def is_canceled(self) -> bool:
        """Return whether the timer is cancelled."""
        return self._timer is None

    def is_ready(self) -> bool:
        """Return whether a call is due."""
        return self._due

    def time_since_last_call(self) -> int:
        """Return the nanoseconds since the last call, or since the timer was started."""
        return self._source.steady() - self._last

    def time_until_next_call(self) -> int | None:
        """Return the nanoseconds until the next call is due; None when cancelled."""
        return None if self._timer is None else self._period - self.time_since_last_call()

    def _tick(self) -> None:
        self._due = True
        self._wake()

    def take(self) -> Callable[[], Any] | None:
        """Return the callback if it is due."""
        if not self._due:
            return None
        self._due = False
        self._last = self._source.steady()
        return self.callback

    def destroy(self) -> None:
        """Close the timer."""
        self.cancel()
        self._source.close()
