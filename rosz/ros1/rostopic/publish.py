"""rostopic: publishing messages that are given as values."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import yaml

from rosz.errors import EncodeError, TypeNotFound
from rosz.introspect.arguments import make_message
from rosz.introspect.publish import ONCE_SECONDS
from rosz.ros1 import rospy
from rosz.ros1.genpy import get_message_class, get_printable_message_args
from rosz.ros1.rosgraph.names import script_resolve_name
from rosz.ros1.rostopic.topics import NAME, ROSTopicException
from rosz.ros1.state import has_node

__all__ = (
    "SUBSCRIBER_TIMEOUT",
    "argv_publish",
    "create_publisher",
    "file_yaml_arg",
    "param_publish_once",
    "publish_message",
    "stdin_yaml_arg",
    "wait_for_subscriber",
)

SUBSCRIBER_TIMEOUT = 5.0
"""Seconds for which ROS 1's rostopic waits for subscribers."""
_END_OF_DOCUMENT = "---"


def create_publisher(
    topic_name: str, topic_type: str, latch: bool, disable_rostime: bool = True
) -> tuple[Any, type[Any]]:
    """Create a publisher, and return it with its message class.

    A process without a node becomes one.

    Args:
        topic_name: Name of the topic.
        topic_type: Type name, such as ``std_msgs/String``.
        latch: Whether later subscribers receive the last message.
        disable_rostime: Whether to use wall time even in simulation.

    Raises:
        ROSTopicException: The type does not exist.
    """
    try:
        found = get_message_class(topic_type)
    except (TypeNotFound, ValueError) as error:
        raise ROSTopicException(f"invalid topic type: {topic_type}") from error
    if found is None:
        raise ROSTopicException(
            f"invalid message type: {topic_type}. Is its package on ROSZ_PACKAGE_PATH?"
        )
    if not has_node():
        rospy.init_node(NAME, anonymous=True, disable_rosout=True, disable_rostime=disable_rostime)
    name = script_resolve_name(NAME, topic_name)
    return rospy.Publisher(name, found, latch=latch, queue_size=100), found


def publish_message(  # noqa: PLR0917  # ROS 1's
    pub: Any,
    msg_class: type[Any],
    pub_args: Sequence[Any],
    rate: float | None = None,
    once: bool = False,
    verbose: bool = False,
    substitute_keywords: bool = False,
) -> None:
    """Publish a message built from values.

    Args:
        pub: The publisher.
        msg_class: Message class of the publisher.
        pub_args: List of one dict of fields, or of a value for each field.
        rate: Rate in Hz; when not given, publish once, and wait for the shutdown.
        once: Whether to return instead of waiting.
        verbose: Whether to write the messages to stdout.
        substitute_keywords: Whether to replace ``now`` and ``auto`` for each message anew.

    Raises:
        ROSTopicException: The values do not fit.
    """
    message = _make(msg_class, pub_args)
    if rate is None:
        what = f"[{message}]" if verbose else "message"
        end = f" for {ONCE_SECONDS} seconds" if once else ". Press ctrl-C to terminate"
        sys.stdout.write(f"publishing and latching {what}{end}\n")
        pub.publish(message)
        if not once:
            rospy.spin()
        return
    pace = rospy.Rate(float(rate))
    while not rospy.is_shutdown():
        if substitute_keywords:
            message = _make(msg_class, pub_args)
        if verbose:
            sys.stdout.write(f"publishing {message}\n")
        pub.publish(message)
        pace.sleep()


def _make(cls: type[Any], arguments: Sequence[Any]) -> Any:
    try:
        return make_message(cls, arguments, rospy.get_rostime().to_nsec())
    except EncodeError as error:
        raise ROSTopicException(
            f"{error}\n\nArgs are: [{get_printable_message_args(cls())}]"
        ) from error


def argv_publish(  # noqa: PLR0917  # ROS 1's
    pub: Any,
    msg_class: type[Any],
    pub_args: Sequence[Any],
    rate: float | None,
    once: bool,
    verbose: bool,
    substitute_keywords: bool = False,
) -> None:
    """Publish a message as `publish_message`; if once, stay until late subscribers have it."""
    publish_message(pub, msg_class, pub_args, rate, once, verbose, substitute_keywords)
    if once:
        rospy.rostime.wallsleep(ONCE_SECONDS)


def param_publish_once(pub: Any, msg_class: type[Any], param_name: str, verbose: bool) -> None:
    """Publish a message whose values are a parameter.

    Raises:
        ROSTopicException: The parameter is not set, or its values do not fit.
    """
    if not rospy.has_param(param_name):
        raise ROSTopicException(f"parameter does not exist: {param_name}")
    argv_publish(pub, msg_class, [rospy.get_param(param_name)], None, True, verbose)


def wait_for_subscriber(pub: Any, timeout: float) -> None:
    """Wait until a publisher has a subscriber.

    Args:
        pub: The publisher.
        timeout: Longest time to wait, in seconds.
    """
    pub.impl.wait_for_subscribers(timeout)


def file_yaml_arg(filename: str) -> Callable[[], Iterator[list[Any]]]:
    """Return a function that yields the documents of a YAML file, each as a list of arguments.

    Raises:
        ROSTopicException: The file does not exist; the function raises it if the file is not YAML.
    """
    path = Path(filename)
    if not path.is_file():
        raise ROSTopicException(f"file does not exist: {filename}")

    def read() -> Iterator[list[Any]]:
        try:
            for document in yaml.safe_load_all(path.read_text("utf-8")):
                yield [document]
        except yaml.YAMLError as error:
            raise ROSTopicException(f"invalid YAML in file: {error}") from error

    return read


def stdin_yaml_arg() -> Iterator[Any]:
    """Yield the YAML documents of standard input, which ``---`` ends."""
    lines: list[str] = []
    for line in sys.stdin:
        if line.strip() != _END_OF_DOCUMENT:
            lines.append(line)
            continue
        text, lines = "".join(lines), []
        try:
            found = yaml.safe_load(text)
        except yaml.YAMLError as error:
            sys.stderr.write(f"Invalid YAML: {error}\n")
            continue
        if found is not None:
            yield found
