"""rospy.core: the shutdown of the node, and the log functions (ROS wiki, rospy/Overview).

Before ``init_node`` the log functions write to Python's logger ``rosout``, as in rospy: warnings
and worse appear on stderr. Afterwards they write to the log of the node, and so does whatever
the program logs to that logger and its children. The level of that logger is applied too.
"""

from __future__ import annotations

import atexit
import logging
import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable
from functools import partial
from types import FrameType
from typing import Any
from urllib.parse import urlparse

from rosz.names import is_valid
from rosz.node import of_program
from rosz.ros1.client.rospy.names import (
    canonicalize_name,
    get_caller_id,
    get_mappings,
    get_name,
    get_namespace,
    get_resolved_mappings,
    remap_name,
    resolve_name,
)
from rosz.ros1.exceptions import (
    ROSException,
    ROSInitException,
    ROSInterruptException,
    ROSSerializationException,
)
from rosz.ros1.modules import attribute
from rosz.ros1.state import has_node, node_uri, run_hooks, state
from rosz.ros1.state import is_shutdown as node_is_shutdown
from rosz.session import clamp_timeout
from rosz.time import DurationValue

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
    "logdebug",
    "logdebug_once",
    "logdebug_throttle",
    "logdebug_throttle_identical",
    "logerr",
    "logerr_once",
    "logerr_throttle",
    "logerr_throttle_identical",
    "logfatal",
    "logfatal_once",
    "logfatal_throttle",
    "logfatal_throttle_identical",
    "loginfo",
    "loginfo_once",
    "loginfo_throttle",
    "loginfo_throttle_identical",
    "logout",
    "logwarn",
    "logwarn_once",
    "logwarn_throttle",
    "logwarn_throttle_identical",
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

NO_LIMIT = 30 * 86400.0
"""Seconds that a wait takes without a time limit; a shutdown ends it earlier."""

SLICE = 0.5
"""Seconds between two looks at the shutdown during a wait."""

SHUT_DOWN = "rospy shutdown"
"""Text of the error of a wait that a shutdown ends."""

_HOOKS_TAKE = 10.0
"""Seconds that a signal handler of the program waits for the shutdown."""

atexit.register(run_hooks, "atexit")


# The shutdown.


is_initialized = has_node


def is_shutdown() -> bool:
    """Return whether the node is shut down.

    In the main thread it waits for hooks that run, up to 10 s: as in rospy, they run alone.
    """
    if state.lifecycle.closing and threading.current_thread() is threading.main_thread():
        run_hooks("")
    return node_is_shutdown()


is_shutdown_requested = is_shutdown


def signal_shutdown(reason: object) -> None:
    """Shut the node down: run the hooks, then close everything. Again is not an error.

    Args:
        reason: Reason for hooks and log.
    """
    run_hooks(str(reason))
    if state.context is not None:
        state.context.shutdown(str(reason))


def chain_signals() -> None:
    """Shut the node down before the program's own signal handlers run, as in rospy.

    Only the main thread can set signal handlers; on other threads this does nothing.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    for number in (signal.SIGINT, signal.SIGTERM):
        own = of_program(number)
        if own is not None:
            signal.signal(number, partial(_shut_down_first, own))


def _shut_down_first(
    own: Callable[[int, FrameType | None], object], number: int, frame: FrameType | None
) -> None:
    # On another thread, since this one may hold a lock that the shutdown needs.
    thread = threading.Thread(target=signal_shutdown, args=(f"signal-{number}",), daemon=True)
    thread.start()
    thread.join(_HOOKS_TAKE)
    own(number, frame)


def _add_hook(stage: str, hook: Callable[..., object], *late: str) -> None:
    if not callable(hook):
        raise TypeError(
            f"shutdown hook [{hook}] must be a function or callable object: {type(hook)}"
        )
    with state.lock:
        if not node_is_shutdown():
            state.hooks[stage].append(hook)
            return
    hook(*late)


def add_client_shutdown_hook(h: Callable[[], object]) -> None:
    """Call a function when the node shuts down; now if it is shut down already.

    Raises:
        TypeError: The argument cannot be called.
    """
    _add_hook("client", h)


on_shutdown = add_client_shutdown_hook


def add_preshutdown_hook(h: Callable[[str], object]) -> None:
    """Call a function with the reason, after the hooks of the program; see `on_shutdown`."""
    _add_hook("preshutdown", h, "")


def add_shutdown_hook(h: Callable[[str], object]) -> None:
    """Call a function with the reason, after all other hooks; see `on_shutdown`."""
    _add_hook("shutdown", h, "")


def warn_of_illegal_name(name: str, stacklevel: int) -> None:
    """Warn of a name that ROS 1 takes, but not all of its tools.

    ``stacklevel`` is the number of frames up to the one that gave the name, 1 for the caller.
    """
    if not is_valid(name):
        warnings.warn(
            f"'{name}' is not a legal ROS graph resource name. This may cause problems with"
            " other ROS tools",
            stacklevel=stacklevel + 1,
        )


def check_running() -> None:
    """Raise a ROSInterruptException if the node is shut down."""
    if is_shutdown():
        raise ROSInterruptException(SHUT_DOWN)


def deadline_of(timeout: float | DurationValue | None) -> float:
    """Return the ``time.monotonic()`` at which a wait with a timeout ends.

    Raises:
        UsageError: The timeout is not a number.
    """
    if timeout is None:
        return time.monotonic() + NO_LIMIT
    seconds = timeout.to_sec() if isinstance(timeout, DurationValue) else timeout
    return time.monotonic() + clamp_timeout(seconds)


def wait_for_shutdown() -> None:
    """Wait until the node is shut down; any number of threads may wait."""
    # In slices: Python would not notice a signal that comes right before a longer wait.
    while state.context is not None and not state.context.wait_for_shutdown(SLICE):
        pass


_missing = attribute("rospy.core", sys.modules[__name__], {})


def __getattr__(name: str) -> Any:
    """Return rospy's variable for the shutdown, which programs read."""
    return node_is_shutdown() if name == "_in_shutdown" else _missing(name)


# The environment.


def get_node_uri() -> str | None:
    """Return the URI of the node, or None before ``init_node``; nothing listens there."""
    if state.node is None:
        return None
    process = state.node.process
    return node_uri(process.zid, process.node_id, process.host)


def get_ros_root(required: bool = False, env: dict[str, str] | None = None) -> str | None:
    """Return ``ROS_ROOT``, which rosz does not use.

    Raises:
        ROSException: It is required, and not set.
    """
    root = (os.environ if env is None else env).get("ROS_ROOT")
    if required and not root:
        raise ROSException("ROS_ROOT is not set")
    return root


def parse_rosrpc_uri(uri: str) -> tuple[str, int]:
    """Return host and port of a ``rosrpc://`` URI.

    Raises:
        ValueError: The text is not such a URI.
    """
    parts = urlparse(uri if uri.startswith("rosrpc://") else "")
    if not parts.hostname or parts.port is None:
        raise ValueError(f"expected a URI such as rosrpc://host:1234, got '{uri}'")
    return parts.hostname, parts.port


# The log.

DEBUG, INFO, WARN, ERROR, FATAL = 1, 2, 4, 8, 16
"""Levels of rosgraph_msgs/Log."""

LEVELS = {
    DEBUG: logging.DEBUG,
    INFO: logging.INFO,
    WARN: logging.WARNING,
    ERROR: logging.ERROR,
    FATAL: logging.CRITICAL,
}
"""ROS 1's levels to those of Python."""

_rospy_to_logging_levels = LEVELS

_BASE = "rosout"
_CALLER = 3


def _write(level: int, msg: object, args: tuple[object, ...], options: dict[str, Any]) -> None:
    """Log on behalf of the caller of the calling function."""
    child = options.pop("logger_name", None)
    if state.node is None:
        for needs_node in ("once", "throttle", "throttle_identical"):
            options.pop(needs_node, None)
        plain = logging.getLogger(f"{_BASE}.{child}" if child else _BASE)
        plain.log(level, msg, *args, stacklevel=_CALLER, **options)
        return
    _apply_python_level()
    log = state.node.log.child(child) if child else state.node.log
    log.log(level, msg, *args, stacklevel=_CALLER, **options)


def _apply_python_level() -> None:
    """Apply the level that the program has set on Python's logger ``rosout``."""
    level = logging.getLogger(_BASE).level
    if level != state.python_level and state.node is not None:
        state.python_level = level
        state.node.log.setLevel(level)


def _log(level: int, **fixed: bool) -> Callable[..., None]:
    def log(msg: object, *args: object, **kwargs: Any) -> None:
        _write(level, msg, args, {**kwargs, **fixed})

    return log


def _throttled(level: int, option: str) -> Callable[..., None]:
    def log(period: float, msg: object, *args: object, **kwargs: Any) -> None:
        _write(level, msg, args, {**kwargs, option: float(period)})

    return log


_ALL = tuple(LEVELS.values())

logdebug, loginfo, logwarn, logerr, logfatal = (_log(level) for level in _ALL)
logout = loginfo
logdebug_once, loginfo_once, logwarn_once, logerr_once, logfatal_once = (
    _log(level, once=True) for level in _ALL
)
logdebug_throttle, loginfo_throttle, logwarn_throttle, logerr_throttle, logfatal_throttle = (
    _throttled(level, "throttle") for level in _ALL
)
(
    logdebug_throttle_identical,
    loginfo_throttle_identical,
    logwarn_throttle_identical,
    logerr_throttle_identical,
    logfatal_throttle_identical,
) = (_throttled(level, "throttle_identical") for level in _ALL)


def _rospy_log(level: int) -> Callable[..., None]:
    def log(msg: object, *args: object) -> None:
        if state.node is not None:
            state.node.log.child("rospy").log(level, msg, *args, stacklevel=2)

    return log


rospydebug, rospyinfo, rospywarn, rospyerr = (_rospy_log(level) for level in _ALL[:-1])


_FROM_PYTHON = "rosz_from_python"


class _ProgramHandlers(logging.Handler):
    """Passes rospy's records to handlers that the program adds to Python's logger ``rosout``."""

    def handle(self, record: logging.LogRecord) -> bool:
        """Pass a record on, unless Python's logger has done so; those handlers lock themselves."""
        if hasattr(record, _FROM_PYTHON):
            return False
        logger: logging.Logger | None = logging.getLogger(record.name)
        while logger is not None:
            for handler in logger.handlers:
                if record.levelno >= handler.level and not isinstance(handler, PythonLogHandler):
                    handler.handle(record)
            logger = logger.parent if logger.propagate else None
        return True


class PythonLogHandler(logging.Handler):
    """Passes records of Python's logger ``rosout`` to the log of the node."""

    def emit(self, record: logging.LogRecord) -> None:
        """Pass a record on."""
        node = state.node
        if node is None:
            return
        child = record.name.removeprefix(_BASE).strip(".")
        log = node.log.child(child) if child else node.log
        if log.isEnabledFor(record.levelno):
            setattr(record, _FROM_PYTHON, True)
            log.handle(record)

    @classmethod
    def install(cls, level: int) -> None:
        """Add a handler to the logger ``rosout``, with the level of the node."""
        python = logging.getLogger(_BASE)
        if state.node is not None:
            state.node.log.addHandler(_ProgramHandlers())
        if not any(isinstance(handler, cls) for handler in python.handlers):
            python.addHandler(cls())
            python.propagate = False
            if python.level == logging.NOTSET:
                python.setLevel(level)
        state.python_level = python.level
