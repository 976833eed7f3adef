"""Nodes: what a program is to the rest of the network."""

from __future__ import annotations

import os
import socket
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from typing import TYPE_CHECKING, Any, Self, TypeVar, overload

from rosz import names
from rosz.node import control, signals, standard
from rosz.node.client import Client
from rosz.node.clock import nanoseconds
from rosz.node.context import Context
from rosz.node.ending import Ending, Hook
from rosz.node.endpoint import Withdrawal
from rosz.node.generic import GenericSubscription
from rosz.node.publisher import Publisher
from rosz.node.rate import Rate
from rosz.node.ros2_services import Lookout
from rosz.node.service import Service
from rosz.node.subscription import Subscription
from rosz.node.timer import Timer, TimerEvent
from rosz.qos import SERVICES, QoS, for_queue
from rosz.wire import Token

if TYPE_CHECKING:
    from types import TracebackType

    from rosz.lifecycle import Closable
    from rosz.message import Message
    from rosz.message import Service as ServiceType
    from rosz.params.api import Params

__all__ = ("Node",)

M = TypeVar("M", bound="Message")
P = TypeVar("P", bound="Closable")


class Node:
    """A named part of the system: publishers, subscriptions, services, timers, parameters, a log.

    Args:
        name: Base name; ``__name:=`` on the command line overrides it.
        namespace: Namespace; ``ROS_NAMESPACE`` when not given, and ``__ns:=`` overrides both.
        anonymous: Whether to make the name unique to this process and moment.
        context: What it shares with other nodes of the process; one of its own when not given,
            which is then shut down with the node.
        argv: Command line without the program name; that of the process when not given. Ignored
            with a ``context``, which has read one already.
        handle_signals: Whether Ctrl-C and SIGTERM shut the node down; by default when it has its
            own context. Only the main thread of a program can have that.

    Raises:
        InvalidName: The name or namespace is not legal.
        TransportError: The session cannot be opened.
        UsageError: The environment has a value that means nothing.
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
        self._owns_context = context is None
        if anonymous:
            # ROS 1 counts milliseconds, but has one node in a process.
            name = names.anonymous(name, socket.gethostname(), os.getpid(), time.time_ns())
        names.check_base(name)
        self.context = context or Context(argv=sys.argv[1:] if argv is None else argv)
        self._params: Params | None = None
        try:
            self._begin(name, namespace)
        except BaseException:
            if self._owns_context:
                self.context.close()
            raise
        if self._owns_context if handle_signals is None else handle_signals:
            signals.install(self.context)

    def _begin(self, name: str, namespace: str | None) -> None:
        context = self.context
        arguments = context.arguments
        default = context.environment.namespace if namespace is None else namespace
        self.name = arguments.node_name(name, default)
        self.namespace = names.namespace(self.name).rstrip("/") or "/"
        self.base_name = names.basename(self.name)
        self.remaps = arguments.resolved_remaps(self.name)
        self.node_id = context.next_id()
        self.clock = context.clock.branch()
        self.log = standard.log_of(self)
        self._ending = Ending(self.name, self.log)
        self._withdraw = context.on_shutdown(self._end)
        try:
            standard.set_initial_params(self)
            self.process = standard.process_of(self)
            control.attach(self)
            standard.announce(self)
            if not context.passing:
                standard.follow_clock(self)
                self.keep(Lookout(self))
        except BaseException:
            self._end("")
            raise
        standard.open_rosout(self)

    @property
    def params(self) -> Params:
        """The parameter store as this node sees it; the process becomes a replica on first use.

        Raises:
            ClosedError: The context is shut down, and has no replica.
        """
        if self._params is None:
            from rosz.params.api import Params

            self._params = Params(self.context.params, self.name, self.remaps)
        return self._params

    def resolve(self, name: str) -> str:
        """Return the global name that a name means here, remappings applied.

        Raises:
            InvalidName: It is not legal.
        """
        return names.resolve(name, self.name, self.remaps)

    def publisher(
        self,
        topic: str,
        message_type: type[M],
        *,
        queue_size: int = 10,
        latch: bool = False,
        qos: QoS | None = None,
    ) -> Publisher[M]:
        """Declare that this node publishes on a topic.

        Args:
            topic: Name; resolved and remapped.
            message_type: What is published.
            queue_size: Depth of the queue that others are told of; with ``latch`` one sample is
                kept whatever it is.
            latch: Whether late joiners get the last message.
            qos: Instead of both, when given.

        Raises:
            InvalidName: The name is not legal.
            UsageError: The size of the queue means nothing.
            ClosedError: The node is closed.
        """
        if qos is None:
            qos = QoS(depth=1, durability="transient_local") if latch else for_queue(queue_size)
        return self.keep(Publisher(self, self.resolve(topic), message_type, qos))

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
        message_type: None = None,
        callback: Callable[..., Any] | None = None,
        *,
        queue_size: int = 10,
        qos: QoS | None = None,
        raw: bool = False,
        with_info: bool = False,
    ) -> GenericSubscription: ...
    def subscription(
        self,
        topic: str,
        message_type: type[M] | None = None,
        callback: Callable[..., Any] | None = None,
        *,
        queue_size: int = 10,
        qos: QoS | None = None,
        raw: bool = False,
        with_info: bool = False,
    ) -> Subscription[M] | GenericSubscription:
        """Declare that this node listens to a topic.

        Args:
            topic: Name; resolved and remapped.
            message_type: What is expected; when not given, whatever comes, by the definition that
                is known here under the name of its type.
            callback: Gets each message, on a thread of the subscription, one at a time. Without
                one, iterate over the subscription or call its ``get``.
            queue_size: The newest so many samples wait for their turn; older ones are dropped.
            qos: Instead of ``queue_size``, when given.
            raw: Whether to pass the encoded bytes on.
            with_info: Whether the callback also gets a `MessageInfo`.

        Raises:
            InvalidName: The name is not legal.
            UsageError: The size of the queue means nothing.
            ClosedError: The node is closed.
        """
        name, qos = self.resolve(topic), qos or for_queue(queue_size)
        if message_type is None:
            return self.keep(
                GenericSubscription(self, name, callback, qos, raw=raw, with_info=with_info)
            )
        return self.keep(
            Subscription(self, name, message_type, callback, qos, raw=raw, with_info=with_info)
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
            name: Name; resolved and remapped.
            service_type: Its type.
            handler: Gets a request, on a thread of a pool, and returns the response: an instance,
                a list or dictionary of its fields, or its only value. What it raises is logged,
                and told to the caller.
            qos: What others are told.
            threads: Most calls handled at one time.

        Raises:
            InvalidName: The name is not legal.
            UsageError: There are to be no threads.
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
        """Make a caller of a service.

        Args:
            name: Name; resolved and remapped.
            service_type: Its type.
            timeout: Seconds that a call waits at most, unless it says otherwise.
            qos: What others are told.

        Raises:
            InvalidName: The name is not legal.
            UsageError: The timeout is no number.
            ClosedError: The node is closed.
        """
        return self.keep(Client(self, self.resolve(name), service_type, qos, timeout))

    def timer(
        self, period: float, callback: Callable[[TimerEvent], Any], *, oneshot: bool = False
    ) -> Timer:
        """Have a function called every so often.

        Args:
            period: Seconds, in ROS time.
            callback: Gets a `TimerEvent`, on a thread of the timer; what it raises is logged.
            oneshot: Whether to call it only once.

        Raises:
            UsageError: The period is no number above 0.
        """
        with self._ending.lock:  # so that one which ends at once is not forgotten before it is kept
            return self.keep(
                Timer(
                    nanoseconds(period, "timer period"),
                    callback,
                    self.clock,
                    oneshot=oneshot,
                    on_error=self.log.report,
                    on_end=self.forget,
                )
            )

    def rate(self, hz: float) -> Rate:
        """Return a pace-maker: iterate over it, or call its ``sleep``.

        Args:
            hz: Times per second, in ROS time.

        Raises:
            UsageError: `hz` is not above 0, or beyond nanoseconds.
        """
        self.context.cooperative = True
        return Rate(hz, self.clock)

    def now(self) -> int:
        """Return the time in nanoseconds: simulated where ``use_sim_time`` is set, else wall."""
        return self.clock.now()

    def sleep(self, seconds: float) -> bool:
        """Sleep, in ROS time.

        Returns:
            Whether the time was slept through; false when the node was shut down meanwhile.

        Raises:
            UsageError: It is no number, or infinite.
        """
        self.context.cooperative = True
        return self.clock.sleep(nanoseconds(seconds, "a sleep"))

    def spin(self) -> None:
        """Wait until the node is shut down; callbacks run on threads of their own meanwhile."""
        self.context.cooperative = True
        self._ending.begun.wait()

    @property
    def is_shutdown(self) -> bool:
        """Whether the node has been closed or its context shut down."""
        self.context.cooperative = True
        return self._ending.begun.is_set() or self.context.is_shutdown

    def on_shutdown(self, hook: Hook) -> None:
        """Have a function called with the reason when the node ends, before its parts close.

        Where the end has begun already it is called at once, as in rospy.
        """
        self._ending.add_hook(hook)

    def listen(self, listener: Callable[[Token, bool], None]) -> Closable:
        """Follow the graph; see `rosz.graph.Graph.listen`."""
        return Withdrawal(self.context.graph.listen(listener))

    def keep(self, part: P) -> P:
        """Have something closed when the node ends, before what was declared earlier.

        Raises:
            ClosedError: The node is closed; the part is, too, now.
        """
        return self._ending.keep(part)

    def forget(self, part: Closable) -> None:
        """Take note that a part has been closed by itself."""
        self._ending.forget(part)

    def shutdown(self, reason: str = "") -> None:
        """End the node, and its context where it owns that; again is no error."""
        try:
            self._end(reason)
        finally:  # also where Ctrl-C interrupts a hook
            if self._owns_context:
                self.context.shutdown(reason)

    def close(self) -> None:
        """End the node; the same as `shutdown` without a reason."""
        self.shutdown()

    def _end(self, reason: str) -> None:
        context = self.context
        if context.forked:
            return
        leaving = self._owns_context or context.is_shutdown
        with context.session.close_links() if leaving else nullcontext():
            self._ending.come(reason or context.reason, self._stop)

    def _stop(self) -> None:
        self._withdraw()
        self.clock.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Node {self.name}{' closed' if self._ending.begun.is_set() else ''}>"
