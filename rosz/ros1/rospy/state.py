"""The process-wide state of rospy, whose functions all mean "this process's one node".

Nothing else in rosz keeps any. Whatever is made before ``init_node`` waits here for the node.
"""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Sequence
from typing import Any

from rosz import remap
from rosz.errors import ClosedError
from rosz.node import Context, Node
from rosz.params.api import Params
from rosz.ros1.rospy.exceptions import ROSInitException

__all__ = (
    "UNNAMED",
    "State",
    "arguments",
    "context",
    "cooperate",
    "has_node",
    "helper",
    "is_shutdown",
    "node",
    "params",
    "run_hooks",
    "set_arguments",
    "state",
    "when_ready",
)

_ENDED_BY = 10.0
"""Seconds that whoever ends the node a second time waits for the first, and its hooks."""

UNNAMED = "/unnamed"
"""Name of the node before there is one."""


class State:
    """All that rospy remembers.

    Attributes:
        lock: Held while any of this is changed.
        context: What the process shares with the network, once something needed it.
        node: The node, once there is one.
        helper: What stands in for it before, where a service is called so early.
        arguments: The command line that ``init_node`` was given, else that of the process.
        params: Parameters as seen before there is a node.
        init_call: The arguments of ``init_node``, which a second call must repeat.
        waiting: What to do as soon as there is a node, in order.
        sources: Topics that this process publishes on, by name and class of messages.
        sinks: Topics that it subscribes to, by name and class of messages.
        services: Services of this process, by name.
        python_level: Level of Python's logger ``rosout`` when last looked at.
        local: Of each thread, the message that it is delivering, and what tells its origin.
        hooks: What to call when the node shuts down, by the stage it belongs to, in order.
        shutdown: Set when the end has begun, and the program's own hooks have been called.
        ended: Set when all hooks have been called.
        ender: The thread that calls them.
    """

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.context: Context | None = None
        self.node: Node | None = None
        self.helper: Node | None = None
        self.arguments: remap.Arguments | None = None
        self.params: Params | None = None
        self.init_call: tuple[Any, ...] | None = None
        self.waiting: list[Callable[[Node], object]] = []
        self.sources: dict[tuple[str, type[Any]], Any] = {}
        self.sinks: dict[tuple[str, type[Any]], Any] = {}
        self.services: dict[str, Any] = {}
        self.python_level = 0
        self.local = threading.local()
        self.hooks: dict[str, list[Callable[..., object]]] = {
            "client": [],
            "preshutdown": [],
            "shutdown": [],
        }
        self.shutdown = threading.Event()
        self.ended = threading.Event()
        self.ender: threading.Thread | None = None


state = State()
"""The one there is."""


class _Context(Context):
    """A context whose end begins with rospy's hooks, while everything still works."""

    def shutdown(self, reason: str = "") -> None:
        """End everything: rospy's hooks first; again is no error."""
        run_hooks(reason or self.reason or "atexit")
        super().shutdown(reason)


def run_hooks(reason: str) -> None:
    """Call all that wants to know of the end, once, in the order of registration.

    As in rospy, while a program's own hooks run the node is not yet said to be shut down, so that
    they may publish, call services and sleep. Who comes second waits for the first.

    Args:
        reason: Why, as a text or as the name of a signal.
    """
    if reason in signal.Signals.__members__:
        reason = f"signal-{signal.Signals[reason].value}"
    with state.lock:
        first = state.ender is None
        if first:
            state.ender = threading.current_thread()
    if not first:
        if threading.current_thread() is not state.ender:
            state.ended.wait(_ENDED_BY)
        return
    try:
        for hook in state.hooks["client"]:
            _call(hook)
        state.shutdown.set()
        for hook in (*state.hooks["preshutdown"], *state.hooks["shutdown"]):
            _call(hook, reason)
    finally:
        state.shutdown.set()
        state.ended.set()


def _call(hook: Callable[..., object], *args: str) -> None:
    try:
        hook(*args)
    except (Exception, SystemExit) as error:  # noqa: BLE001  # the callback boundary
        if state.node is not None:
            state.node.log.report(f"shutdown hook {hook!r} failed", error)
        else:
            sys.excepthook(type(error), error, error.__traceback__)


def arguments() -> remap.Arguments:
    """Return the command line, sorted by meaning."""
    if state.arguments is None:
        state.arguments = remap.parse(sys.argv[1:])
    return state.arguments


def set_arguments(argv: Sequence[str]) -> None:
    """Take another command line than that of the process, without a program's name."""
    with state.lock:
        state.arguments = remap.parse(argv)
        if state.context is not None:
            state.context.arguments = state.arguments


def context() -> Context:
    """Return what the process shares with the network; opened at first use, closed at exit.

    Raises:
        TransportError: The session cannot be opened.
        UsageError: The environment has a value that means nothing.
    """
    with state.lock:
        if state.context is None:
            opened = _Context()
            opened.arguments = arguments()
            state.context = opened
        return state.context


def has_node() -> bool:
    """Tell whether ``init_node`` has been called."""
    return state.node is not None


def node() -> Node:
    """Return the node of this process.

    Raises:
        ROSInitException: ``init_node`` has not been called.
    """
    if state.node is None:
        raise ROSInitException("client code must call rospy.init_node() first")
    return state.node


def params() -> Params:
    """Return the parameters as the node sees them, or as one called ``/unnamed`` does."""
    if state.node is not None:
        return state.node.params
    with state.lock:
        if state.params is None:
            state.params = Params(context().params, UNNAMED, arguments().resolved_remaps(UNNAMED))
        return state.params


def is_shutdown() -> bool:
    """Tell whether the end has begun."""
    return state.shutdown.is_set() or (state.context is not None and state.context.is_shutdown)


def cooperate() -> None:
    """Take note that the program asks for its end, and need not be interrupted by an exception.

    What hooks ask, when the end has begun, tells nothing of the program.
    """
    if state.context is not None and state.ender is None:
        state.context.cooperative = True


def when_ready(act: Callable[[Node], object]) -> None:
    """Have something done with the node: now, or when there is one; never after its end."""
    if is_shutdown():
        return
    with state.lock:
        if state.node is None:
            state.waiting.append(act)
            return
    try:
        act(state.node)
    except ClosedError:
        # The end may have begun since the first look.
        if not is_shutdown():
            raise


def helper() -> Node:
    """Return the node, or, before there is one, a nameless one that can call services."""
    if state.node is not None:
        return state.node
    with state.lock:
        if state.helper is None:
            state.helper = Node(UNNAMED.strip("/"), context=context())
        return state.helper
