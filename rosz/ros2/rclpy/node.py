"""rclpy.node: nodes of ROS 2's Python interface."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, NoReturn, Self, TypeVar

from rosz.errors import UsageError
from rosz.node import Node as RoszNode
from rosz.node.standard import simulate
from rosz.ros2.rclpy import state
from rosz.ros2.rclpy.callback_groups import CallbackGroup, MutuallyExclusiveCallbackGroup
from rosz.ros2.rclpy.client import Client
from rosz.ros2.rclpy.clock import Clock, Rate, ROSClock
from rosz.ros2.rclpy.declared import Declared
from rosz.ros2.rclpy.exceptions import NotInitializedException
from rosz.ros2.rclpy.logging import RcutilsLogger, write_as_rclpy
from rosz.ros2.rclpy.node_graph import NodeGraph
from rosz.ros2.rclpy.node_parameters import NodeParameters
from rosz.ros2.rclpy.parameter import Parameter
from rosz.ros2.rclpy.publisher import Publisher
from rosz.ros2.rclpy.qos import QoSProfile, to_qos
from rosz.ros2.rclpy.service import Service
from rosz.ros2.rclpy.subscription import Subscription
from rosz.ros2.rclpy.timer import Timer

if TYPE_CHECKING:
    from rosz.ros2.rclpy.context import Context
    from rosz.ros2.rclpy.executors import Entity, Executor

__all__ = ("Node",)

P = TypeVar("P")
_SECOND = 1_000_000_000


class Node(NodeParameters, NodeGraph):
    """A node whose callbacks run while it is spun, and only then.

    Names of rosz's own begin with ``rosz_``, so that classes of users are free to have any others.

    Args:
        node_name: Base name; ``__node:=`` on the command line overrides it.
        context: What it shares with others; the default one when not given.
        namespace: Its namespace.
        parameter_overrides: Values of parameters, which count more than those declared.
        options: Of rclpy's other options, ``automatically_declare_parameters_from_overrides``
            counts; ``cli_args``, ``use_global_arguments``, ``enable_rosout``,
            ``start_parameter_services``, ``allow_undeclared_parameters`` and
            ``enable_logger_service`` are taken and do nothing.

    Raises:
        NotInitializedException: There was no ``rclpy.init``.
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
        self.context = context or state.default_context()
        if not self.context.ok():
            raise NotInitializedException("cannot create node")
        unknown = options.keys() - _OPTIONS
        if unknown:
            raise UsageError(f"Node takes no '{min(unknown)}' in rosz")
        self.executor: Executor | None = None
        self.rosz_node = RoszNode(node_name, namespace=namespace, context=self.context.opened)
        self._clock = ROSClock(self.rosz_node.clock)
        self._rosz_logger_name = self.rosz_node.name.strip("/").replace("/", ".")
        write_as_rclpy(self.rosz_node.log, self._rosz_logger_name)
        self.default_callback_group: CallbackGroup = MutuallyExclusiveCallbackGroup()
        given = self.context.given
        if given.level:
            self.rosz_node.log.set_level("", given.level)
        overrides = self._rosz_overrides(given.params)
        overrides |= {one.name: one.value for one in parameter_overrides or ()}
        self._rosz_declared = Declared(self.rosz_node, overrides, self._rosz_call_soon)
        self.declare_parameter("use_sim_time", self.rosz_node.clock.simulated)
        if self.get_parameter("use_sim_time").value and not self.rosz_node.clock.simulated:
            simulate(self.rosz_node)
        if options.get("automatically_declare_parameters_from_overrides"):
            for name, value in overrides.items():
                if not self.has_parameter(name):
                    self.declare_parameter(name, value)

    def _rosz_overrides(self, params: dict[str, dict[str, Any]]) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for node in ("", self.rosz_node.base_name, self.rosz_node.name):
            found |= params.get(node, {})
        return found

    def __getattr__(self, name: str) -> NoReturn:
        raise AttributeError(
            f"'{type(self).__name__}' has no '{name}': rosz's rclpy.node.Node lacks it"
        )

    # What executors ask.

    def rosz_entities(self) -> Iterator[Entity]:
        """Yield what has callbacks, timers first, as they run in rclpy."""
        parts = list(self._rosz_parts)
        yield from (part for part in parts if isinstance(part, Timer))
        yield from (part for part in parts if isinstance(part, Subscription | Service))

    def _rosz_wake(self) -> None:
        executor = self.executor
        if executor is not None:
            executor.wake()

    def _rosz_call_soon(self, job: Callable[[], object]) -> None:
        (self.executor or state.global_executor()).call_soon(job)

    # Who it is.

    def get_name(self) -> str:
        """Return its base name."""
        return self.rosz_node.base_name

    def get_namespace(self) -> str:
        """Return its namespace."""
        return self.rosz_node.namespace

    def get_fully_qualified_name(self) -> str:
        """Return its full name."""
        return self.rosz_node.name

    def get_clock(self) -> Clock:
        """Return its clock, which tells ROS time."""
        return self._clock

    def get_logger(self) -> RcutilsLogger:
        """Return its logger."""
        return RcutilsLogger(self._rosz_logger_name, self.rosz_node.log)

    # What it has.

    def create_publisher(
        self,
        msg_type: type[Any],
        topic: str,
        qos_profile: QoSProfile | int = 10,
        **_options: Any,
    ) -> Publisher:
        """Declare that it publishes on a topic.

        Args:
            msg_type: What is published.
            topic: Name of the topic.
            qos_profile: A profile, or the depth of its queue.
        """
        raw = self.rosz_node.publisher(topic, msg_type, qos=to_qos(qos_profile))
        return self._rosz_keep(Publisher(raw, qos_profile))

    def create_subscription(
        self,
        msg_type: type[Any],
        topic: str,
        callback: Callable[[Any], Any],
        qos_profile: QoSProfile | int,
        *,
        callback_group: CallbackGroup | None = None,
        raw: bool = False,
        **_options: Any,
    ) -> Subscription:
        """Declare that it listens to a topic.

        Args:
            msg_type: What is expected.
            topic: Name of the topic.
            callback: Gets each message, or its bytes if ``raw``.
            qos_profile: A profile, or the depth of its queue.
            callback_group: The group of the callback; the node's own when not given.
            raw: Whether to pass the encoded bytes on.
        """
        return self._rosz_keep(
            Subscription(
                self.rosz_node,
                topic,
                msg_type,
                callback,
                to_qos(qos_profile),
                raw=raw,
                group=callback_group or self.default_callback_group,
                wake=self._rosz_wake,
            )
        )

    def create_timer(
        self,
        timer_period_sec: float,
        callback: Callable[[], Any] | None,
        callback_group: CallbackGroup | None = None,
        clock: Clock | None = None,
        autostart: bool = True,
    ) -> Timer:
        """Have a function called every so often.

        Args:
            timer_period_sec: Seconds.
            callback: What to call.
            callback_group: The group of the callback; the node's own when not given.
            clock: Whose time to go by; the node's when not given.
            autostart: Whether it begins at once, or with ``reset``.
        """
        return self._rosz_keep(
            Timer(
                round(timer_period_sec * _SECOND),
                callback,
                self.rosz_node.clock,
                clock=clock or self._clock,
                group=callback_group or self.default_callback_group,
                wake=self._rosz_wake,
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
        callback_group: CallbackGroup | None = None,
        **_options: Any,
    ) -> Service:
        """Serve a service.

        Args:
            srv_type: Its type.
            srv_name: Its name.
            callback: Gets a request and an empty response, and returns the response.
            callback_group: The group of the callback; the node's own when not given.
        """
        return self._rosz_keep(
            Service(
                self.rosz_node,
                srv_name,
                srv_type,
                callback,
                group=callback_group or self.default_callback_group,
                wake=self._rosz_wake,
            )
        )

    def create_client(self, srv_type: type[Any], srv_name: str, **_options: Any) -> Client:
        """Make a caller of a service.

        Args:
            srv_type: Its type.
            srv_name: Its name.
        """
        return self._rosz_keep(
            Client(self.rosz_node, srv_name, srv_type, call_soon=self._rosz_call_soon)
        )

    def create_rate(self, frequency: float, clock: Clock | None = None) -> Rate:  # noqa: ARG002
        """Return a pace-maker for a loop.

        Args:
            frequency: Times per second.
            clock: Not used: it goes by the node's clock.

        Raises:
            UsageError: The frequency is not above 0.
        """
        if frequency <= 0:
            raise UsageError(f"a rate is '{frequency}' Hz; expected above 0")
        return Rate(int(_SECOND / frequency), self.rosz_node.clock)

    def _rosz_keep(self, part: P) -> P:
        self._rosz_parts.append(part)
        self._rosz_wake()
        return part

    def _rosz_destroy(self, part: Any) -> bool:
        if part not in self._rosz_parts:
            return False
        self._rosz_parts.remove(part)
        part.destroy()
        return True

    def destroy_publisher(self, publisher: Publisher) -> bool:
        """End a publisher; tell whether it was one of the node."""
        return self._rosz_destroy(publisher)

    def destroy_subscription(self, subscription: Subscription) -> bool:
        """End a subscription; tell whether it was one of the node."""
        return self._rosz_destroy(subscription)

    def destroy_timer(self, timer: Timer) -> bool:
        """End a timer; tell whether it was one of the node."""
        return self._rosz_destroy(timer)

    def destroy_service(self, service: Service) -> bool:
        """End a service; tell whether it was one of the node."""
        return self._rosz_destroy(service)

    def destroy_client(self, client: Client) -> bool:
        """End a client; tell whether it was one of the node."""
        return self._rosz_destroy(client)

    def destroy_rate(self, rate: Rate) -> bool:
        """End a rate."""
        rate.destroy()
        return True

    def destroy_node(self) -> None:
        """End the node with all it has; again is no error."""
        if self.executor is not None:
            self.executor.remove_node(self)
        while self._rosz_parts:
            self._rosz_parts.pop().destroy()
        self.rosz_node.close()

    @property
    def publishers(self) -> Iterator[Publisher]:
        """Its publishers."""
        return (part for part in self._rosz_parts if isinstance(part, Publisher))

    @property
    def subscriptions(self) -> Iterator[Subscription]:
        """Its subscriptions."""
        return (part for part in self._rosz_parts if isinstance(part, Subscription))

    @property
    def timers(self) -> Iterator[Timer]:
        """Its timers."""
        return (part for part in self._rosz_parts if isinstance(part, Timer))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_details: object) -> None:
        self.destroy_node()


_OPTIONS = frozenset({
    "allow_undeclared_parameters", "automatically_declare_parameters_from_overrides", "cli_args",
    "enable_logger_service", "enable_rosout", "start_parameter_services", "use_global_arguments",
})  # fmt: skip
