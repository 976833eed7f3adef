"""The core of a node: its identity, what it shares with others, and its lifecycle.

Publishers, subscriptions, services, clients and timers build on it; `rosz.node.node.Node` adds the
methods that make them.
"""

from __future__ import annotations

import os
import socket
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from rosz import names
from rosz.errors import ClosedError
from rosz.lifecycle import Closable, Closing, Hook, Lifecycle, Registration
from rosz.node.clock import Clock
from rosz.node.context import Context
from rosz.node.log import NodeLog
from rosz.node.log_handlers import DEFAULT_FORMAT
from rosz.program import Program, current
from rosz.wire import Kind, ProcessToken, Token, format_process, format_token

if TYPE_CHECKING:
    from rosz.params.replica import Params

P = TypeVar("P", bound=Closable)


class ParameterOwner(Protocol):
    """A program that decides on the parameters of its node, as those of rclpy do."""

    def describe(self, names: Sequence[str]) -> list[Any]:
        """Return the descriptors of parameters; none if one is not declared."""

    def change(self, parameters: Sequence[Any]) -> Any:
        """Set all parameters or none, and return the result for the one who asked."""


class NodeCore(Closing):
    """A node without the methods that make publishers, subscriptions, services and timers.

    For its arguments see `rosz.Node`.

    Attributes:
        name: Full name.
        namespace: Namespace; ``/`` for the root.
        base_name: Name without the namespace.
        context: The context.
        remaps: Remappings of the command line, resolved for this node.
        node_id: Number of the node within its session.
        began: Time of the start by the monotonic clock, in seconds.
        clock: Clock of the node, closed with it.
        time_topic: Subscription of ``/clock``, while time is simulated.
        log: Log of the node.
        process: Token of the process of the node.
        program: The program that made the node, if the process runs several.
        parameter_owner: Who decides on its parameters; anybody may set them if None.
    """

    def __init__(
        self,
        name: str,
        *,
        namespace: str | None = None,
        anonymous: bool = False,
        context: Context | None = None,
        argv: Sequence[str] | None = None,
        number: int | None = None,
        started: int | None = None,
    ) -> None:
        self._owns_context = context is None
        self.program: Program | None = current()
        self.parameter_owner: ParameterOwner | None = None
        if anonymous:
            # ROS 1 counts milliseconds, but has one node in a process.
            name = names.anonymous(name, socket.gethostname(), os.getpid(), time.time_ns())
        names.check_base(name)
        self.context: Context = context or Context(argv=sys.argv[1:] if argv is None else argv)
        self._params: Params | None = None
        try:
            self._identify(name, namespace, number, started)
        except BaseException:
            if self._owns_context:
                self.context.close()
            raise

    def _identify(
        self, name: str, namespace: str | None, number: int | None, started: int | None
    ) -> None:
        context = self.context
        environment, arguments = context.environment, context.arguments
        default = environment.namespace if namespace is None else namespace
        self.name: str = arguments.node_name(name, default)
        self.namespace: str = names.namespace(self.name).rstrip("/") or "/"
        self.base_name: str = names.basename(self.name)
        self.remaps: Mapping[str, str] = arguments.resolved_remaps(self.name)
        self.node_id: int = context.next_id() if number is None else number
        self.began: float = time.monotonic()
        self.process: ProcessToken = ProcessToken(
            context.domain,
            context.session.zid,
            self.node_id,
            context.session.stamp().time if started is None else started,
            os.getpid(),
            socket.gethostname(),
            self.name,
        )
        self.clock: Clock = context.clock.branch(apart=True)
        self.time_topic: Closable | None = None
        self.log: NodeLog = NodeLog(
            self.name,
            clock=self.clock,
            log_dir=environment.log_dir,
            file_name=arguments.special.get("__log", ""),
            console_format=environment.console_format or DEFAULT_FORMAT,
            color=environment.color,
        )
        self._lifecycle = Lifecycle(f"node '{self.name}'", log=self.log)
        self._lifecycle.keep(self.log)
        self._remove_hook = context.on_shutdown(self._end)

    def _announce(self) -> None:
        """Make the node known: to ROS 2 by one token, to rosz by that of its process."""
        session = self.context.session
        token = Token(
            self.context.domain,
            session.zid,
            self.node_id,
            self.node_id,
            Kind.NODE,
            self.namespace,
            self.base_name,
        )
        # The token of the process goes last: a session without one is offered ROS 2's services.
        for key in (format_process(self.process), format_token(token)):
            self.keep(session.token(key))

    @property
    def params(self) -> Params:
        """The parameter store as this node sees it; the process becomes a replica on first use.

        Raises:
            ClosedError: The context is shut down, and has no replica.
        """
        if self._params is None:
            from rosz.params.replica import Params

            self._params = Params(self.context.params, self.name, self.remaps)
        return self._params

    def resolve(self, name: str) -> str:
        """Return the global name that a name means in this node, after remapping.

        Raises:
            InvalidName: The name is not legal.
        """
        return names.resolve(name, self.name, self.remaps)

    def listen(self, listener: Callable[[Token, bool], None]) -> Closable:
        """Follow the graph; see `rosz.graph.Graph.listen`."""
        return Registration(self.context.graph.listen(listener))

    def spin(self) -> None:
        """Wait until the node is shut down; callbacks run on threads of their own meanwhile."""
        self.context.cooperative = True
        self._lifecycle.wait_closing()

    @property
    def is_shutdown(self) -> bool:
        """Whether the node has been closed or its context shut down."""
        self.context.cooperative = True
        return self._lifecycle.closing or self.context.is_shutdown

    def on_shutdown(self, hook: Hook) -> None:
        """Call a function with the reason when the node ends, before its parts are closed.

        If the node is ending already, the function is called at once, as in rospy.
        """
        try:
            self._lifecycle.on_close(hook)
        except ClosedError:
            self._lifecycle.call(hook)

    def keep(self, part: P) -> P:
        """Close something when the node ends, before what was declared earlier.

        Raises:
            ClosedError: The node is closed; the part has been closed.
        """
        return self._lifecycle.keep(part)

    def forget(self, part: Closable) -> None:
        """Remove a part that was closed on its own."""
        self._lifecycle.forget(part)

    def shutdown(self, reason: str = "") -> None:
        """End the node, and its context if it owns that; a second call has no effect."""
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
        leaving = self._owns_context or context.is_shutdown
        with context.close_links() if leaving else nullcontext():
            closed = self._lifecycle.close(
                self.log.flush, first=self.clock.close, reason=reason or context.reason
            )
        if closed:  # until then a context that shuts down on another thread waits for this one
            self._remove_hook()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name}{' closed' if self._lifecycle.closing else ''}>"
