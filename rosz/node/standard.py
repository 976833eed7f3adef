"""The standard parts of a node: initial parameters, ``/clock``, ``/rosout``, logger services."""

from __future__ import annotations

import threading
from contextlib import suppress
from typing import Any

from rosz.errors import ClosedError, NotFoundError, UsageError, YamlError
from rosz.node.core import NodeCore
from rosz.node.publisher import Publisher
from rosz.node.service import Service
from rosz.node.subscription import Subscription
from rosz.qos import CLOCK, ROSOUT, SERVICES
from rosz.worker import start_thread

_SECOND = 1_000_000_000
_THREADS = 16
_SIM_TIME = "~use_sim_time"


def set_initial_params(node: NodeCore) -> None:
    """Set the private parameters that the command line gives (``_name:=value``).

    An argument without a value (``_name:=``) sets nothing, as in rospy.

    Raises:
        UsageError: A value is not YAML.
    """
    if not node.context.arguments.params:
        return
    from rosz.params.yaml import read_plain

    for name, text in node.context.arguments.params.items():
        try:
            value = next(read_plain(text, "<value>"), None)
        except YamlError as error:
            raise UsageError(
                f"argument '_{name}:={text}' is not a YAML value: {error.reason}"
            ) from error
        if value is not None:
            node.params[f"~{name}"] = value


def follow_clock(node: NodeCore) -> None:
    """Simulate time if ``~use_sim_time`` says so or, as in ROS 1, ``/use_sim_time``.

    Reading the parameter makes the process a replica of the store, as every node is.
    """
    params = node.params
    simulate(node, on=params.get(_SIM_TIME, params.get("/use_sim_time", False)) is True)


def simulate(node: NodeCore, *, on: bool = True) -> None:
    """Take the time of a node from ``/clock``, or from the system if not ``on``."""
    clock = node.clock
    if not on:
        if node.time_topic is not None:
            node.time_topic.close()
            node.time_topic = None
            clock.disable_simulation()
        return
    if node.time_topic is not None:
        return
    from rosz.msgs.rosgraph_msgs.msg import Clock

    clock.enable_simulation()

    def tick(message: Clock) -> None:
        if clock.simulated:
            clock.advance(message.clock.sec * _SECOND + message.clock.nanosec)

    topic = node.resolve("/clock")
    node.time_topic = node.keep(Subscription(node, topic, Clock, tick, CLOCK))


def open_rosout(node: NodeCore) -> None:
    """Publish a node's log, from a thread: nothing waits for the message type to load."""
    _start("rosz-rosout-open", _open_rosout, node)


def serve_loggers(node: NodeCore) -> None:
    """Serve ``~get_loggers`` and ``~set_logger_level``, by which ROS 1 tools set levels."""
    _start("rosz-loggers", _serve_loggers, node)


def _start(name: str, target: Any, node: NodeCore) -> None:
    def run() -> None:
        with suppress(ClosedError):  # a program that ends within its first moments
            target(node)

    start_thread(threading.Thread(target=run, name=name, daemon=True))


def _open_rosout(node: NodeCore) -> None:
    from rosz.msgs.builtin_interfaces.msg import Time
    from rosz.msgs.rcl_interfaces.msg import Log

    rosout = node.keep(Publisher(node, node.resolve("/rosout"), Log, ROSOUT))

    def publish(  # noqa: PLR0917  # the signature of RosoutHandler
        level: int, name: str, message: str, file: str, function: str, line: int, stamp: int
    ) -> None:
        time = Time(*divmod(stamp, _SECOND))
        rosout.publish(Log(time, level, name, _valid(message), _valid(file), function, line))

    node.log.publish_to(publish)


def _valid(text: str) -> str:
    """Return a text with escapes for bytes that no message can hold, as in the name of a file."""
    return text.encode(errors="backslashreplace").decode().replace("\0", "\\x00")


def _serve_loggers(node: NodeCore) -> None:
    from rosz.msgs.roscpp.msg import Logger
    from rosz.msgs.roscpp.srv import GetLoggers, SetLoggerLevel

    def get_loggers(_request: Any) -> Any:
        levels = node.log.get_levels()
        return GetLoggers.Response([Logger(name, level) for name, level in levels.items()])

    def set_level(request: Any) -> Any:
        try:
            node.log.set_level(request.logger, request.level)
        except (NotFoundError, UsageError) as error:
            # As in rospy, the caller gets no error.
            node.log.warning("cannot set the level of a logger: %s", error)
        return SetLoggerLevel.Response()

    for name, kind, handler in (
        ("~get_loggers", GetLoggers, get_loggers),
        ("~set_logger_level", SetLoggerLevel, set_level),
    ):
        node.keep(Service(node, node.resolve(name), kind, handler, SERVICES, _THREADS))
