"""rclpy.node: nodes of ROS 2's Python interface."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Self, TypeVar

from rosz import names
from rosz.errors import UsageError
from rosz.node import Node as RoszNode
from rosz.node import simulate
from rosz.ros2.rclpy import executors
from rosz.ros2.rclpy.context import Context, get_default_context
from rosz.ros2.rclpy.entities import Client, Publisher, Service, Subscription, Timer
from rosz.ros2.rclpy.events import (
    GuardCondition,
    PublisherEventCallbacks,
    SubscriptionEventCallbacks,
    handlers_of,
)
from rosz.ros2.rclpy.exceptions import NotInitializedException
from rosz.ros2.rclpy.logging import RcutilsLogger, serve_logger_levels, write_as_rclpy
from rosz.ros2.rclpy.parameter import NodeParameters, Parameter
from rosz.ros2.rclpy.qos import (
    QoSOverridingOptions,
    QoSProfile,
    TopicEndpointInfo,
    override_qos,
    to_qos,
)
from rosz.ros2.rclpy.time import Clock, Rate, ROSClock
from rosz.wire import Kind, Token

P = TypeVar("P")
_SECOND = 1_000_000_000


class Node(NodeParameters):
    """A node whose callbacks run only while an executor spins it.

    Names of rosz's own begin with ``rosz_``, so that subclasses are free to use any others.

    Args:
        node_name: Base name; ``__node:=`` on the command line overrides it.
        context: Context of the node; the default one when not given.
        namespace: Namespace of the node.
        parameter_overrides: Parameters whose values replace the declared ones.
        options: Other options of rclpy, of which ``enable_logger_service`` and
            ``automatically_declare_parameters_from_overrides`` have an effect. ``cli_args``,
            ``use_global_arguments``, ``enable_rosout``, ``start_parameter_services`` and
            ``allow_undeclared_parameters`` are ignored.

    Raises:
        NotInitializedException: ``rclpy.init`` was not called.
        InvalidName: The name or namespace is not legal.
    """

    def __init__(
        self,
        node_name: str,
        *,
        context: Context | None = None,
        namespace: str | None = None,
        parameter_overrides: Sequence[Parameter] | None = None,
        **options: Any,
    ) -> None:
        self._rosz_parts: list[Any] = []
        self.context: Context = context or get_default_context()
        if not self.context.ok():
            raise NotInitializedException("cannot create node")
        unknown = options.keys() - _OPTIONS
        if unknown:
            raise UsageError(f"Node takes no '{min(unknown)}' in rosz")
        self.executor: executors.Executor | None = None
        node = RoszNode(node_name, namespace=namespace, context=self.context.opened)
        given = self.context.given
        overrides: dict[str, Any] = {}
        for name in ("", node.base_name, node.name):
            overrides |= given.params.get(name, {})
        overrides |= {parameter.name: parameter.value for parameter in parameter_overrides or ()}
        super().__init__(node, overrides, self.rosz_call_soon)
        self._clock = ROSClock(self.rosz_node.clock)
        self._rosz_logger_name = self.rosz_node.name.strip("/").replace("/", ".")
        write_as_rclpy(self.rosz_node.log, self._rosz_logger_name)
        self.default_callback_group: executors.CallbackGroup = (
            executors.MutuallyExclusiveCallbackGroup()
        )
        if given.level:
            self.rosz_node.log.set_level("", given.level)
        self._rosz_after.append(self._rosz_follow_clock)
        self.declare_parameter("use_sim_time", self.rosz_node.clock.simulated)
        if options.get("enable_logger_service"):
            serve_logger_levels(self, RcutilsLogger(self._rosz_logger_name, self.rosz_node.log))
        if options.get("automatically_declare_parameters_from_overrides"):
            for name, value in overrides.items():
                if not self.has_parameter(name):
                    self.declare_parameter(name, value)

    def rosz_entities(self) -> Iterator[executors.Entity]:
        """Yield the entities with callbacks, timers first, which is rclpy's order."""
        parts = list(self._rosz_parts)
        yield from (part for part in parts if isinstance(part, Timer))
        for part in parts:
            if not isinstance(part, Timer) and hasattr(part, "take"):
                yield part
            yield from getattr(part, "event_handlers", ())

    def _rosz_follow_clock(self, parameters: list[Parameter]) -> None:
        for parameter in parameters:
            if parameter.name == "use_sim_time":
                simulate(self.rosz_node, on=bool(parameter.value))

    def rosz_wake(self) -> None:
        """Make the executor look for callbacks that are ready."""
        executor = self.executor
        if executor is not None:
            executor.wake()

    def rosz_call_soon(self, job: Callable[[], object]) -> None:
        """Let the executor call a function."""
        (self.executor or executors.get_global_executor()).call_soon(job)

    def get_name(self) -> str:
        """Return the base name of the node."""
        return self.rosz_node.base_name

    def get_namespace(self) -> str:
        """Return the namespace of the node."""
        return self.rosz_node.namespace

    def get_fully_qualified_name(self) -> str:
        """Return the full name of the node."""
        return self.rosz_node.name

    def get_clock(self) -> Clock:
        """Return the clock of the node, which shows ROS time."""
        return self._clock

    def get_logger(self) -> RcutilsLogger:
        """Return the logger of the node."""
        return RcutilsLogger(self._rosz_logger_name, self.rosz_node.log)

    # Entities

    def create_publisher(
        self,
        msg_type: type[Any],
        topic: str,
        qos_profile: QoSProfile | int = 10,
        *,
        callback_group: executors.CallbackGroup | None = None,
        event_callbacks: PublisherEventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        publisher_class: type[Publisher] = Publisher,
    ) -> Publisher:
        """Create a publisher.

        Args:
            msg_type: Class of the messages.
            topic: Name of the topic.
            qos_profile: Profile, or depth of the queue.
            callback_group: Group of the event callbacks; the node's default group when not given.
            event_callbacks: Callbacks for events, such as subscriptions that are matched.
            qos_overriding_options: Policies that parameters may override.
            publisher_class: Class to make.

        Raises:
            UnsupportedEventTypeError: There is no such event.
            InvalidQosOverridesError: A parameter has no valid policy.
        """
        qos_profile = self._rosz_qos("publisher", topic, qos_profile, qos_overriding_options)
        raw = self.rosz_node.publisher(topic, msg_type, qos=to_qos(qos_profile))
        group = callback_group or self.default_callback_group
        events = handlers_of(raw, event_callbacks, group, self.rosz_wake)
        return self.rosz_add(publisher_class(raw, qos_profile, events))

    def _rosz_qos(
        self, kind: str, topic: str, qos: QoSProfile | int, options: QoSOverridingOptions | None
    ) -> QoSProfile | int:
        if options is None:
            return qos
        return override_qos(self, kind, self.resolve_topic_name(topic), qos, options)

    def create_subscription(
        self,
        msg_type: type[Any],
        topic: str,
        callback: Callable[..., Any],
        qos_profile: QoSProfile | int,
        *,
        callback_group: executors.CallbackGroup | None = None,
        event_callbacks: SubscriptionEventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        raw: bool = False,
    ) -> Subscription:
        """Create a subscription.

        Args:
            msg_type: Class of the messages.
            topic: Name of the topic.
            callback: Function called with each message, or with its bytes if ``raw``; one of two
                arguments also gets a dictionary with the times of the message.
            qos_profile: Profile, or depth of the queue.
            callback_group: Group of the callback; the node's default group when not given.
            event_callbacks: Callbacks for events, such as messages that are lost.
            qos_overriding_options: Policies that parameters may override.
            raw: Whether to pass encoded messages.

        Raises:
            UnsupportedEventTypeError: There is no such event.
            InvalidQosOverridesError: A parameter has no valid policy.
        """
        qos_profile = self._rosz_qos("subscription", topic, qos_profile, qos_overriding_options)
        subscription = Subscription(
            self.rosz_node,
            topic,
            msg_type,
            callback,
            to_qos(qos_profile),
            raw=raw,
            group=callback_group or self.default_callback_group,
            wake=self.rosz_wake,
        )
        subscription.follow(event_callbacks)
        return self.rosz_add(subscription)

    def create_timer(
        self,
        timer_period_sec: float,
        callback: Callable[[], Any] | None,
        callback_group: executors.CallbackGroup | None = None,
        clock: Clock | None = None,
        autostart: bool = True,
    ) -> Timer:
        """Create a timer, which calls a function periodically.

        Args:
            timer_period_sec: Period in seconds.
            callback: Function to call.
            callback_group: Group of the callback; the node's default group when not given.
            clock: Clock to follow; the node's when not given.
            autostart: Whether the timer starts at once; otherwise ``reset`` starts it.
        """
        return self.rosz_add(
            Timer(
                round(timer_period_sec * _SECOND),
                callback,
                self.rosz_node.clock,
                clock=clock or self._clock,
                group=callback_group or self.default_callback_group,
                wake=self.rosz_wake,
                report=self.rosz_node.log.report,
                autostart=autostart,
            )
        )

    def create_service(
        self,
        srv_type: type[Any],
        srv_name: str,
        callback: Callable[[Any, Any], Any],
        *,
        callback_group: executors.CallbackGroup | None = None,
        **_options: Any,
    ) -> Service:
        """Create a service.

        Args:
            srv_type: Type of the service.
            srv_name: Name of the service.
            callback: Function called with a request and an empty response; returns the response.
            callback_group: Group of the callback; the node's default group when not given.
        """
        return self.rosz_add(
            Service(
                self.rosz_node,
                srv_name,
                srv_type,
                callback,
                group=callback_group or self.default_callback_group,
                wake=self.rosz_wake,
            )
        )

    def create_client(self, srv_type: type[Any], srv_name: str, **_options: Any) -> Client:
        """Create a client of a service.

        Args:
            srv_type: Type of the service.
            srv_name: Name of the service.
        """
        return self.rosz_add(
            Client(self.rosz_node, srv_name, srv_type, call_soon=self.rosz_call_soon)
        )

    def create_guard_condition(
        self, callback: Callable[[], Any], callback_group: executors.CallbackGroup | None = None
    ) -> GuardCondition:
        """Create a guard condition, whose ``trigger`` lets the executor call a function.

        Args:
            callback: Function to call.
            callback_group: Group of the callback; the node's default group when not given.
        """
        group = callback_group or self.default_callback_group
        return self.rosz_add(GuardCondition(callback, group, self.rosz_wake))

    def create_rate(self, frequency: float, clock: Clock | None = None) -> Rate:  # noqa: ARG002
        """Create a rate, which paces a loop.

        Args:
            frequency: Frequency in Hz.
            clock: Not used; the rate follows the node's clock.

        Raises:
            UsageError: The frequency is not above 0.
        """
        if frequency <= 0:
            raise UsageError(f"a rate is '{frequency}' Hz; expected above 0")
        return Rate(int(_SECOND / frequency), self.rosz_node.clock)

    def rosz_add(self, part: P) -> P:
        """Close an entity with the node, and let the executor run its callbacks."""
        self._rosz_parts.append(part)
        self.rosz_wake()
        return part

    def rosz_remove(self, part: Any) -> None:
        """Remove an entity that closes itself."""
        if part in self._rosz_parts:
            self._rosz_parts.remove(part)

    def _rosz_destroy(self, part: Any) -> bool:
        if part not in self._rosz_parts:
            return False
        self._rosz_parts.remove(part)
        part.destroy()
        return True

    def destroy_publisher(self, publisher: Publisher) -> bool:
        """Close a publisher; return whether it belonged to the node."""
        return self._rosz_destroy(publisher)

    def destroy_subscription(self, subscription: Subscription) -> bool:
        """Close a subscription; return whether it belonged to the node."""
        return self._rosz_destroy(subscription)

    def destroy_timer(self, timer: Timer) -> bool:
        """Close a timer; return whether it belonged to the node."""
        return self._rosz_destroy(timer)

    def destroy_service(self, service: Service) -> bool:
        """Close a service; return whether it belonged to the node."""
        return self._rosz_destroy(service)

    def destroy_client(self, client: Client) -> bool:
        """Close a client; return whether it belonged to the node."""
        return self._rosz_destroy(client)

    def destroy_guard_condition(self, guard: GuardCondition) -> bool:
        """Remove a guard condition; return whether it belonged to the node."""
        return self._rosz_destroy(guard)

    def destroy_rate(self, rate: Rate) -> bool:
        """Close a rate."""
        rate.destroy()
        return True

    def destroy_node(self) -> None:
        """Close the node and its entities; a second call has no effect."""
        if self.executor is not None:
            self.executor.remove_node(self)
        while self._rosz_parts:
            self._rosz_parts.pop().destroy()
        self.rosz_node.close()

    @property
    def publishers(self) -> Iterator[Publisher]:
        """The publishers of the node."""
        return (part for part in self._rosz_parts if isinstance(part, Publisher))

    @property
    def subscriptions(self) -> Iterator[Subscription]:
        """The subscriptions of the node."""
        return (part for part in self._rosz_parts if isinstance(part, Subscription))

    @property
    def timers(self) -> Iterator[Timer]:
        """The timers of the node."""
        return (part for part in self._rosz_parts if isinstance(part, Timer))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_details: object) -> None:
        self.destroy_node()

    # Names and other nodes

    def resolve_topic_name(self, topic: str, *, only_expand: bool = False) -> str:
        """Return the global name of a topic.

        Args:
            topic: Any legal name.
            only_expand: Whether to ignore remappings.
        """
        if only_expand:
            return names.resolve(topic, self.rosz_node.name)
        return self.rosz_node.resolve(topic)

    resolve_service_name = resolve_topic_name

    def get_node_names(self) -> list[str]:
        """Return the base names of all nodes."""
        return [names.basename(name) for name in self._rosz_view().nodes()]

    def get_node_names_and_namespaces(self) -> list[tuple[str, str]]:
        """Return the base names and namespaces of all nodes."""
        return [
            (names.basename(name), names.namespace(name).rstrip("/") or "/")
            for name in self._rosz_view().nodes()
        ]

    def get_topic_names_and_types(self, no_demangle: bool = False) -> list[tuple[str, list[str]]]:  # noqa: ARG002
        """Return all topics with their types."""
        return list(self._rosz_view().topics().items())

    def get_service_names_and_types(self) -> list[tuple[str, list[str]]]:
        """Return all services with their types."""
        return list(self._rosz_view().services().items())

    def count_publishers(self, topic_name: str) -> int:
        """Return the number of publishers of a topic."""
        return len(self._rosz_entities(Kind.PUBLISHER, topic_name))

    def count_subscribers(self, topic_name: str) -> int:
        """Return the number of subscriptions of a topic."""
        return len(self._rosz_entities(Kind.SUBSCRIPTION, topic_name))

    def get_publishers_info_by_topic(self, topic_name: str, **_: Any) -> list[TopicEndpointInfo]:
        """Return the publishers of a topic."""
        return [*map(TopicEndpointInfo, self._rosz_entities(Kind.PUBLISHER, topic_name))]

    def get_subscriptions_info_by_topic(self, topic_name: str, **_: Any) -> list[TopicEndpointInfo]:
        """Return the subscriptions of a topic."""
        return [*map(TopicEndpointInfo, self._rosz_entities(Kind.SUBSCRIPTION, topic_name))]

    def _rosz_entities(self, kind: Kind, topic: str) -> list[Token]:
        name = self.resolve_topic_name(topic)
        with self.rosz_node.context.graph.follow_entities(kind, name) as followed:
            return followed.refresh(_QUERY_TIMEOUT).entities(kind, name=name)

    def _rosz_view(self) -> Any:
        return self.rosz_node.context.graph.view()


_QUERY_TIMEOUT = 2.0
_OPTIONS = frozenset({
    "allow_undeclared_parameters", "automatically_declare_parameters_from_overrides", "cli_args",
    "enable_logger_service", "enable_rosout", "start_parameter_services", "use_global_arguments",
})  # fmt: skip
