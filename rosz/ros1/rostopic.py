"""rostopic: topics, their types and rates, and publishing by type name (ROS wiki, rostopic).

``CallbackEcho``, ``ROSTopicBandwidth``, ``ROSTopicDelay`` and the functions that parse command
lines are missing; the command is ``rosz topic``, and its parts are in ``rosz.introspect``.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from rosz.errors import EncodeError, NotFoundError, RoszError, TypeNotFound
from rosz.introspect.arguments import make_message
from rosz.introspect.fields import FieldPath, find_target
from rosz.introspect.measure import RateMeter, format_rate, format_rates
from rosz.introspect.publish import ONCE_SECONDS
from rosz.introspect.survey import Survey
from rosz.introspect.topics import format_topic, list_topics, topics_of_type
from rosz.names import short_type
from rosz.ros1 import rospy
from rosz.ros1.genpy import get_message_class, get_printable_message_args
from rosz.ros1.importer import type_store
from rosz.ros1.rosgraph.masterapi import Master
from rosz.ros1.rosgraph.names import script_resolve_name
from rosz.ros1.state import has_node, ready_context, survey
from rosz.wire import Kind

__all__ = (
    "NAME",
    "ROSTopicException",
    "ROSTopicHz",
    "ROSTopicIOException",
    "create_publisher",
    "find_by_type",
    "get_info_text",
    "get_topic_class",
    "get_topic_list",
    "get_topic_type",
    "msgevalgen",
    "publish_message",
)

NAME = "rostopic"
_LOOK_SECONDS = 0.1

FieldReader = Callable[[Any], Any]
Stats = tuple[float, float, float, float, int]
"""Rate in Hz; least, largest and standard deviation of the period in seconds; message count."""

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
        A function of a message that returns None if there is no such field; None if the pattern
        is empty.

    Raises:
        UsageError: The pattern is invalid.
    """
    if not pattern or pattern == "/":
        return None
    path = FieldPath(pattern)

    def read(message: Any) -> Any:
        try:
            return path.read(message)
        except (AttributeError, LookupError, TypeError):
            return None

    return read


def get_topic_type(topic: str, blocking: bool = False) -> Found:
    """Return the type of a topic.

    Args:
        topic: Name of the topic; the path of a field may follow.
        blocking: Whether to wait until the topic has a publisher or subscriber.

    Returns:
        Type name, name of the topic, and the reader of the field; or None three times.
    """
    found = _find(topic)
    if found[0] is None and blocking:
        sys.stderr.write(f"WARNING: topic [{topic}] does not appear to be published yet\n")
        pause = threading.Event()
        while found[0] is None and not ready_context().is_shutdown:
            pause.wait(_LOOK_SECONDS)
            found = _find(topic)
    return found


def _find(topic: str) -> Found:
    try:
        target = find_target(topic, survey().view.topics(), type_store().message)
    except TypeNotFound:
        raise
    except NotFoundError:
        return None, None, None
    return short_type(target.type_name), target.topic, msgevalgen(target.path.text)


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
    found = get_message_class(type_name)
    if found is None:
        raise ROSTopicException(
            f"Cannot load message class for [{type_name}]. Is its package on ROSZ_PACKAGE_PATH?"
        )
    return found, name, read


def find_by_type(topic_type: str) -> list[str]:
    """Return the names of the topics of a type."""
    return topics_of_type(list_topics(survey().view.tokens), topic_type)


def get_topic_list(master: Master | None = None) -> tuple[list[Any], list[Any]]:  # noqa: ARG001
    """Return the topics that have publishers, and those that have subscribers.

    Args:
        master: Ignored.

    Returns:
        Two lists of topics, each with its type and the names of its nodes.
    """
    found = survey()
    return _with_nodes(found, Kind.PUBLISHER), _with_nodes(found, Kind.SUBSCRIPTION)


def _with_nodes(found: Survey, kind: Kind) -> list[Any]:
    topics: dict[str, tuple[str, dict[str, None]]] = {}
    for token in found.view.entities(kind):
        _, nodes = topics.setdefault(token.name, (short_type(token.type_name), {}))
        nodes[token.node_name] = None
    return [[name, type_name, list(nodes)] for name, (type_name, nodes) in topics.items()]


def get_info_text(topic: str) -> str:
    """Return the text of ``rostopic info``.

    Raises:
        ROSTopicException: The topic has no publishers and no subscribers.
    """
    try:
        return format_topic(survey(), topic)
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
        ROSTopicException: There is no such type.
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


class ROSTopicHz:
    """Measures rates of topics: `callback_hz` is a callback for subscribers.

    Args:
        window_size: Number of messages to average; 50 000 if negative.
        filter_expr: Function of a message that returns whether to count it.
        use_wtime: Whether to use wall time even in simulation.
    """

    def __init__(
        self,
        window_size: int,
        filter_expr: Callable[[Any], bool] | None = None,
        use_wtime: bool = False,
    ) -> None:
        self.window_size = window_size
        self.filter_expr = filter_expr
        self.use_wtime = use_wtime
        self._meters: dict[str | None, RateMeter] = {}

    def _meter(self, topic: str | None) -> RateMeter:
        meter = self._meters.get(topic)
        if meter is None:
            window = None if self.window_size < 0 else self.window_size
            meter = self._meters.setdefault(topic, RateMeter(window))
        return meter

    def callback_hz(self, m: Any, topic: str | None = None) -> None:
        """Count a message.

        Args:
            m: The message.
            topic: Name of the topic.
        """
        if self.filter_expr is not None and not self.filter_expr(m):
            return
        now = time.time_ns() if self.use_wtime else ready_context().clock.now()
        self._meter(topic).tick(now)

    def get_hz(self, topic: str | None = None) -> Stats | None:
        """Return the measured rate, or None if there are no new messages since the last call."""
        stats = self._meter(topic).stats()
        if stats is None:
            return None
        return stats.rate, stats.min_delta, stats.max_delta, stats.std_dev, stats.window

    def print_hz(self, topics: Iterable[str | None] = (None,)) -> None:
        """Write the measured rates to stdout."""
        names = list(topics)
        if len(names) == 1:
            text = format_rate(self._meter(names[0]).stats())
        else:
            text = format_rates({str(name): self._meter(name).stats() for name in names})
        sys.stdout.write(f"{text}\n")
