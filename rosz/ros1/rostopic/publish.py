"""Publishing by the names of a topic and its type."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

from rosz.errors import EncodeError, TypeNotFound
from rosz.introspect.arguments import make_message
from rosz.introspect.publish import ONCE_SECONDS
from rosz.ros1 import rospy
from rosz.ros1.genpy.message import get_message_class, get_printable_message_args
from rosz.ros1.rosgraph.names import script_resolve_name
from rosz.ros1.rospy import state
from rosz.ros1.rostopic.topics import NAME, ROSTopicException

__all__ = ("create_publisher", "publish_message")


def create_publisher(
    topic_name: str, topic_type: str, latch: bool, disable_rostime: bool = True
) -> tuple[Any, type[Any]]:
    """Return a publisher of a topic, and the class of its messages.

    A process that is no node yet becomes one.

    Args:
        topic_name: The topic.
        topic_type: ``std_msgs/String``.
        latch: Whether late joiners get the last message.
        disable_rostime: Whether to go by wall time though there is a simulation.

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
    if not state.has_node():
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
    """Publish a message made of values.

    Args:
        pub: The publisher.
        msg_class: Class of its messages.
        pub_args: A dict of fields in a list, or a value for each field.
        rate: How often per second; once, and to stay, when not given.
        once: Whether not to stay.
        verbose: Whether to write what is published to stdout.
        substitute_keywords: Whether ``now`` and ``auto`` are filled in anew each time.

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
