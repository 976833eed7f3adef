"""What rclpy offers to a whole program: beginning, spinning, end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from rosz.ros2.rclpy import state
from rosz.ros2.rclpy.context import Context
from rosz.ros2.rclpy.executors import Executor
from rosz.ros2.rclpy.node import Node
from rosz.ros2.rclpy.task import Future

__all__ = (
    "create_node",
    "get_default_context",
    "get_global_executor",
    "init",
    "ok",
    "shutdown",
    "spin",
    "spin_once",
    "spin_until_future_complete",
    "try_shutdown",
)


def init(
    *,
    args: Sequence[str] | None = None,
    context: Context | None = None,
    domain_id: int | None = None,
    signal_handler_options: Any = None,  # noqa: ARG001  # rclpy's
) -> Context:
    """Join the network; to be called before anything else.

    Args:
        args: Command line with the program's name; that of the process when not given.
        context: What to begin; the default one when not given.
        domain_id: The ROS domain; by the environment when not given.
        signal_handler_options: Not used: Ctrl-C raises ``KeyboardInterrupt``, and SIGTERM ends the
            context.

    Returns:
        The context, which is shut down at the end of a ``with`` block.

    Raises:
        UsageError: It has begun already, or the command line has something that means nothing.
        TransportError: The network cannot be joined.
    """
    chosen = context or state.default_context()
    chosen.init(args, domain_id=domain_id)
    return chosen


def shutdown(*, context: Context | None = None, uninstall_handlers: bool | None = None) -> None:  # noqa: ARG001
    """End everything; again is no error."""
    (context or state.default_context()).shutdown()


def try_shutdown(*, context: Context | None = None) -> None:
    """End everything; again is no error."""
    shutdown(context=context)


def ok(*, context: Context | None = None) -> bool:
    """Tell whether ``init`` was called, and ``shutdown`` was not."""
    return (context or state.default_context()).ok()


def get_default_context() -> Context:
    """Return the context that is meant when none is given."""
    return state.default_context()


def get_global_executor() -> Executor:
    """Return the executor that is meant when none is given."""
    return state.global_executor()


def create_node(node_name: str, **options: Any) -> Node:
    """Return a node; see `rclpy.node.Node`."""
    return Node(node_name, **options)


def spin(node: Node, executor: Executor | None = None) -> None:
    """Call a node's callbacks until the context is shut down.

    Args:
        node: It.
        executor: Who calls them; the global one when not given.

    Raises:
        ExternalShutdownException: A signal shut the context down.
    """
    _with(node, executor, lambda chosen: chosen.spin())


def spin_once(
    node: Node, *, executor: Executor | None = None, timeout_sec: float | None = None
) -> None:
    """Wait until one of a node's callbacks is to be called, and call it.

    Args:
        node: It.
        executor: Who calls them; the global one when not given.
        timeout_sec: Seconds to wait at most; for ever when not given.
    """
    _with(node, executor, lambda chosen: chosen.spin_once(timeout_sec))


def spin_until_future_complete(
    node: Node,
    future: Future,
    executor: Executor | None = None,
    timeout_sec: float | None = None,
) -> None:
    """Call a node's callbacks until a future is done.

    Args:
        node: It.
        future: The future.
        executor: Who calls them; the global one when not given.
        timeout_sec: Seconds after which to give up; never when not given.
    """
    _with(node, executor, lambda chosen: chosen.spin_until_future_complete(future, timeout_sec))


def _with(node: Node, executor: Executor | None, act: Callable[[Executor], None]) -> None:
    chosen = executor or node.executor or state.global_executor()
    added = chosen.add_node(node)
    try:
        act(chosen)
    finally:
        if added:
            chosen.remove_node(node)
