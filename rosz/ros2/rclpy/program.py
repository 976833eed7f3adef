"""rclpy's functions for a whole program, rclpy.utilities, and what programs use of ros2cli."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from enum import IntEnum
from typing import Any, TypeVar

from rosz import names
from rosz.errors import ClosedError, WaitTimeout
from rosz.message import Message
from rosz.ros2.rclpy import arguments
from rosz.ros2.rclpy.context import Context, get_default_context
from rosz.ros2.rclpy.executors import Executor, Future, get_global_executor
from rosz.ros2.rclpy.node import Node
from rosz.ros2.rclpy.qos import QoSProfile, to_qos
from rosz.session import LONGEST_WAIT

M = TypeVar("M", bound=Message)


class SignalHandlerOptions(IntEnum):
    """The signals for which rclpy installs handlers; for information only."""

    NO = 0
    SIGINT = 1
    SIGTERM = 2
    ALL = 3


def init(
    *,
    args: Sequence[str] | None = None,
    context: Context | None = None,
    domain_id: int | None = None,
    signal_handler_options: Any = None,  # noqa: ARG001  # rclpy's
) -> Context:
    """Connect to the network; must be called before anything else.

    Args:
        args: Command line with the program name; that of the process when not given.
        context: Context to open; the default one when not given.
        domain_id: ROS domain; by the environment when not given.
        signal_handler_options: Not used: Ctrl-C raises ``KeyboardInterrupt``, and SIGTERM shuts the
            context down.

    Returns:
        The context, which is shut down at the end of a ``with`` block.

    Raises:
        UsageError: The context is open already, or the command line is not valid.
        TransportError: The session cannot be opened.
    """
    chosen = context or get_default_context()
    chosen.init(args, domain_id=domain_id)
    return chosen


def shutdown(*, context: Context | None = None, uninstall_handlers: bool | None = None) -> None:  # noqa: ARG001
    """Close everything; a second call has no effect."""
    (context or get_default_context()).shutdown()


try_shutdown = shutdown


def ok(*, context: Context | None = None) -> bool:
    """Return whether ``init`` was called and ``shutdown`` was not."""
    return (context or get_default_context()).ok()


def create_node(node_name: str, **options: Any) -> Node:
    """Create a node; see `rclpy.node.Node`."""
    return Node(node_name, **options)


def spin(node: Node, executor: Executor | None = None) -> None:
    """Run a node's callbacks until the context is shut down.

    Args:
        node: The node.
        executor: Executor that runs the callbacks; the global one when not given.

    Raises:
        ExternalShutdownException: A signal shut the context down.
    """
    _with(node, executor, lambda chosen: chosen.spin())


def spin_once(
    node: Node, *, executor: Executor | None = None, timeout_sec: float | None = None
) -> None:
    """Wait until one of a node's callbacks is ready, and run it.

    Args:
        node: The node.
        executor: Executor that runs the callback; the global one when not given.
        timeout_sec: Time limit in seconds; none when not given.
    """
    _with(node, executor, lambda chosen: chosen.spin_once(timeout_sec))


def spin_until_future_complete(
    node: Node, future: Future, executor: Executor | None = None, timeout_sec: float | None = None
) -> None:
    """Run a node's callbacks until a future is done.

    Args:
        node: The node.
        future: The future.
        executor: Executor that runs the callbacks; the global one when not given.
        timeout_sec: Time limit in seconds; none when not given.
    """
    _with(node, executor, lambda chosen: chosen.spin_until_future_complete(future, timeout_sec))


def wait_for_message(
    msg_type: type[Any],
    node: Node,
    topic: str,
    *,
    qos_profile: QoSProfile | int = 1,
    time_to_wait: float = -1,
) -> tuple[bool, Any]:
    """Wait for a message of a topic.

    Args:
        msg_type: Class of the message.
        node: Node that subscribes; it need not be spun.
        topic: Name of the topic.
        qos_profile: Profile, or depth of the queue.
        time_to_wait: Time limit in seconds; none if below 0.

    Returns:
        Whether a message came, and the message; None if the time is over or the context ends.
    """
    limit = LONGEST_WAIT if time_to_wait < 0 else time_to_wait
    subscription = node.rosz_node.subscription(topic, msg_type, qos=to_qos(qos_profile))
    try:
        return True, subscription.get(limit)
    except (WaitTimeout, ClosedError):
        return False, None
    finally:
        subscription.close()


def serialize_message(message: Message) -> bytes:
    """Return the CDR bytes of a message.

    Raises:
        EncodeError: A field has a value that does not fit.
    """
    return message.to_cdr()


def deserialize_message(serialized_message: bytes, message_type: type[M]) -> M:
    """Return the message of CDR bytes.

    Raises:
        DecodeError: The bytes are not those of such a message.
    """
    return message_type.from_cdr(serialized_message)


def _with(node: Node, executor: Executor | None, act: Callable[[Executor], None]) -> None:
    chosen = executor or node.executor or get_global_executor()
    added = chosen.add_node(node)
    try:
        act(chosen)
    finally:
        if added:
            chosen.remove_node(node)


def remove_ros_args(args: Sequence[str] | None = None) -> list[str]:
    """Return a command line without its ROS arguments.

    Args:
        args: Command line with the program name; that of the process when not given.
    """
    return arguments.remove_ros_args(sys.argv if args is None else args)


def expand_topic_name(topic_name: str, node_name: str, node_namespace: str) -> str:
    """Return the global name of a topic of a node; an `InvalidName` if it is not legal."""
    return names.resolve(topic_name, names.join(node_namespace, node_name))


def get_rmw_implementation_identifier() -> str:
    """Return the name of the middleware whose wire format rosz uses."""
    return "rmw_zenoh_cpp"


class NodeStrategy:
    """A hidden node of a command, for a ``with`` block; arguments of the command are ignored."""

    def __init__(self, *_args: Any, **_options: Any) -> None:
        self._context = Context()

    def __enter__(self) -> Node:
        self._context.init([])
        return Node(f"_ros2cli_{os.getpid()}", context=self._context)

    def __exit__(self, *_details: object) -> None:
        self._context.shutdown()


def get_topic_names_and_types(
    *, node: Node, include_hidden_topics: bool = False
) -> list[tuple[str, list[str]]]:
    """Return the topics with their types, without those with a part that begins with ``_``."""
    topics = node.get_topic_names_and_types()
    return [topic for topic in topics if include_hidden_topics or "/_" not in topic[0]]
