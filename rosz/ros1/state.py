"""The process-wide state of the ROS 1 modules: in rospy one process is one node.

No other module of rosz has process-wide state. Entities that a program creates before ``init_node``
wait here for the node. Modules such as rosnode and rosparam work without a node; they use the
context here.
"""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Sequence
from types import FrameType
from typing import TYPE_CHECKING, Any, TypeVar

from rosz import remap
from rosz.errors import ClosedError
from rosz.lifecycle import Lifecycle
from rosz.node import Clock, Context, Node
from rosz.params.replica import Params
from rosz.program import own
from rosz.ros1.exceptions import ROSInitException
from rosz.wire import Token

if TYPE_CHECKING:
    from rosz.graph import View
    from rosz.introspect import Survey
    from rosz.message import Message

T = TypeVar("T")

NO_NODE = "client code must call rospy.init_node() first"
"""Text of the error of functions that need the node."""

UNNAMED = "/unnamed"
"""Name of the node before ``init_node``."""

_READY_SECONDS = 2.0


class State:
    """The variables of the process.

    Attributes:
        lock: Lock that is held while an attribute changes.
        context: Connection to the network; None until it is needed.
        node: The node; None before ``init_node``.
        unnamed: Node that calls services before ``init_node``.
        arguments: Command line of ``init_node``, or that of the process.
        params: Parameters as seen before ``init_node``.
        init_call: Arguments of ``init_node``, which a second call must repeat.
        waiting: Functions to call with the node as soon as it exists, in order.
        clock: Clock before ``init_node``, if a program has initialized the time by itself.
        publishers: Shared publishers of rospy, by topic and message class.
        subscriptions: Shared subscriptions of rospy, by topic and message class.
        services: Services of this process, by name.
        python_level: Level of Python's logger ``rosout`` when it was last read.
        local: Per thread, the message that is being delivered and its origin.
        lifecycle: Whether the shutdown hooks run or have run.
        hooks: Shutdown hooks by stage, in order of registration.
        hook_thread: The thread that runs the shutdown hooks.
        is_shutdown: Whether the hooks of the program, those of the first stage, have run.
    """

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.context: Context | None = None
        self.node: Node | None = None
        self.unnamed: Node | None = None
        self.arguments: remap.Arguments | None = None
        self.params: Params | None = None
        self.init_call: tuple[Any, ...] | None = None
        self.clock: Clock | None = None
        self.waiting: list[Callable[[Node], object]] = []
        self.publishers: dict[tuple[str, type[Any]], Any] = {}
        self.subscriptions: dict[tuple[str, type[Any]], Any] = {}
        self.services: dict[str, Any] = {}
        self.python_level = 0
        self.local = threading.local()
        self.lifecycle = Lifecycle("the node of rospy")
        self.hooks: dict[str, list[Callable[..., object]]] = {
            "client": [],
            "preshutdown": [],
            "shutdown": [],
        }
        self.hook_thread: threading.Thread | None = None
        self.is_shutdown = False


state = State()
"""The state of this process."""


class _ProgramState(State):
    """The state of the program of the calling thread, where a process runs several."""

    def __getattr__(self, name: str) -> Any:
        return getattr(own(State, _outside), name)

    def __setattr__(self, name: str, value: object) -> None:
        setattr(own(State, _outside), name, value)


_outside = State()


def separate_states() -> None:
    """Give each program of the process a state of its own; see `rosz.program`."""
    vars(state).clear()
    state.__class__ = _ProgramState


class _Context(Context):
    """A context that runs rospy's shutdown hooks first, while everything still works.

    As in rospy, a signal begins the shutdown and raises nothing: a program ends when it sees that.
    Messages that its nodes receive have tuples for sequences of numbers.
    """

    def decoder(self, message_type: type[Message]) -> Callable[[bytes], Any]:
        """Return the function that decodes messages of a class as ROS 1 code knows them."""
        from rosz.message import tuple_decoder

        return tuple_decoder(message_type)

    def shutdown(self, reason: str = "") -> None:
        """Run rospy's hooks, then shut down; shutting down again is not an error."""
        run_hooks(reason or self.reason or "atexit")
        super().shutdown(reason)

    def pause_main_thread(self, frame: FrameType | None) -> None:
        """Let the hooks run alone, as in rospy, where they run in the signal handler.

        Not where the main thread may hold a lock that the hooks need: in rosz and in logging.
        There it goes on until it asks `is_shutdown`.
        """
        while frame is not None and (name := frame.f_globals.get("__name__")) != "__main__":
            if str(name).partition(".")[0] in {"rosz", "logging"}:
                return
            frame = frame.f_back
        if state.lifecycle.wait_closing(_READY_SECONDS):
            run_hooks(self.reason)


def run_hooks(reason: str) -> None:
    """Run the shutdown hooks once, in order of registration.

    As in rospy, the node does not count as shut down while the hooks of the program run, so they
    may publish, call services and sleep. A second caller waits for the first.

    The reason is a text, or the name of a signal.
    """
    if reason in signal.Signals.__members__:
        reason = f"signal-{signal.Signals[reason].value}"
    state.lifecycle.close(lambda: _run_hooks(reason))


def _run_hooks(reason: str) -> None:
    state.hook_thread = threading.current_thread()
    try:
        for hook in state.hooks["client"]:
            _call(hook)
        state.is_shutdown = True
        for hook in (*state.hooks["preshutdown"], *state.hooks["shutdown"]):
            _call(hook, reason)
    finally:
        state.is_shutdown = True


def _call(hook: Callable[..., object], *args: str) -> None:
    try:
        hook(*args)
    except (Exception, SystemExit) as error:  # noqa: BLE001  # the callback boundary
        if state.node is not None:
            state.node.log.report(f"shutdown hook {hook!r} failed", error)
        else:
            sys.excepthook(type(error), error, error.__traceback__)


def arguments() -> remap.Arguments:
    """Return the parsed command line."""
    if state.arguments is None:
        state.arguments = remap.parse(sys.argv[1:])
    return state.arguments


def set_arguments(argv: Sequence[str]) -> None:
    """Replace the command line of the process, which has no program name."""
    with state.lock:
        state.arguments = remap.parse(argv)
        if state.context is not None:
            state.context.arguments = state.arguments


def context() -> Context:
    """Return the context of the process, opened on first use and closed at exit.

    Raises:
        TransportError: The session cannot be opened.
        UsageError: An environment variable has an invalid value.
    """
    with state.lock:
        if state.context is None:
            opened = _Context()
            opened.arguments = arguments()
            opened.cooperative = True
            state.context = opened
        return state.context


def ready_context() -> Context:
    """Return the context once it is linked to its neighbours, or after 2 seconds."""
    opened = context()
    opened.mesh.ready.wait(_READY_SECONDS)
    return opened


def survey() -> Survey:
    """Return the nodes and endpoints that are alive now; after the shutdown, those known last.

    Raises:
        TransportError: The session cannot be opened.
        WaitTimeout: The network does not answer.
    """
    from rosz.introspect import Survey

    opened = ready_context()
    try:
        view = opened.graph.refresh()
    except ClosedError:  # threads of a program look at the graph while it ends
        view = opened.graph.known()
    return Survey(opened.domain, view, {(p.zid, p.node_id): p for p in view.processes()})


def find(look: Callable[[View], T]) -> T:
    """Return the result of a function of the graph; after the shutdown, of its last state.

    Args:
        look: Function that raises `NotFoundError` if its object is not there.

    Raises:
        NotFoundError: It is not there.
        TransportError: The session cannot be opened.
    """
    opened = ready_context()
    try:
        return opened.graph.find(look)
    except ClosedError:
        return look(opened.graph.known())


def node_uri(zid: str, node_id: int, host: str) -> str:
    """Return the URI of a node.

    In ROS 1 it is the address of the node's XML-RPC server. Here nothing listens there.
    """
    return f"rosz://{host}/{zid}/{node_id}"


def token_uri(alive: Survey, token: Token) -> str:
    """Return the URI of the node of a token; the host of a ROS 2 node is ``unknown``."""
    process = alive.process(token)
    return node_uri(token.zid, token.node_id, process.host if process else "unknown")


def has_node() -> bool:
    """Return whether ``init_node`` has been called."""
    return state.node is not None


def node() -> Node:
    """Return the node of this process.

    Raises:
        ROSInitException: ``init_node`` has not been called.
    """
    if state.node is None:
        raise ROSInitException(NO_NODE)
    return state.node


def clock() -> Clock:
    """Return the clock of the node; raise a ROSInitException before ``init_node``."""
    if state.node is not None:
        return state.node.clock
    if state.clock is None:
        raise ROSInitException("time is not initialized. Have you called init_node()?")
    return state.clock


def unnamed_node() -> Node:
    """Return the node, or before ``init_node`` an anonymous node that can call services."""
    if state.node is not None:
        return state.node
    with state.lock:
        if state.unnamed is None:
            # With a unique name: of two nodes of one name, the older one is shut down.
            state.unnamed = Node(UNNAMED.strip("/"), anonymous=True, context=context())
        return state.unnamed


def params() -> Params:
    """Return the parameters as the node sees them; as ``/unnamed`` does before ``init_node``."""
    if state.node is not None:
        return state.node.params
    with state.lock:
        if state.params is None:
            state.params = Params(context().params, UNNAMED, arguments().resolved_remaps(UNNAMED))
        return state.params


def params_of(name: str) -> Params:
    """Return the parameters as the node of a full name sees them, without remappings."""
    return Params(ready_context().params, name)


def is_shutdown() -> bool:
    """Return whether the node is shut down."""
    return state.is_shutdown or (state.context is not None and state.context.is_shutdown)


def when_ready(act: Callable[[Node], object]) -> None:
    """Call a function with the node: now, or in ``init_node``; not at all after the shutdown."""
    if is_shutdown():
        return
    with state.lock:
        if state.node is None:
            state.waiting.append(act)
            return
    try:
        act(state.node)
    except ClosedError:
        # The shutdown may have begun since the first check.
        if not is_shutdown():
            raise
