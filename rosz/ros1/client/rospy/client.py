"""rospy.client: ``init_node``, ``spin``, parameters and the master (ROS wiki, rospy/Overview)."""

from __future__ import annotations

import os
import re
import sys
import threading
import time
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rosz.errors import InvalidName, ParamError, ParamNotFound
from rosz.node import Node, RosoutHandler, serve_loggers
from rosz.ros1.client.rospy.core import (
    DEBUG,
    ERROR,
    FATAL,
    INFO,
    LEVELS,
    SLICE,
    WARN,
    PythonLogHandler,
    chain_signals,
    check_running,
    deadline_of,
    logdebug,
    logerr,
    loginfo,
    logwarn,
    on_shutdown,
    signal_shutdown,
    wait_for_shutdown,
    warn_of_illegal_name,
)
from rosz.ros1.client.rospy.names import get_namespace
from rosz.ros1.client.rospy.topics import Subscriber
from rosz.ros1.exceptions import ROSException, ROSInitException, raised_as
from rosz.ros1.state import NO_NODE, arguments, context, params, run_hooks, set_arguments, state
from rosz.ros1.tools.rosgraph.names import REMAP, is_legal_remap
from rosz.time import DurationValue

if TYPE_CHECKING:
    from rosz.ros1.client.rospy.msproxy import MasterProxy

__all__ = (
    "DEBUG",
    "ERROR",
    "FATAL",
    "INFO",
    "WARN",
    "delete_param",
    "get_master",
    "get_param",
    "get_param_cached",
    "get_param_names",
    "get_published_topics",
    "has_param",
    "init_node",
    "logdebug",
    "logerr",
    "loginfo",
    "logwarn",
    "myargv",
    "on_shutdown",
    "search_param",
    "set_param",
    "spin",
    "wait_for_message",
)


class _Unspecified:
    """Stands for a default that is not given, as in rospy."""


_UNSET: Any = _Unspecified


def init_node(  # noqa: PLR0917  # rospy's signature
    name: str,
    argv: Sequence[str] | None = None,
    anonymous: bool = False,
    log_level: int | None = None,
    disable_rostime: bool = False,
    disable_rosout: bool = False,
    disable_signals: bool = False,
    xmlrpc_port: int = 0,  # noqa: ARG001
    tcpros_port: int = 0,  # noqa: ARG001
) -> None:
    """Make this process a node.

    Args:
        name: Base name; ``__name:=`` on the command line overrides it.
        argv: Command line; that of the process when not given.
        anonymous: Whether to make the name unique.
        log_level: Least level that is logged, such as ``rospy.DEBUG``.
        disable_rostime: Ignored; ROS time costs nothing unless it is simulated.
        disable_rosout: Whether to keep log messages from ``/rosout``.
        disable_signals: Whether the program handles Ctrl-C and SIGTERM itself.
        xmlrpc_port: Ignored; there is no such port.
        tcpros_port: Ignored; there is no such port.

    Raises:
        ValueError: The name is empty, or has a namespace.
        ROSException: The process is a node already, with other arguments.
    """
    if not name:
        raise ValueError("name must not be empty")
    if "/" in name:
        raise ValueError("namespaces are not allowed in node names")
    command = list(sys.argv if argv is None else argv)
    call = (name, command, anonymous, log_level, disable_rostime, disable_signals)
    with state.lock:
        if state.init_call is not None:
            if state.init_call != call:
                raise ROSException(
                    "rospy.init_node() has already been called with different arguments:"
                    f" {state.init_call}"
                )
            return
        if argv is not None:
            set_arguments(command)
        node = _open(name, anonymous=anonymous, log_level=log_level, signals=not disable_signals)
        state.init_call = call
    if not disable_signals:
        chain_signals()
    if disable_rosout:
        for sink in node.log.handlers[:]:
            if isinstance(sink, RosoutHandler):
                node.log.removeHandler(sink)


def _open(name: str, *, anonymous: bool, log_level: int | None, signals: bool) -> Node:
    legal = re.sub("[^A-Za-z0-9_]", "_", name)
    if not legal[0].isalpha():
        legal = f"node_{legal}"
    if legal != name:
        warnings.warn(
            f"'{name}' is not a legal ROS base name. This may cause problems with other ROS tools."
            f" The node is named '{legal}'.",
            stacklevel=3,
        )
        name = legal
    if anonymous and "__name" not in arguments().special:
        name = f"{name}_{os.getpid()}_{time.time_ns() // 1_000_000}"
    node = Node(name, context=context(), handle_signals=signals)
    node.log.publish_as_ros1()
    if log_level is not None:
        node.log.setLevel(LEVELS[log_level])
    node.on_shutdown(_shut_down_process)
    state.node = node
    PythonLogHandler.install(node.log.level)
    serve_loggers(node)
    waiting, state.waiting = state.waiting, []
    for act in waiting:
        act(node)
    return node


def _shut_down_process(reason: str) -> None:
    """Shut down the rest of the process when its node is, as by a new node of the same name."""
    run_hooks(reason)
    if state.context is not None and not state.context.is_shutdown:
        # On another thread: the context waits for the node, whose shutdown calls this.
        thread = threading.Thread(
            target=state.context.shutdown, args=(reason,), name="rosz-rospy-shutdown", daemon=True
        )
        thread.start()


def spin() -> None:
    """Wait until the node is shut down; callbacks run on their own threads.

    Raises:
        ROSInitException: ``init_node`` has not been called.
    """
    if state.node is None:
        raise ROSInitException(NO_NODE)
    try:
        wait_for_shutdown()
    except KeyboardInterrupt:  # the program handles signals itself
        signal_shutdown("keyboard interrupt")


def wait_for_message(
    topic: str, topic_type: type[Any], timeout: float | DurationValue | None = None
) -> Any:
    """Return the next message of a topic.

    Args:
        topic: Name of the topic.
        topic_type: Message class.
        timeout: Time limit in seconds; no limit when not given.

    Raises:
        ROSException: No message came in time.
        UsageError: The timeout is not a number.
        ROSInterruptException: The node was shut down.
    """
    check_running()
    context()
    messages: list[Any] = []
    received = threading.Event()

    def receive(message: Any) -> None:
        messages.append(message)
        received.set()

    deadline = deadline_of(timeout)
    subscriber = Subscriber(topic, topic_type, receive)
    try:
        while not received.wait(min(max(deadline - time.monotonic(), 0.0), SLICE)):
            check_running()
            if time.monotonic() >= deadline:
                raise ROSException(f"timeout exceeded while waiting for message on topic {topic}")
    finally:
        subscriber.unregister()
    return messages[0]


def myargv(argv: Sequence[str] | None = None) -> list[str]:
    """Return a command line without remappings, for the option parser of the program.

    Unlike rosgraph's function it keeps words that only look like one, such as ``-a:=b``.

    Args:
        argv: Command line with the program name; that of the process when not given.
    """
    return [word for word in (sys.argv if argv is None else argv) if not is_legal_remap(word)]


def load_command_line_node_params(argv: Sequence[str]) -> dict[str, Any]:
    """Return the private parameters of a command line, such as ``_rate:=5``, as YAML values.

    Raises:
        ROSInitException: An argument cannot be read.
    """
    import yaml

    parameters: dict[str, Any] = {}
    for word in filter(is_legal_remap, argv):
        name, *values = (part.strip() for part in word.split(REMAP))
        if len(values) != 1:
            raise ROSInitException(f"invalid command-line parameters: expected one := in '{word}'")
        if len(name) > 1 and name[0] == "_" != name[1] and values[0]:
            try:
                parameters[name[1:]] = yaml.safe_load(values[0])
            except yaml.YAMLError as error:
                raise ROSInitException(f"invalid command-line parameters: {error}") from error
    return parameters


# The master.


def get_published_topics(namespace: str = "/") -> list[list[str]]:
    """Return the topics that have publishers, with their types.

    Args:
        namespace: Namespace of the topics.
    """
    topics: list[list[str]] = get_master().getPublishedTopics(namespace)[2]
    return topics


def get_master(env: dict[str, str] | None = None) -> MasterProxy:  # noqa: ARG001
    """Return an object with the methods of ROS 1's Master API."""
    from rosz.ros1.client.rospy.msproxy import MasterProxy

    return MasterProxy()


# Parameters (ROS wiki, rospy/Overview/Parameter Server).


def get_param(param_name: str, default: Any = _UNSET) -> Any:
    """Return a parameter.

    Args:
        param_name: Name of the parameter; that of a namespace returns a dictionary.
        default: Value to return if the parameter is not set.

    Raises:
        KeyError: The parameter is not set, and there is no default.
    """
    if not isinstance(param_name, str) and param_name is not None:
        if default is _UNSET:
            raise KeyError(param_name)
        return default
    try:
        return params().get(param_name or get_namespace())
    except (ParamNotFound, InvalidName):
        if default is not _UNSET:
            return default
        raise KeyError(param_name) from None


get_param_cached = get_param
"""Every read is a look-up in the memory of the process."""


def set_param(param_name: str, param_value: Any) -> None:
    """Set a parameter; a dictionary replaces everything below the name.

    Raises:
        TypeError: A parameter cannot have this value.
    """
    if not isinstance(param_name, str):
        raise TypeError(f"expected a name, got {type(param_name).__name__} {param_name!r}")
    warn_of_illegal_name(param_name, 2)
    with raised_as(TypeError, ParamError):
        params().set(param_name or get_namespace(), param_value)


def has_param(param_name: str) -> bool:
    """Return whether a parameter, or any parameter below the name, is set."""
    return params().has(param_name or get_namespace())


def delete_param(param_name: str) -> None:
    """Delete a parameter and all parameters below it.

    Raises:
        KeyError: The parameter is not set.
    """
    try:
        params().delete(param_name or get_namespace())
    except (ParamNotFound, ParamError):
        raise KeyError(param_name) from None


def search_param(param_name: str) -> str | None:
    """Search a parameter in the node's namespace, then in each namespace above it.

    Args:
        param_name: Relative name.

    Returns:
        The full name of the parameter, or None if it is not set.

    Raises:
        ROSException: The name is private.
    """
    if not param_name:
        return None
    with raised_as(ROSException, ParamError):
        return params().search(param_name)


def get_param_names() -> list[str]:
    """Return the full names of all parameters."""
    return params().names()
