"""rostopic: the topics of the network, their types and nodes, and publishing given values."""

from __future__ import annotations

import functools
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import yaml

from rosz import introspect
from rosz.errors import EncodeError, NotFoundError, RoszError, TypeNotFound, UsageError
from rosz.names import ros1_type
from rosz.ros1.client import rospy
from rosz.ros1.client.genpy import get_message_class, get_printable_message_args
from rosz.ros1.importer import type_store
from rosz.ros1.state import find, has_node, ready_context, survey
from rosz.ros1.tools.rosgraph.masterapi import Master
from rosz.ros1.tools.rosgraph.names import script_resolve_name
from rosz.wire import Kind

NAME = "rostopic"
_LOOK_SECONDS = 0.1
SUBSCRIBER_TIMEOUT = 5.0
"""Seconds for which ROS 1's rostopic waits for subscribers."""
_END_OF_DOCUMENT = "---"

FieldReader = Callable[[Any], Any]
Found = tuple[str, str, FieldReader | None] | tuple[None, None, None]
"""Type name, topic, and the reader of a field; the reader is None for the whole message."""


class ROSTopicException(Exception):
    """A topic, its type or a message is wrong."""


class ROSTopicIOException(ROSTopicException):
    """The network did not answer."""


def msgevalgen(pattern: str) -> FieldReader | None:
    """Return a function that reads a field of a message.

    Args:
        pattern: Path of the field, such as ``/pose/position/x`` or ``/ranges[0]``.

    Returns:
        A function of a message, which writes to stderr and returns None if there is no such field;
        None if the pattern is empty, or invalid, which is written to stderr.
    """
    try:
        path = introspect.FieldPath(pattern)
    except UsageError as error:
        sys.stderr.write(f"{error}\n")
        return None
    return functools.partial(_follow, path, path.steps) if path.steps else None


def _follow(path: introspect.FieldPath, steps: Sequence[Any], value: Any) -> Any:
    """Return the field at the end of some steps; None, and a line on stderr, if there is none."""
    for number, step in enumerate(steps, 1):
        try:
            value = getattr(value, step.name)
        except AttributeError:
            sys.stderr.write(f"no field named {step.name} in {path.text}\n")
            return None
        if step.index is None:
            continue
        try:
            value = value[step.index]
        except (LookupError, TypeError) as error:
            sys.stderr.write(f"{error}: {path.text}\n")
            return None
        if isinstance(step.index, slice) and not isinstance(value, str):
            return [_follow(path, steps[number:], item) for item in value]
    return value


def get_topic_type(topic: str, blocking: bool = False) -> Found:
    """Return the type of a topic.

    Args:
        topic: Name of the topic; the path of a field may follow.
        blocking: Whether to wait until the topic has a publisher or subscriber.

    Returns:
        Type name, name of the topic, and the reader of the field; or None three times.
    """
    target = _find(topic)
    if target[0] is None and blocking:
        sys.stderr.write(f"WARNING: topic [{topic}] does not appear to be published yet\n")
        pause = threading.Event()
        while target[0] is None and not ready_context().is_shutdown:
            pause.wait(_LOOK_SECONDS)
            target = _find(topic)
    return target


def _find(topic: str) -> Found:
    try:
        target = find(
            lambda view: introspect.find_target(topic, view.topics(), type_store().message)
        )
    except TypeNotFound:
        raise
    except NotFoundError:
        return None, None, None
    return ros1_type(target.topic, target.type_name), target.topic, msgevalgen(target.path.text)


def get_topic_class(
    topic: str, blocking: bool = False
) -> tuple[type[Any] | None, str | None, FieldReader | None]:
    """Return the message class of a topic; see `get_topic_type`.

    Raises:
        ROSTopicException: The definition of the type is not found.
    """
    type_name, name, read = get_topic_type(topic, blocking)
    if type_name is None:
        return None, None, None
    message_class = get_message_class(type_name)
    if message_class is None:
        raise ROSTopicException(
            f"Cannot load message class for [{type_name}]. Is its package on ROSZ_PACKAGE_PATH?"
        )
    return message_class, name, read


def find_by_type(topic_type: str) -> list[str]:
    """Return the names of the topics of a type."""
    return introspect.topics_of_type(introspect.list_topics(survey().view.tokens), topic_type)


def get_topic_list(master: Master | None = None) -> tuple[list[Any], list[Any]]:  # noqa: ARG001
    """Return the topics that have publishers, and those that have subscribers.

    Args:
        master: Ignored.

    Returns:
        Two lists of topics, each with its type and the names of its nodes.
    """
    alive = survey()
    return _with_nodes(alive, Kind.PUBLISHER), _with_nodes(alive, Kind.SUBSCRIPTION)


def _with_nodes(alive: introspect.Survey, kind: Kind) -> list[Any]:
    topics: dict[str, tuple[str, dict[str, None]]] = {}
    for token in alive.view.entities(kind):
        _, nodes = topics.setdefault(token.name, (ros1_type(token.name, token.type_name), {}))
        nodes[token.node_name] = None
    return [[name, type_name, list(nodes)] for name, (type_name, nodes) in topics.items()]


def get_info_text(topic: str) -> str:
    """Return the text of ``rostopic info``.

    Raises:
        ROSTopicException: The topic has no publishers and no subscribers.
    """
    try:
        return introspect.format_topic(survey(), topic)
    except RoszError as error:
        raise ROSTopicException(f"Unknown topic {topic}") from error


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
        message_class = get_message_class(topic_type)
    except (TypeNotFound, ValueError) as error:
        raise ROSTopicException(f"invalid topic type: {topic_type}") from error
    if message_class is None:
        raise ROSTopicException(
            f"invalid message type: {topic_type}. Is its package on ROSZ_PACKAGE_PATH?"
        )
    if not has_node():
        rospy.init_node(NAME, anonymous=True, disable_rosout=True, disable_rostime=disable_rostime)
    name = script_resolve_name(NAME, topic_name)
    return rospy.Publisher(name, message_class, latch=latch, queue_size=100), message_class


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
        end = f" for {introspect.ONCE_SECONDS} seconds" if once else ". Press ctrl-C to terminate"
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
        return introspect.make_message(cls, arguments, rospy.get_rostime().to_nsec())
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
        rospy.rostime.wallsleep(introspect.ONCE_SECONDS)


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
            value = yaml.safe_load(text)
        except yaml.YAMLError as error:
            sys.stderr.write(f"Invalid YAML: {error}\n")
            continue
        if value is not None:
            yield value
