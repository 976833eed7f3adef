"""What a rospy program begins with, and asks about itself and others (ROS wiki, rospy/Overview)."""

from __future__ import annotations

import os
import sys
import threading
import time
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rosz import names
from rosz.node import Node
from rosz.node.log_handlers import RosoutHandler
from rosz.node.standard import serve_loggers
from rosz.ros1.rospy.absent import attribute
from rosz.ros1.rospy.core import signal_shutdown, wait_for_shutdown
from rosz.ros1.rospy.exceptions import ROSException, ROSInitException
from rosz.ros1.rospy.logs import (
    DEBUG,
    ERROR,
    FATAL,
    INFO,
    LEVELS,
    WARN,
    Bridge,
    logdebug,
    logerr,
    loginfo,
    logwarn,
)
from rosz.ros1.rospy.params import (
    delete_param,
    get_param,
    get_param_cached,
    get_param_names,
    has_param,
    search_param,
    set_param,
)
from rosz.ros1.rospy.signals import chain
from rosz.ros1.rospy.state import arguments, context, run_hooks, set_arguments, state

if TYPE_CHECKING:
    from rosz.ros1.rospy.msproxy import MasterProxy

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
    "search_param",
    "set_param",
    "spin",
)


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
        disable_rostime: Accepted; programs without time to follow do not pay for it here.
        disable_rosout: Whether to keep the log from ``/rosout``.
        disable_signals: Whether to leave Ctrl-C and SIGTERM to the program.
        xmlrpc_port: Accepted; there is no such port.
        tcpros_port: Accepted; there is no such port.

    Raises:
        ValueError: The name is empty, or has a namespace in it.
        ROSException: There is a node, made with other arguments.
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
        node = _begin(name, anonymous=anonymous, log_level=log_level, signals=not disable_signals)
        state.init_call = call
    if not disable_signals:
        chain()
    if disable_rosout:
        for sink in node.log.handlers[:]:
            if isinstance(sink, RosoutHandler):
                node.log.removeHandler(sink)


def _begin(name: str, *, anonymous: bool, log_level: int | None, signals: bool) -> Node:
    if not names.is_valid(name) or names.is_private(name):
        warnings.warn(
            f"'{name}' is not a legal ROS base name. This may cause problems with other ROS tools.",
            stacklevel=3,
        )
    if anonymous and "__name" not in arguments().special:
        name = f"{name}_{os.getpid()}_{time.time_ns() // 1_000_000}"
    shared = context()
    node = Node(name, context=shared, handle_signals=signals)
    if log_level is not None:
        node.log.setLevel(LEVELS[log_level])
    node.on_shutdown(_ended)
    state.node = node
    Bridge.install(node.log.level)
    serve_loggers(node)
    waiting, state.waiting = state.waiting, []
    for act in waiting:
        act(node)
    return node


def _ended(reason: str) -> None:
    """End the process's part when its node was told to end, as by a newer one of its name."""
    run_hooks(reason)
    if state.context is not None and not state.context.is_shutdown:
        # Not here: this runs while the node closes, which the context would wait for.
        end = threading.Thread(
            target=state.context.shutdown, args=(reason,), name="rosz-rospy-end", daemon=True
        )
        end.start()


def spin() -> None:
    """Wait until the node is shut down; callbacks run on threads of their own meanwhile.

    Raises:
        ROSInitException: ``init_node`` has not been called.
    """
    if state.node is None:
        raise ROSInitException("client code must call rospy.init_node() first")
    try:
        wait_for_shutdown()
    except KeyboardInterrupt:  # where the program has not left signals to the node
        signal_shutdown("keyboard interrupt")


def myargv(argv: Sequence[str] | None = None) -> list[str]:
    """Return a command line without what is meant for ROS.

    Args:
        argv: The command line; that of the process when not given.
    """
    return [one for one in (sys.argv if argv is None else argv) if ":=" not in one]


def get_published_topics(namespace: str = "/") -> list[list[str]]:
    """Return the topics that somebody publishes on, each with its type.

    Args:
        namespace: Only those in there.
    """
    topics: list[list[str]] = get_master().getPublishedTopics(namespace)[2]
    return topics


def get_master(env: dict[str, str] | None = None) -> MasterProxy:  # noqa: ARG001
    """Return what answers as a master would."""
    from rosz.ros1.rospy.msproxy import MasterProxy

    return MasterProxy()


__getattr__ = attribute(
    __name__,
    {"wait_for_message": "rosz.ros1.rospy.proxy", "on_shutdown": "rosz.ros1.rospy.core"},
)
