"""What every node has without being asked: a log, tokens, first parameters, /rosout, /clock."""

from __future__ import annotations

import os
import socket
import threading
from typing import TYPE_CHECKING

from rosz.errors import ClosedError, UsageError, YamlError
from rosz.node.console import DEFAULT_FORMAT
from rosz.node.log import NodeLog
from rosz.qos import CLOCK, ROSOUT
from rosz.wire import Kind, ProcessToken, Token, format_process, format_token

if TYPE_CHECKING:
    from rosz.node.channel import MessageInfo
    from rosz.node.node import Node

__all__ = (
    "announce",
    "follow_clock",
    "log_of",
    "open_rosout",
    "process_of",
    "set_initial_params",
    "simulate",
)

_SECOND = 1_000_000_000


def process_of(node: Node) -> ProcessToken:
    """Return what a node is as a process, as of now."""
    context = node.context
    return ProcessToken(
        context.domain,
        context.session.zid,
        node.node_id,
        context.session.stamp().time,
        os.getpid(),
        socket.gethostname(),
        node.name,
    )


def log_of(node: Node) -> NodeLog:
    """Return a node's log, by the environment and the command line."""
    environment = node.context.environment
    return NodeLog(
        node.name,
        clock=node.clock,
        log_dir=environment.log_dir,
        file_name=node.context.arguments.special.get("__log", ""),
        console_format=environment.console_format or DEFAULT_FORMAT,
        color=environment.color,
    )


def announce(node: Node) -> None:
    """Make a node known, to ROS 2 by its token and to rosz by that of its process."""
    session = node.context.session
    number, namespace = node.node_id, node.namespace
    token = Token(
        node.context.domain, session.zid, number, number, Kind.NODE, namespace, node.base_name
    )
    # Last to go what tells that it is of rosz: one that is not is offered ROS 2's services.
    for key in (format_process(node.process), format_token(token)):
        node.keep(session.token(key))


def set_initial_params(node: Node) -> None:
    """Set the private parameters that the command line gives (``_name:=value``).

    One without a value (``_name:=``) is not set, as in rospy.

    Raises:
        UsageError: A value is no YAML.
    """
    if not node.context.arguments.params:
        return
    from rosz.params.nodes import read_plain

    for name, text in node.context.arguments.params.items():
        try:
            value = next(read_plain(text, "<value>"), None)
        except YamlError as error:
            raise UsageError(
                f"argument '_{name}:={text}' is no YAML value: {error.reason}"
            ) from error
        if value is not None:
            node.params[f"~{name}"] = value


def follow_clock(node: Node) -> None:
    """Live in simulated time where the parameter /use_sim_time says so (ROS wiki, Clock).

    Reading it makes the process a replica of the parameters, as every node is.
    """
    if node.params.get("/use_sim_time", False) is True:
        simulate(node)


def simulate(node: Node) -> None:
    """Live in simulated time from now on, and take it from ``/clock``."""
    from rosz.msgs.rosgraph_msgs.msg import Clock

    clock = node.context.clock
    clock.enable_simulation()

    def tick(message: Clock, info: MessageInfo) -> None:
        now = message.clock.sec * _SECOND + message.clock.nanosec
        clock.advance(now, teller=info.gid, number=info.sequence)

    node.subscription("/clock", Clock, tick, qos=CLOCK, with_info=True)


def open_rosout(node: Node) -> None:
    """Publish a node's log, from a thread: nobody waits for the message type to load."""
    threading.Thread(
        target=_open_rosout, args=(node,), name="rosz-rosout-open", daemon=True
    ).start()


def _sent(text: str) -> str:
    """Return a text with what no message can hold, such as bytes of a file's name, written out."""
    return text.encode(errors="backslashreplace").decode().replace("\0", "\\x00")


def _open_rosout(node: Node) -> None:
    from rosz.msgs.builtin_interfaces.msg import Time
    from rosz.msgs.rcl_interfaces.msg import Log

    try:
        rosout = node.publisher("/rosout", Log, qos=ROSOUT)
    except ClosedError:
        return  # a program that ends within its first moments

    def publish(  # noqa: PLR0917  # the signature of RosoutSink
        level: int, name: str, message: str, file: str, function: str, line: int, stamp: int
    ) -> None:
        time = Time(*divmod(stamp, _SECOND))
        rosout.publish(Log(time, level, name, _sent(message), _sent(file), function, line))

    node.log.publish_to(publish)
