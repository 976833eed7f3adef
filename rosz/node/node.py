"""Nodes: what a program is to the rest of the network, by itself or through a bridge."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any, TypeVar, overload

from rosz import names
from rosz.errors import ClosedError, TypeNotFound
from rosz.interrupts import InterruptDeferral
from rosz.node import control, signals, standard
from rosz.node.client import Client
from rosz.node.clock import nanoseconds
from rosz.node.context import Context
from rosz.node.core import NodeCore
from rosz.node.publisher import Publisher
from rosz.node.ros2.detector import Ros2Nodes, Ros2PeerDetector
from rosz.node.service import Service
from rosz.node.subscription import GenericSubscription, Subscription
from rosz.node.timer import Rate, Timer, TimerEvent
from rosz.qos import SERVICES, QoS, for_queue

if TYPE_CHECKING:
    from rosz.message import Action, Message
    from rosz.message import Service as ServiceType
    from rosz.node.actions.client import ActionClient
    from rosz.node.actions.server import ActionServer, Policy, ServerGoal

M = TypeVar("M", bound="Message")


class Node(NodeCore):
    """A named part of the system: publishers, subscriptions, services, timers, parameters, a log.

    Args:
        name: Base name; ``__name:=`` on the command line overrides it.
        namespace: Namespace; ``ROS_NAMESPACE`` when not given, and ``__ns:=`` overrides both.
        anonymous: Whether to make the name unique to this process and moment.
        context: The context, shared with other nodes of the process; when not given, the node opens
            one and shuts it down at its end.
        argv: Command line without the program name; that of the process when not given. Ignored
            with a ``context``, which has read one already.
        handle_signals: Whether Ctrl-C and SIGTERM shut the node down; by default when it has its
            own context. Only the main thread of a program can have that.

    Raises:
        InvalidName: The name or namespace is not legal.
        TransportError: The session cannot be opened.
        UsageError: A variable of the environment has an invalid value.
    """

    def __init__(
        self,
        name: str,
        *,
        namespace: str | None = None,
        anonymous: bool = False,
        context: Context | None = None,
        argv: Sequence[str] | None = None,
        handle_signals: bool | None = None,
    ) -> None:
        with InterruptDeferral(self.close):
            super().__init__(
                name, namespace=namespace, anonymous=anonymous, context=context, argv=argv
            )
            try:
                self._begin()
            except BaseException:
                self.close()
                raise
            if self._owns_context if handle_signals is None else handle_signals:
                signals.install(self.context)

    def _begin(self) -> None:
        standard.set_initial_params(self)
        control.serve_control(self)
        control.yield_to_newer(self)
        self._announce()
        if not self.context.passing:
            standard.follow_clock(self)
            self.keep(Ros2PeerDetector(self))
            self.params.reach(Ros2Nodes(self))
        standard.open_rosout(self)

    @overload
    def publisher(
        self,
        topic: str,
        message_type: type[M],
        *,
        queue_size: int = 10,
        latch: bool = False,
        qos: QoS | None = None,
        copies: bool = False,
    ) -> Publisher[M]: ...
    @overload
    def publisher(
        self,
        topic: str,
        message_type: str,
        *,
        queue_size: int = 10,
        latch: bool = False,
        qos: QoS | None = None,
        copies: bool = False,
    ) -> Publisher[Any]: ...
    def publisher(
        self,
        topic: str,
        message_type: type[M] | str,
        *,
        queue_size: int = 10,
        latch: bool = False,
        qos: QoS | None = None,
        copies: bool = False,
    ) -> Publisher[M] | Publisher[Any]:
        """Make a publisher of a topic.

        Args:
            topic: Name of the topic; resolved and remapped.
            message_type: Class of the messages, or its name, such as ``std_msgs/String``; the class
                is compiled from the definition if need be.
            queue_size: Depth of the queue that others see; with ``latch`` it is 1.
            latch: Whether late subscriptions get the last message.
            qos: Quality of service instead of both.
            copies: Whether nodes of the same process get copies of the messages. Say so if the
                program changes a message that it has published. In a container they otherwise get
                the message itself, which none of them may change.

        Raises:
            InvalidName: The name is not legal.
            UsageError: The size of the queue is not valid.
            TypeNotFound: There is no type of that name.
            DefinitionError: A definition in the package of the type is not well-formed.
            ClosedError: The node is closed.
        """
        if qos is None:
            qos = QoS(depth=1, durability="transient_local") if latch else for_queue(queue_size)
        name = self.resolve(topic)
        kind = self._message_class(message_type)
        return self.keep(Publisher(self, name, kind, qos, copies=copies))

    @overload
    def subscription(
        self,
        topic: str,
        message_type: type[M],
        callback: Callable[..., Any] | None = None,
        *,
        queue_size: int = 10,
        qos: QoS | None = None,
        raw: bool = False,
        with_info: bool = False,
    ) -> Subscription[M]: ...
    @overload
    def subscription(
        self,
        topic: str,
        message_type: str | None = None,
        callback: Callable[..., Any] | None = None,
        *,
        queue_size: int = 10,
        qos: QoS | None = None,
        raw: bool = False,
        with_info: bool = False,
    ) -> Subscription[Any]: ...
    def subscription(
        self,
        topic: str,
        message_type: type[M] | str | None = None,
        callback: Callable[..., Any] | None = None,
        *,
        queue_size: int = 10,
        qos: QoS | None = None,
        raw: bool = False,
        with_info: bool = False,
    ) -> Subscription[M] | Subscription[Any] | GenericSubscription:
        """Make a subscription of a topic.

        Args:
            topic: Name of the topic; resolved and remapped.
            message_type: Class of the messages, or its name, such as ``std_msgs/String``; where its
                definition is not known here, a publisher's node is asked for it. When not given,
                every type is received, and decoded by the definition known here.
            callback: Function that gets each message, on a thread of the subscription, one at a
                time. Without one, iterate over the subscription or call its ``get``.
            queue_size: Number of newest samples that wait for their turn; older ones are dropped.
            qos: Quality of service instead of ``queue_size``. With a volatile one, the subscription
                does not get what latching publishers have kept, as in ROS 2; without any it does,
                as in ROS 1.
            raw: Whether to pass on the encoded bytes.
            with_info: Whether the callback also gets a `MessageInfo`.

        Raises:
            InvalidName: The name is not legal.
            UsageError: The size of the queue is not valid.
            TypeNotFound: Neither this machine nor a publisher of the topic has a type of that name.
            DefinitionError: A definition in the package of the type is not well-formed.
            ServiceError: The publisher's node ended before it sent the definition.
            WaitTimeout: The publisher's node did not send the definition.
            ClosedError: The node is closed.
        """
        name, history = self.resolve(topic), qos is None
        qos = qos or for_queue(queue_size)
        if message_type is None:
            return self.keep(
                GenericSubscription(
                    self, name, callback, qos, raw=raw, with_info=with_info, history=history
                )
            )
        kind = self._message_class(message_type, name)
        return self.keep(
            Subscription(
                self, name, kind, callback, qos, raw=raw, with_info=with_info, history=history
            )
        )

    def service(
        self,
        name: str,
        service_type: type[ServiceType],
        handler: Callable[[Any], Any],
        *,
        qos: QoS = SERVICES,
        threads: int = 16,
    ) -> Service:
        """Serve a service.

        Args:
            name: Name of the service; resolved and remapped.
            service_type: Class of the service.
            handler: Function that gets a request, on a thread of the service, and returns the
                response: an instance, a list or dictionary of its fields, or its only value. What
                it raises is logged, and sent to the caller.
            qos: Quality of service that others see.
            threads: Largest number of calls handled at one time.

        Raises:
            InvalidName: The name is not legal.
            UsageError: The number of threads is below 1.
            ClosedError: The node is closed.
        """
        return self.keep(Service(self, self.resolve(name), service_type, handler, qos, threads))

    def client(
        self,
        name: str,
        service_type: type[ServiceType],
        *,
        timeout: float = 60.0,
        qos: QoS = SERVICES,
    ) -> Client:
        """Make a client of a service.

        Args:
            name: Name of the service; resolved and remapped.
            service_type: Class of the service.
            timeout: Time limit of a call in seconds, unless the call has its own.
            qos: Quality of service that others see.

        Raises:
            InvalidName: The name is not legal.
            UsageError: The timeout is not a number.
            ClosedError: The node is closed.
        """
        return self.keep(Client(self, self.resolve(name), service_type, qos, timeout))

    def action_server(
        self,
        name: str,
        action_type: type[Action],
        execute: Callable[[ServerGoal], object],
        *,
        goal: Callable[[Any], bool] | None = None,
        cancel: Callable[[ServerGoal], bool] | None = None,
        policy: Policy = "parallel",
        keep_results: float = 900.0,
        most_results: int = 200,
    ) -> ActionServer:
        """Serve an action.

        Args:
            name: Name of the action; resolved and remapped.
            action_type: Class of the action, such as ``Fibonacci``.
            execute: Function that gets a `ServerGoal`, on a thread of the server, and ends it with
                ``succeed``, ``abort`` or ``canceled``. If it raises, the goal is aborted.
            goal: Function that gets a goal message and returns whether to accept it; without one,
                all are accepted.
            cancel: Function that gets a `ServerGoal` and returns whether to end it as a client
                asks; without one, all requests are granted.
            policy: ``parallel`` to execute goals at the same time; ``queue`` one after the other;
                ``preempt`` one at a time, where a newer goal cancels all older ones.
            keep_results: Seconds for which clients can ask for the result of a goal that has ended.
            most_results: Largest number of such results; the oldest is forgotten.

        Raises:
            InvalidName: The name is not legal.
            UsageError: The policy is none of these.
            ClosedError: The node is closed.
        """
        from rosz.node.actions.server import ActionServer, ServerOptions

        options = ServerOptions(goal, cancel, policy, keep_results, most_results)
        return self.keep(ActionServer(self, self.resolve(name), action_type, execute, options))

    def action_client(self, name: str, action_type: type[Action]) -> ActionClient:
        """Make a client of an action.

        Args:
            name: Name of the action; resolved and remapped.
            action_type: Class of the action, such as ``Fibonacci``.

        Raises:
            InvalidName: The name is not legal.
            ClosedError: The node is closed.
        """
        from rosz.node.actions.client import ActionClient

        return self.keep(ActionClient(self, self.resolve(name), action_type))

    def timer(
        self, period: float, callback: Callable[[TimerEvent], Any], *, oneshot: bool = False
    ) -> Timer:
        """Call a function at each period.

        Args:
            period: Period in seconds of ROS time.
            callback: Function that gets a `TimerEvent`, on a thread of the timer; what it raises is
                logged.
            oneshot: Whether to call it only once.

        Raises:
            UsageError: The period is not a number above 0.
            ClosedError: The node is closed.
        """
        kept = threading.RLock()

        def forget(timer: Timer) -> None:
            with kept:  # a timer that ends at once must not be forgotten before it is kept
                self.forget(timer)

        self._lifecycle.check_open("make a timer")
        with kept:
            timer = Timer(
                nanoseconds(period, "timer period"),
                callback,
                self.clock,
                oneshot=oneshot,
                on_error=self.log.report,
                on_end=forget,
            )
            with suppress(ClosedError):  # its first call may have closed the node
                self.keep(timer)
        return timer

    def rate(self, hz: float) -> Rate:
        """Return a rate: iterate over it, or call its ``sleep``.

        Args:
            hz: Turns per second of ROS time.

        Raises:
            UsageError: `hz` is not above 0, or a period is less than a nanosecond.
        """
        self.context.cooperative = True
        return Rate(hz, self.clock)

    def now(self) -> int:
        """Return the time in nanoseconds: simulated if ``use_sim_time`` is set, else wall time."""
        return self.clock.now()

    def sleep(self, seconds: float) -> bool:
        """Sleep in ROS time.

        Args:
            seconds: Duration in seconds.

        Returns:
            Whether the time is over; false if the node was shut down meanwhile.

        Raises:
            UsageError: The duration is not a finite number.
        """
        self.context.cooperative = True
        return self.clock.sleep(nanoseconds(seconds, "a sleep"))

    def _message_class(self, message_type: type[M] | str, topic: str = "") -> type[M | Any]:
        """Return the class of a type, by the definition of a publisher of the topic if need be."""
        if not isinstance(message_type, str):
            return message_type
        try:
            return self.context.types.message(message_type)
        except TypeNotFound:
            publishers = self.context.graph.refresh().publishers(topic) if topic else []
            wanted = names.short_type(message_type)
            for token in publishers:
                if names.short_type(token.type_name) == wanted:
                    from rosz.node.ros2 import request_type  # rarely needed

                    return request_type(self, token)
            raise


class BridgedNode(NodeCore):
    """A node that lives elsewhere, and whose entities a bridge declares.

    A request to shut it down, from a command or since a newer node has its name, goes to the node.

    Args:
        context: The context of the bridge.
        name: Full name.
        terminate: Function that asks the node to end, for a reason.
        number: Number of the node within the session; by default one that was never used.
        started: Time of its start that its token tells, as that of the node that had the number
            before; now by default.

    Raises:
        InvalidName: The name is not legal.
        ClosedError: The context is shut down.
    """

    def __init__(
        self,
        context: Context,
        name: str,
        terminate: Callable[[str], object],
        number: int | None = None,
        started: int | None = None,
    ) -> None:
        self._terminate = terminate
        namespace = names.namespace(name).rstrip("/") or "/"
        base = names.basename(name)
        super().__init__(base, namespace=namespace, context=context, number=number, started=started)
        control.serve_control(self)
        control.yield_to_newer(self)
        self._announce()

    def shutdown(self, reason: str = "") -> None:
        """Ask the node to end; it disappears when it has."""
        if not self._lifecycle.closing:
            self._terminate(reason)

    def close(self) -> None:
        """Take the node from the network."""
        self._end("")
