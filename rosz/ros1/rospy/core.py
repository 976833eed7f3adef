"""The life of rospy's one node: whether it is there, how it ends, who is told.

Everything that ``rospy.core`` is imported for in programs lies here or is shown here.
"""

from __future__ import annotations

import atexit
import os
from collections.abc import Callable
from urllib.parse import urlparse

from rosz.ros1.rospy.absent import attribute
from rosz.ros1.rospy.exceptions import (
    ROSException,
    ROSInitException,
    ROSInterruptException,
    ROSSerializationException,
)
from rosz.ros1.rospy.names import (
    canonicalize_name,
    get_caller_id,
    get_mappings,
    get_name,
    get_namespace,
    get_resolved_mappings,
    remap_name,
    resolve_name,
)
from rosz.ros1.rospy.state import cooperate, run_hooks, state
from rosz.ros1.rospy.state import is_shutdown as ended

__all__ = (
    "ROSException",
    "ROSInitException",
    "ROSInterruptException",
    "ROSSerializationException",
    "add_client_shutdown_hook",
    "add_preshutdown_hook",
    "add_shutdown_hook",
    "canonicalize_name",
    "get_caller_id",
    "get_mappings",
    "get_name",
    "get_namespace",
    "get_node_uri",
    "get_resolved_mappings",
    "get_ros_root",
    "is_initialized",
    "is_shutdown",
    "is_shutdown_requested",
    "on_shutdown",
    "parse_rosrpc_uri",
    "remap_name",
    "resolve_name",
    "rospydebug",
    "rospyerr",
    "rospyinfo",
    "rospywarn",
    "signal_shutdown",
)


_SLICE = 0.5

atexit.register(run_hooks, "atexit")


def is_initialized() -> bool:
    """Tell whether ``init_node`` has been called."""
    return state.node is not None


def is_shutdown() -> bool:
    """Tell whether the end has begun."""
    cooperate()
    return ended()


def is_shutdown_requested() -> bool:
    """Tell whether the end has begun; the same as `is_shutdown`."""
    return is_shutdown()


def signal_shutdown(reason: object) -> None:
    """End the node: hooks are called, then all that it declared is closed. Again is no error.

    Args:
        reason: Why, for the log.
    """
    run_hooks(str(reason))
    if state.context is not None:
        state.context.shutdown(str(reason))


def _add_hook(stage: str, hook: Callable[..., object], *late: str) -> None:
    if not callable(hook):
        raise TypeError(
            f"shutdown hook [{hook}] must be a function or callable object: {type(hook)}"
        )
    with state.lock:
        if not ended():
            state.hooks[stage].append(hook)
            return
    hook(*late)


def add_client_shutdown_hook(h: Callable[[], object]) -> None:
    """Have a function called when the node ends; now if it already has.

    Raises:
        TypeError: It cannot be called.
    """
    _add_hook("client", h)


on_shutdown = add_client_shutdown_hook


def add_preshutdown_hook(h: Callable[[str], object]) -> None:
    """Have a function called with the reason when the node ends, after the program's own hooks.

    Raises:
        TypeError: It cannot be called.
    """
    _add_hook("preshutdown", h, "")


def add_shutdown_hook(h: Callable[[str], object]) -> None:
    """Have a function called with the reason when the node ends, after all other hooks.

    Raises:
        TypeError: It cannot be called.
    """
    _add_hook("shutdown", h, "")


def wait_for_shutdown() -> None:
    """Wait until the end has begun; any thread, any number of them."""
    # In slices: a signal that Python sees right before a wait would have to wait, too.
    while state.context is not None and not state.context.wait_for_shutdown(_SLICE):
        pass


def get_node_uri() -> str | None:
    """Return what identifies the node's process; no address that XML-RPC could call."""
    if state.node is None:
        return None
    process = state.node.process
    return f"rosz://{process.host}:{process.pid}/"


def get_ros_root(required: bool = False, env: dict[str, str] | None = None) -> str | None:
    """Return ``ROS_ROOT``, which nothing here needs.

    Raises:
        ROSException: It is required, and not set.
    """
    root = (os.environ if env is None else env).get("ROS_ROOT")
    if required and not root:
        raise ROSException("ROS_ROOT is not set")
    return root


def parse_rosrpc_uri(uri: str) -> tuple[str, int]:
    """Return host and port of a ``rosrpc://`` address.

    Raises:
        ValueError: It is none.
    """
    parts = urlparse(uri if uri.startswith("rosrpc://") else "")
    if not parts.hostname or parts.port is None:
        raise ValueError(f"expected an address such as rosrpc://host:1234, got '{uri}'")
    return parts.hostname, parts.port


def rospydebug(msg: object, *args: object) -> None:
    """Log what only developers of rospy want to know."""
    if state.node is not None:
        state.node.log.child("rospy").debug(msg, *args)


def rospyinfo(msg: object, *args: object) -> None:
    """Log what goes as it should."""
    if state.node is not None:
        state.node.log.child("rospy").info(msg, *args)


def rospywarn(msg: object, *args: object) -> None:
    """Log what was not expected."""
    if state.node is not None:
        state.node.log.child("rospy").warning(msg, *args)


def rospyerr(msg: object, *args: object) -> None:
    """Log what failed."""
    if state.node is not None:
        state.node.log.child("rospy").error(msg, *args)


def deprecated(function: Callable[..., object]) -> Callable[..., object]:
    """Return a function as it is."""
    return function


__getattr__ = attribute(
    __name__,
    {
        name: "rosz.ros1.rospy.logs"
        for level in ("debug", "info", "warn", "err", "fatal")
        for name in (
            f"log{level}",
            f"log{level}_once",
            f"log{level}_throttle",
            f"log{level}_throttle_identical",
        )
    },
)
